"""Read the TOML file of a batch: tables of options, each value as if it stood on the command line.

A TOML file holds the options of `dmc batch` under their long names, but those of the whole run, and `inputs`;
its `[[items]]` are tables of the same keys that add to the common ones and go before them. An item without
inputs takes the common ones; where every item has its own, the common ones are an item as well, so that none
is left out.
"""

import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from dmc_cli.cli.parameters import ChoiceList, Triple
from dmc_cli.errors import SettingsError

_NOT_IN_FILES = {"jobs", "junit", "quiet", "verbose", "help"}
"""Options of the whole run, which no table of items can have."""

_MOST_BYTES = 4 << 20
"""Bytes of a TOML file, at most: some ten thousand items."""

_SHOWN = 200
"""Characters of a value that a message shows."""


def read_tables(path: Path, ctx: click.Context) -> list[dict[str, Any]]:
    """Return the tables of a TOML file, the common keys added, values converted as options are.

    Raises:
        SettingsError: The file cannot be read, is no TOML, or has keys or values that no option takes.
    """
    data = _parsed(path)
    items = data.pop("items", [{}])
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise SettingsError(f"{path}: items is no list of tables; write each under a [[items]] of its own")
    common = _named(data, path)
    tables = [_named(item, path) for item in items] or [{}]
    if "inputs" in common and all("inputs" in table for table in tables):
        tables.insert(0, {})
    return [dict(_converted(common | table, path, ctx)) for table in tables]


def _parsed(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    try:
        return tomllib.loads(_content(path).decode())
    except OSError as error:
        raise SettingsError(
            f"{path} cannot be read ({error.strerror}); give the name of a TOML file"
        ) from error
    except SettingsError:  # a ValueError, too
        raise
    except (ValueError, RecursionError) as error:
        raise SettingsError(f"{path} is no TOML file: {error}; see `dmc batch --help`") from error


def _content(path: Path) -> bytes:
    """Return the bytes of a file, but of no device or pipe, which may have no end or never begin."""
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # to open a folder tells why it cannot be read
        raise SettingsError(f"{path} is a device or a pipe; expected a TOML file; give the name of one")
    with path.open("rb") as stream:
        content = stream.read(_MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise SettingsError(
            f"{path} is longer than {_MOST_BYTES >> 20} MiB; expected a TOML file of at most that; split it"
        )
    return content


def _named(table: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return a table with the names of parameters as its keys."""
    named: dict[str, Any] = {}
    for key, value in table.items():
        name = {"isovalues": "isovalue", "input": "inputs"}.get(key, key.replace("-", "_"))
        if name in named:
            raise SettingsError(f"{path}: {key!r} gives {name} a second time in one table; keep one of them")
        named[name] = value
    return named


def _converted(table: dict[str, Any], path: Path, ctx: click.Context) -> Iterator[tuple[str, Any]]:
    """Yield the names with their values as the option of that name would have converted them."""
    options = {p.name: p for p in ctx.command.params if p.name and p.name not in _NOT_IN_FILES}
    for key, value in table.items():
        option = options.get(key)
        if option is None:
            where = "no option of a file, give it on the command line" if key in _NOT_IN_FILES else ""
            raise SettingsError(
                f"{path}: {key!r} is {where or 'no option of dmc batch'}; expected one of"
                f" {', '.join(sorted(options))}"
            )
        if (option.multiple or option.nargs == -1) and not isinstance(value, list):
            value = [value]  # noqa: PLW2901 - one value stands for a list of one
        try:
            yield key, option.type_cast_value(ctx, _arguments(option, value))
        except click.BadParameter as error:
            raise SettingsError(f"{path}: {key} is {_shown(value)}; {error.message}") from error


def _arguments(option: click.Parameter, value: Any) -> Any:
    """Return a value of a TOML file as the arguments that would give it, a flag's as it is.

    Raises:
        BadParameter: No arguments could give it.
    """
    if isinstance(option, click.Option) and option.is_flag:
        if not isinstance(value, bool):
            raise click.BadParameter("expected true or false")
        return value
    takes_several = option.multiple or option.nargs == -1 or isinstance(option.type, (Triple, ChoiceList))
    if takes_several and isinstance(value, list):
        return [_argument(item) for item in value]
    return _argument(value)


def _argument(value: Any) -> str:
    """Return a text as it is and a number as it is written."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise click.BadParameter("expected a text or a number")
    try:
        return str(value)
    except ValueError as error:  # more digits than Python writes
        raise click.BadParameter(f"{error}; expected a shorter number") from error


def _shown(value: Any) -> str:
    """Return the beginning of a value for a message."""
    try:
        return repr(value)[:_SHOWN]
    except (ValueError, RecursionError):  # a number of too many digits, tables in tables
        return "what is too long to be shown"
