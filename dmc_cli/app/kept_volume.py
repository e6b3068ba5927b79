"""Keep an input's volume from one conversion to the next: what is read once serves several isovalues."""

from collections import Counter
from collections.abc import Sequence

from dmc_cli.field import DeviceVolume, upload_volume
from dmc_cli.runtime import Device
from dmc_cli.settings import ConvertSettings, ReadSettings
from dmc_cli.volume import Suggestions, Volume

Source = tuple[str, ReadSettings, str, int | None]


class KeptVolume:
    """The volume of the last conversion of a list, while the next ones have the same.

    It is used by one thread; each thread that works on a list has its own.
    """

    def __init__(self, items: Sequence[ConvertSettings]) -> None:
        self._uses = Counter(_source_of(item) for item in items)
        self._kept: Source | None = None
        self._volume: DeviceVolume | None = None
        self._suggestions: Suggestions | None = None

    def at_hand(self, settings: ConvertSettings) -> DeviceVolume | None:
        """Return the volume of an item if the last one had the same; else let go of what there is."""
        if self._kept != _source_of(settings):
            self._kept = self._volume = self._suggestions = None
        return self._volume

    def keep(self, settings: ConvertSettings, volume: Volume, device: Device) -> DeviceVolume:
        """Return an item's volume on the device, kept and indexed if several items have the same."""
        is_shared = self.is_shared(settings)
        found = upload_volume(volume, device, indexed=is_shared)
        if is_shared:
            self._kept, self._volume = _source_of(settings), found
        return found

    def suggestions(self, volume: Volume) -> Suggestions:
        """Return the isovalues that a volume suggests, which are found once for several conversions of it."""
        if self._suggestions is None or self._suggestions.volume is not volume:
            self._suggestions = Suggestions(volume)
        return self._suggestions

    def is_shared(self, settings: ConvertSettings) -> bool:
        """Return whether several items have an item's volume."""
        return self._uses[_source_of(settings)] > 1


def _source_of(settings: ConvertSettings) -> Source:
    """Return what decides which values an item has, and where they are."""
    return settings.input, settings.read, settings.device, settings.threads
