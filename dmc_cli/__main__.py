"""`python -m dmc_cli` is `dmc`."""

from dmc_cli.cli import main

main()
