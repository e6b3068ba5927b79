"""Say how to read an input."""

import math
from dataclasses import dataclass

from dmc_cli import volume_formats
from dmc_cli.errors import SettingsError
from dmc_cli.settings.checks import check_format, check_noise, check_threads
from dmc_cli.settings.choices import ByteOrder, Duplicates, SliceGaps, SliceOrder
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class ReadSettings:
    """How to read the input; what a format does not need is ignored, with a warning.

    `shape`, `spacing` and `origin` are in the order x, y, z; millimetres; the origin is the centre
    of the first node. Spacing and origin are for files that tell none, or a spacing in no known unit; without
    them they are 1 and 0.
    `allow_outside` reads files outside the input's own folder that a header or a link leads to.
    `strict` refuses files that leave open what they mean: every warning of `notices.ABOUT_MEANING`.
    `channel` and `time` are numbers from 0, or names of the file; `volume_index` counts what they leave.
    `seed` and `sigma` belong to the synthetic noise.
    """

    input_format: str | None = None
    shape: tuple[int, int, int] | None = None
    dtype: str | None = None
    byte_order: ByteOrder = "little"
    skip_bytes: int = 0
    spacing: tuple[float, float, float] | None = None
    origin: tuple[float, float, float] | None = None
    series: str | None = None
    slice_gaps: SliceGaps = "refuse"
    duplicates: Duplicates = "refuse"
    slice_order: SliceOrder = "position"
    channel: str | None = None
    time: str | None = None
    volume_index: int | None = None
    allow_outside: bool = False
    strict: bool = False
    seed: int = 0
    sigma: float = 0.0
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_format("input_format", self.input_format, volume_formats.FORMATS)
        if self.shape is not None and any(n < 1 for n in self.shape):
            raise SettingsError(f"shape is {self.shape}; expected three positive numbers of nodes")
        if self.spacing is not None and not all(math.isfinite(s) and s > 0 for s in self.spacing):
            raise SettingsError(f"spacing is {self.spacing}; expected three positive lengths in mm")
        if self.origin is not None and not all(math.isfinite(x) for x in self.origin):
            raise SettingsError(f"origin is {self.origin}; expected three finite coordinates in mm")
        if self.skip_bytes < 0:
            raise SettingsError(f"skip_bytes is {self.skip_bytes}; expected 0 or more")
        check_noise(self.seed, self.sigma)
        check_threads(self.threads)
