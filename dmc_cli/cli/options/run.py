"""Offer the options of the run: device, threads, memory, and how much is printed."""

import click

from dmc_cli.cli.group import VERBOSE
from dmc_cli.cli.options.from_settings import setting, stack
from dmc_cli.cli.parameters import Size, complete_values
from dmc_cli.settings import ConvertSettings, OutputSettings


def _remember(ctx: click.Context, _parameter: click.Parameter, value: int) -> int:
    ctx.meta[VERBOSE] = value
    return value


device_option = setting(
    ConvertSettings,
    "device",
    section="Run",
    metavar="DEVICE",
    shell_complete=complete_values("auto", "cpu", "cuda"),
    again=None,
    help="auto (CUDA where usable), cpu, cuda or cuda:N.",
)
threads_option = setting(
    ConvertSettings,
    "threads",
    section="Run",
    type=int,
    metavar="N",
    again=None,
    help="CPU threads; all cores without it.",
)
memory_option = setting(
    OutputSettings,
    "memory",
    section="Run",
    type=Size(),
    again=None,
    help="The memory that the run's arrays may take, as in 4G; Python and Warp take some 200 MiB more.",
)
run_options = stack(device_option, threads_option, memory_option)

verbosity_options = stack(
    click.option("-q", "--quiet", is_flag=True, help="No progress and no summary."),
    click.option(
        "-v",
        "--verbose",
        count=True,
        show_default=False,
        callback=_remember,
        help="Print more; -vv adds tracebacks.",
    ),
)
