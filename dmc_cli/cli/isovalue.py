"""Answer those who gave no isovalue with the values that there are."""

from dmc_cli.errors import SettingsError
from dmc_cli.settings import ReadSettings


def missing_isovalue(input: str, settings: ReadSettings) -> SettingsError:
    """Return the error that names the range of the values in the volume, to choose from."""
    from dmc_cli.volume import intact
    from dmc_cli.volume_io import read_volume

    volume = read_volume(input, settings)
    with intact(volume.values, input):
        ends = volume.value_range()
    found = "no finite value" if ends is None else f"values from {ends[0]:g} to {ends[1]:g}"
    return SettingsError(f"no isovalue was given; {input} has {found}; choose one in that range with -i")
