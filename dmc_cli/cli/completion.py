"""Print the script by which a shell completes commands, options and their values: `dmc completion`."""

import os

import click
from click.shell_completion import (
    BashComplete,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
    split_arg_string,
)

from dmc_cli.cli.group import COMPLETE
from dmc_cli.cli.sections import SectionedCommand

_BASH = """\
%(complete_func)s() {
    local IFS=$'\\n' response completion type value
    response=$(env COMP_LINE="${COMP_LINE:0:${COMP_POINT:-0}}" COMP_WORDS="${COMP_WORDS[*]}" \\
        COMP_CWORD="$COMP_CWORD" %(complete_var)s=bash_complete "$1")
    COMPREPLY=()
    for completion in $response; do
        IFS=',' read -r type value <<< "$completion"
        if [[ $type == plain ]]; then
            COMPREPLY+=("$value")
        elif ! compopt -o default 2>/dev/null; then  # called by hand: readline completes no names then
            mapfile -t COMPREPLY < <(compgen -f -- "$value")
        fi
    done
}

complete -o nosort -F %(complete_func)s %(prog_name)s
"""


class Bash(BashComplete):
    """Completion for bash, which splits arguments at `=` and `:`; the line tells what is meant."""

    source_template = _BASH

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the arguments before the one that is completed, and that one as far as it is there."""
        line = os.environ.get("COMP_LINE")
        if not line:
            before, incomplete = super().get_completion_args()
            return [argument for argument in before if argument != "="], incomplete
        arguments = split_arg_string(line)[1:]
        is_begun = bool(arguments) and (not line[-1].isspace() or arguments[-1][-1:].isspace())
        return (arguments[:-1], arguments[-1]) if is_begun else (arguments, "")


class Zsh(ZshComplete):
    """Completion for zsh, which counts `--option=` as one argument: only what follows is completed."""

    source_template = ZshComplete.source_template.replace(
        "    for type key", "    [[ $PREFIX == --*=* ]] && compset -P '*='\n    for type key", 1
    )


SHELLS: dict[str, type[ShellComplete]] = {"bash": Bash, "zsh": Zsh, "fish": FishComplete}


def register_shells() -> None:
    """Make the classes of our scripts known to click."""
    for shell in SHELLS.values():
        add_completion_class(shell)


@click.command(cls=SectionedCommand)
@click.argument("shell", type=click.Choice(tuple(SHELLS)))
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
    click.echo(SHELLS[shell](ctx.find_root().command, {}, "dmc", COMPLETE).source())
