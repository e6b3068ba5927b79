"""Say which of the papers' tables to make again."""

from dataclasses import dataclass

from dmc_cli.errors import SettingsError
from dmc_cli.methods import settled_option
from dmc_cli.settings.checks import check_run
from dmc_cli.settings.choices import PaperTable
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class ReproduceSettings:
    """Which of the papers' tables to make again, from data sets of at most `up_to` nodes an axis.

    `scans` says where scans of Schmitz et al. 2009 are, `NAME=FILE` each: engine, bonsai, backpack, stent.
    """

    table: tuple[PaperTable, ...] = ()
    up_to: int = 512
    scans: tuple[str, ...] = ()
    placement: str = "sampled"
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        if self.up_to < 1:
            raise SettingsError(f"up_to is {self.up_to}; expected a number of nodes an axis")
        settled_option("dmc", "placement", self.placement)
        check_run(self.device, self.threads)
