"""`dmc completion`: the script that lets a shell complete commands, options and their values."""

import click
from click.shell_completion import get_completion_class

from dmc_cli.cli.sections import SectionedCommand

SHELLS = ("bash", "zsh", "fish")


@click.command(cls=SectionedCommand, short_help="Print a shell's completion script.")
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the completion script for SHELL on standard output.

    For bash, put `eval "$(dmc completion bash)"` into ~/.bashrc, for zsh the same into ~/.zshrc; for
    fish, save the script as ~/.config/fish/completions/dmc.fish.

    \b
    Examples:
      dmc completion bash
      dmc completion fish
    """
    made = get_completion_class(shell)
    assert made is not None
    click.echo(made(ctx.find_root().command, {}, "dmc", "_DMC_COMPLETE").source())
