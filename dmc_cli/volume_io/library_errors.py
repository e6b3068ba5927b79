"""Tell in one message whatever a library raises: an exception of any class, with a text of any length."""

from collections.abc import Iterator
from contextlib import contextmanager

from dmc_cli.errors import DamagedVolumeError, DmcError

LONGEST = 200
"""Characters of a library's message that are told."""


def told_by(error: BaseException) -> str:
    """Return what an exception tells, in one line that is not too long, with its class where it needs it."""
    text = " ".join(str(error).split())[:LONGEST]
    is_clear = text and not isinstance(error, LookupError)  # which tells a key and nothing else
    return text if is_clear else f"{type(error).__name__} {text}".rstrip()


@contextmanager
def library_errors(found: str, todo: str = "get the file again") -> Iterator[None]:
    """Turn whatever is raised into a DamagedVolumeError, but for our own errors and those of memory.

    Args:
        found: What cannot be done, with the input's name in front of it.
        todo: What is expected, or what to do.
    """
    try:
        yield
    except (DmcError, MemoryError):
        raise
    except Exception as error:
        raise DamagedVolumeError(f"{found} ({told_by(error)}); {todo}") from error
