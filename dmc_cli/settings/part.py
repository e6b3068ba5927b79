"""Say which part of a volume is wanted."""

import math
from dataclasses import dataclass

from dmc_cli.crops import parse_crop
from dmc_cli.errors import SettingsError
from dmc_cli.settings.types import settle_types


def _is_positive(text: str | None) -> bool:
    """Return whether a text is a positive number."""
    try:
        return 0 < float(text or "") < math.inf
    except ValueError:
        return False


@dataclass(frozen=True, kw_only=True)
class PartSettings:
    """Which part of the volume is wanted, on its nodes before contouring; the stages follow each other so.

    `crop` keeps a box of nodes: for x, y and z `first:last`, both kept, in nodes, `mm` of the volume's space
    or `%` of its extent, as in `10:200,:,25%:75%`. `cut_table` takes away what a scan's body lies on.
    `resample` takes nodes at another distance in mm, or `isotropic`; `smooth_volume` is the standard
    deviation of a Gaussian in mm. Of the object, `open_gaps` takes away what is thinner than so many mm,
    `close_gaps` fills gaps that are narrower. `keep` keeps the `largest` component of it, or so many;
    `min_volume` those of at least so many mm3. `fill_cavities` fills what the object encloses: `all`, or
    cavities of at most so many mm3.
    """

    crop: str | None = None
    cut_table: bool = False
    resample: str | None = None
    smooth_volume: float | None = None
    open_gaps: float | None = None
    close_gaps: float | None = None
    keep: str | None = None
    min_volume: float | None = None
    fill_cavities: str | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        for name in ("resample", "keep", "fill_cavities"):
            given = getattr(self, name)
            if isinstance(given, int | float) and not isinstance(given, bool):
                object.__setattr__(self, name, f"{given:g}")
        settle_types(self)
        if self.crop is not None:
            parse_crop(self.crop)
        self.most_kept  # noqa: B018 - which checks it
        self.largest_cavity  # noqa: B018
        if self.min_volume is not None and not 0 < self.min_volume < math.inf:
            raise SettingsError(f"min_volume is {self.min_volume}; expected a positive volume in mm3")
        for name in ("smooth_volume", "open_gaps", "close_gaps"):
            length = getattr(self, name)
            if length is not None and not 0 < length < math.inf:
                raise SettingsError(f"{name} is {length}; expected a positive length in mm")
        if self.resample not in (None, "isotropic") and not _is_positive(self.resample):
            raise SettingsError(
                f"resample is {self.resample!r:.80}; expected isotropic, or a positive distance in mm"
            )

    @property
    def most_kept(self) -> int | None:
        """Return how many components are kept, None where that is left open."""
        if self.keep is None:
            return None
        if self.keep == "largest":
            return 1
        if not self.keep.isdecimal() or int(self.keep) < 1:
            raise SettingsError(f"keep is {self.keep!r:.80}; expected largest, or how many, 1 or more")
        return int(self.keep)

    @property
    def largest_cavity(self) -> float | None:
        """Return the volume in mm3 up to which cavities are filled, None where none is."""
        if self.fill_cavities is None:
            return None
        if self.fill_cavities == "all":
            return math.inf
        try:
            volume = float(self.fill_cavities)
        except ValueError:
            volume = math.nan
        if not 0 < volume < math.inf:
            raise SettingsError(
                f"fill_cavities is {self.fill_cavities!r:.80}; expected all, or a positive volume in mm3"
            )
        return volume

    @property
    def selects(self) -> bool:
        """Return whether components are looked for."""
        return self.changes_bits or (self.keep, self.min_volume, self.fill_cavities) != (None, None, None)

    @property
    def changes_bits(self) -> bool:
        """Return whether the object is opened or closed."""
        return (self.open_gaps, self.close_gaps) != (None, None)

    @property
    def filters(self) -> bool:
        """Return whether values are smoothed or taken at other distances."""
        return (self.resample, self.smooth_volume) != (None, None)

    @property
    def is_whole(self) -> bool:
        """Return whether the volume is contoured as it is."""
        return self == PartSettings()
