"""Say which synthetic volume to write."""

from dataclasses import dataclass

from dmc_cli.errors import SettingsError
from dmc_cli.settings.checks import check_noise, check_path
from dmc_cli.settings.choices import SyntheticField, VolumeFormat
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class SynthSettings:
    """Which synthetic volume to write where; without `output_format` the suffix of `path` chooses it."""

    field: SyntheticField
    path: str
    nodes: int = 64
    output_format: VolumeFormat | None = None
    seed: int = 0
    sigma: float = 0.0
    force: bool = False

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("output", self.path)
        if not self.path:
            raise SettingsError("the output's name is empty; expected a file's name; give one")
        if self.nodes < 2:
            raise SettingsError(f"nodes is {self.nodes}; expected at least 2 along each axis")
        check_noise(self.seed, self.sigma)
