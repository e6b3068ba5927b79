"""Escape on standard output and standard error what no terminal prints.

All text passes here: messages, summaries, tables, usage errors that repeat an argument, warnings of
libraries, tracebacks. JSON has its own escapes (`printable.json_text`), bars their own codes (`unescaped`),
and bytes of a mesh go to the stream's buffer.
"""

import io
import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, TextIO

import click

from dmc_cli.files import whole_writes
from dmc_cli.printable import printable


class PrintableStream:
    """A text stream that escapes what is not printed; all else is the stream's own.

    One that `may_fail` swallows its errors: of standard error nobody could be told, and the status tells.
    """

    def __init__(self, stream: TextIO, *, may_fail: bool = False) -> None:
        self.unescaped = stream
        self._ignored = (OSError,) if may_fail else ()

    def write(self, text: str) -> int:
        """Write the text with its escapes."""
        with suppress(*self._ignored):
            self.unescaped.write(printable(text))
        return len(text)

    def flush(self) -> None:
        """Write what is still in memory."""
        with suppress(*self._ignored):
            self.unescaped.flush()

    def writelines(self, lines: Iterable[str]) -> None:
        """Write each of the lines."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.unescaped, name)


def escape_streams() -> None:
    """Escape from now on what is not printed on standard output and standard error.

    A stream that cannot hold a character shows its escape, too; one that says it is ASCII, as most do only
    because nobody told them a language, is written as UTF-8.
    """
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None or isinstance(stream, PrintableStream):
            continue
        if isinstance(stream, io.TextIOWrapper):
            if (whole := whole_writes(stream.buffer)) is not stream.buffer:
                stream = io.TextIOWrapper(whole, stream.encoding, line_buffering=True)
            is_ascii = stream.encoding.lower().replace("_", "-") in ("ascii", "us-ascii", "ansi-x3.4-1968")
            stream.reconfigure(encoding="utf-8" if is_ascii else None, errors="backslashreplace")
        setattr(sys, name, PrintableStream(stream, may_fail=name == "stderr"))


def open_closed_streams() -> None:
    """Give standard streams that the caller has closed a file of their own, at which reading and writing end.

    Else the next file that is opened would be standard output, and what a library prints would go into it.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            # standard output cannot be written, so that what should be there is missed
            os.open(os.devnull, os.O_WRONLY if name == "stderr" else os.O_RDONLY)
            if getattr(sys, name) is None:
                setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))


def unescaped(stream: Any) -> TextIO:
    """Return a stream as it was before `escape_streams`, for whoever draws on a terminal."""
    found: TextIO = getattr(stream, "unescaped", stream)
    return found


def echo_lines(lines: Iterable[str], *, err: bool = False) -> None:
    """Print lines that people read; a line break within one is escaped, too, as it can only be forged."""
    for line in lines:
        click.echo(printable(line, keep=""), err=err)
