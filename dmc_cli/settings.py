"""Every choice a user can make, with its default: they stand here and nowhere else.

The command line builds these dataclasses from its options (a test keeps both sides equal); the
Python API takes them as they are. Settings are immutable and hold plain values only.
"""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from dmc_cli.errors import SettingsError

InputFormat = Literal["raw", "nifti", "nrrd", "meta", "dicom"]
OutputFormat = Literal["ply", "obj", "off"]
ByteOrder = Literal["little", "big"]
Inside = Literal["above", "below"]
Topology = Literal["manifold", "asymptotic"]
Placement = Literal["exact"]
Border = Literal["open", "closed"]
Orientation = Literal["outward", "gradient"]
OutputSpace = Literal["native", "ras", "lps", "voxel"]


def check_choice(name: str, value: object, choices: object) -> None:
    """Raise SettingsError unless `value` is one of the Literal type `choices`."""
    allowed = get_args(choices)
    if value not in allowed:
        raise SettingsError(f"{name} is {value!r}; expected one of {', '.join(allowed)}")


@dataclass(frozen=True, kw_only=True)
class ReadSettings:
    """How to read the input; what a format does not need is ignored by its reader.

    `shape`, `spacing` and `origin` are in the order x, y, z; millimetres; the origin is the centre
    of the first node. `seed` and `sigma` belong to the synthetic noise.
    """

    input_format: InputFormat | None = None
    shape: tuple[int, int, int] | None = None
    dtype: str | None = None
    byte_order: ByteOrder = "little"
    skip_bytes: int = 0
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    series: str | None = None
    volume_index: int | None = None
    seed: int = 0
    sigma: float = 0.0
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every range once, at the door."""
        if self.shape is not None and any(n < 1 for n in self.shape):
            raise SettingsError(f"shape is {self.shape}; expected three positive numbers of nodes")
        if not all(math.isfinite(s) and s > 0 for s in self.spacing):
            raise SettingsError(f"spacing is {self.spacing}; expected three positive lengths in mm")
        if not all(math.isfinite(x) for x in self.origin):
            raise SettingsError(f"origin is {self.origin}; expected three finite coordinates in mm")
        if self.skip_bytes < 0:
            raise SettingsError(f"skip_bytes is {self.skip_bytes}; expected 0 or more")
        check_choice("byte_order", self.byte_order, ByteOrder)
        if self.input_format is not None:
            check_choice("input_format", self.input_format, InputFormat)


@dataclass(frozen=True, kw_only=True)
class SurfaceSettings:
    """Which surface to extract from a volume; `isovalue` is in the volume's physical values."""

    isovalue: float
    inside: Inside = "above"
    topology: Topology = "manifold"
    placement: Placement = "exact"
    border: Border = "open"
    orientation: Orientation = "outward"

    def __post_init__(self) -> None:
        """Check every range once, at the door."""
        if not math.isfinite(self.isovalue):
            raise SettingsError(f"isovalue is {self.isovalue}; expected a finite number")
        check_choice("inside", self.inside, Inside)
        check_choice("topology", self.topology, Topology)
        check_choice("placement", self.placement, Placement)
        check_choice("border", self.border, Border)
        check_choice("orientation", self.orientation, Orientation)
