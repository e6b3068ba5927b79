"""Import a command when it is run or its own help is asked for; lists of commands need their names alone."""

from importlib import import_module

import click


class LazyCommand(click.Command):
    """What stands for a command in lists: its name and a line of help."""

    def __init__(self, name: str, short_help: str) -> None:
        super().__init__(name, short_help=short_help)

    def load(self) -> click.Command:
        """Import the command, the function of its name in the module of its name."""
        command: click.Command = getattr(import_module(f"dmc_cli.cli.{self.name}"), str(self.name))
        return command
