"""Group the commands: the one place where errors become messages and exit status."""

import errno
import os
import re
import sys
from typing import Any

import click

from dmc_cli.cli.lazy import LazyCommand
from dmc_cli.cli.signals import Stopped
from dmc_cli.cli.terminal import escape_streams
from dmc_cli.errors import DeviceError, DmcError, WriteError
from dmc_cli.system import check_address_space, lacks_memory

HELP_NAMES = ("-h", "--help")
"""What the option is called that prints a help text."""

VERBOSE = "dmc_cli.verbose"
"""Key of the context's shared notes under which a command leaves how often `-v` was given."""

COMPLETE = "_DMC_COMPLETE"
"""The variable by which a shell's script asks for completions, whatever the program is called."""

_SHOW_CAUSE = 2
"""`-vv` shows where an expected error came from."""

_STDOUT_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EPIPE, errno.EBADF)
"""What a command's own output runs into; files are written by `files/`, which raises its own error."""


class Failure(click.ClickException):
    """A failed run: one message on standard error and the exit status of its error class."""

    def __init__(self, message: str, exit_status: int) -> None:
        # lines of ours are indented; another break comes from a name, and would begin a forged message
        super().__init__(re.sub(r"\n(?! )", r"\\n", message))
        self.exit_code = exit_status  # type: ignore[misc]


class DmcGroup(click.Group):
    """A group that turns the package's errors into messages; all others keep their traceback."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run as click does, with streams that escape what no terminal prints."""
        escape_streams()
        if COMPLETE in os.environ:
            from dmc_cli.cli.completion import register_shells

            register_shells()
        return super().main(*args, **{"complete_var": COMPLETE} | extra)

    def make_context(self, *args: Any, **extra: Any) -> click.Context:
        """Make a context in which click removes no escape sequences from texts: they are shown, escaped."""
        try:
            return super().make_context(*args, **{"color": True} | extra)
        except OSError as error:  # while help or the version is printed
            raise _stdout_failure(error) from error

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the first argument names, and import it."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command.load() if isinstance(command, LazyCommand) else command, rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a bug of ours passes through and ends with status 1."""
        try:
            check_address_space()
            return super().invoke(ctx)
        except DmcError as error:
            if error.exit_status == DmcError.exit_status:
                raise
            if ctx.meta.get(VERBOSE, 0) >= _SHOW_CAUSE:
                import traceback

                click.echo("".join(traceback.format_exception(error)), err=True, nl=False)
            if isinstance(error, WriteError):
                _forget_broken_stdout()
            raise Failure(str(error), error.exit_status) from error
        except (ImportError, MemoryError, OSError, RuntimeError) as error:
            if lacks_memory(error):
                raise _no_memory(error) from error
            if isinstance(error, OSError):
                raise _stdout_failure(error) from error
            raise
        except Stopped as stop:
            raise Failure(stop.message, stop.exit_status) from None


def _no_memory(error: Exception) -> Failure:
    """Return the failure that tells that memory is used up."""
    found = " ".join(str(error).split()) or "no more could be allocated"
    return Failure(
        f"the memory is used up ({found}); expected room for the program, the volume and its mesh; crop the"
        " volume, or run where more memory is free",
        DeviceError.exit_status,
    )


def _stdout_failure(error: OSError) -> Failure:
    """Return the failure that an error of standard output means; raise any other one again."""
    if error.errno not in _STDOUT_ERRORS:
        raise error
    from dmc_cli.files import write_error
    from dmc_cli.settings import STREAM

    _forget_broken_stdout()
    return Failure(str(write_error(STREAM, error)), WriteError.exit_status)


def _forget_broken_stdout() -> None:
    """Redirect a standard output that cannot be written to the null device: Python flushes it at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
