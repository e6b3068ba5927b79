"""Convert arguments of the command line to values: triples, sizes in bytes, lists of choices."""

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from dmc_cli.errors import SettingsError
from dmc_cli.isovalue_choices import EXPECTED, PRESETS, is_choice, parse_choice

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

MOST_ISOVALUES = 10_000
"""Steps from the first to the last isovalue, at most."""

Completer = Callable[[click.Context, click.Parameter, str], list[str]]


def complete_files(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> "list[CompletionItem[Any]]":
    """Leave it to the shell to complete the name of a file or folder."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(incomplete, type="file")]


def complete_values(*values: str) -> Completer:
    """Return the completion of an option that has some values by name and takes others as well."""

    def complete(_ctx: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
        return [value for value in values if value.startswith(incomplete)]

    return complete


_UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}


class Triple(click.ParamType[Any]):
    """Three numbers with commas between, in the order x, y, z."""

    name = "X,Y,Z"

    def __init__(self, number: type[int] | type[float]) -> None:
        self.number = number

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Split at commas and convert; the default and TOML files give the items themselves."""
        if isinstance(value, (tuple, list)):
            value = ",".join(str(item) for item in value)
        parts = value.split(",")
        kind = "integers" if self.number is int else "numbers"
        expected = f"expected three {kind} with commas between, as in 64,64,93"
        if len(parts) != 3:
            self.fail(f"{value!r} has {len(parts)} part(s); {expected}", param, ctx)
        try:
            return tuple(self.number(part) for part in parts)
        except ValueError:
            self.fail(f"{value!r}: {expected}", param, ctx)


class Isovalues(click.ParamType[Any]):
    """A number, several as `first:last:step` in steps of decimal numbers, or how to choose one."""

    name = "NUMBER|NAME"

    def __init__(self, *, takes_steps: bool = True) -> None:
        self.takes_steps = takes_steps

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the numbers, the last one among them if a step ends there."""
        if isinstance(value, tuple):
            return value
        if is_choice(str(value)):
            return (self._choice(str(value), param, ctx),)
        parts = str(value).split(":")
        try:
            if len(parts) == 1 or not self.takes_steps:
                return (float(str(value)),)
            from decimal import Decimal  # of several alone: a millisecond of a run

            first, last, step = (Decimal(part.strip()) for part in parts)
            if not all(number.is_finite() for number in (first, last, step)):
                raise ValueError
        except (ValueError, ArithmeticError):
            steps = ", first:last:step as in 100:900:50" if self.takes_steps else ""
            self.fail(f"{value!r} is no isovalue; expected {EXPECTED}{steps}", param, ctx)
        if step <= 0 or last < first:
            self.fail(
                f"{value!r} has no numbers; expected first:last:step, the last not below the first, and"
                " a step above 0",
                param,
                ctx,
            )
        if (last - first) / step > MOST_ISOVALUES:
            self.fail(f"{value!r} has more than {MOST_ISOVALUES} numbers; take larger steps", param, ctx)
        return tuple(float(first + n * step) for n in range(int((last - first) / step) + 1))

    def _choice(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the words of a choice as the settings have them."""
        try:
            parse_choice(value)
        except SettingsError as error:
            self.fail(str(error), param, ctx)
        return value.strip().lower()

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> "list[CompletionItem[Any]]":
        """Complete the words that choose an isovalue."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(word) for word in ("otsu", *PRESETS) if word.startswith(incomplete)]


class Isovalue(Isovalues):
    """A number, or how to choose one."""

    def __init__(self) -> None:
        super().__init__(takes_steps=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or the words."""
        (found,) = super().convert(value, param, ctx)
        return found


class Size(click.ParamType[Any]):
    """A number of bytes with an optional unit: 4G, 500M, 1.5GiB."""

    name = "SIZE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Convert to bytes; units are powers of 1024."""
        if isinstance(value, int):
            return value
        match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT]?)(?:i?B)?", value.strip(), re.IGNORECASE)
        size = float(match[1]) * _UNITS[match[2].upper()] if match else math.inf
        if not math.isfinite(size):
            self.fail(f"{value!r} is no size; expected a number of bytes, as in 4G or 500M", param, ctx)
        return int(size)


class Components(click.ParamType[Any]):
    """How many components stay: a number, or `largest` for one."""

    name = "largest|N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; what it may be is up to the settings."""
        if value == "largest":
            return 1
        try:
            return int(value)
        except ValueError:
            self.fail(f"{value!r} is no number of components; expected largest, or a number", param, ctx)


class NameList(click.ParamType[Any]):
    """Names with commas between."""

    name = "LIST"

    again = "give one list, with commas between"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Split at commas; the default is a list."""
        if isinstance(value, (tuple, list)):
            return tuple(value)
        parts = tuple(part.strip() for part in value.split(","))
        if not all(parts):
            self.fail(f"{value!r} has an empty name; expected names with commas between", param, ctx)
        return parts


class ChoiceList(click.ParamType[Any]):
    """Names of a fixed set with commas between."""

    name = "LIST"

    again = "give one list, with commas between"
    """What to do instead of giving a second list."""

    def __init__(self, choices: tuple[str, ...]) -> None:
        self.choices = choices

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Split at commas, check, and drop repetitions; the default and TOML files give a list."""
        if isinstance(value, (tuple, list)):
            value = ",".join(value)
        names = [part.strip() for part in value.split(",") if part.strip()]
        for name in names:
            if name not in self.choices:
                self.fail(f"{name!r} is not one of {', '.join(self.choices)}", param, ctx)
        return tuple(dict.fromkeys(names))

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> "list[CompletionItem[Any]]":
        """Complete the last name of the list."""
        from click.shell_completion import CompletionItem

        before, comma, last = incomplete.rpartition(",")
        others = [choice for choice in self.choices if choice not in before.split(",")]
        return [CompletionItem(before + comma + choice) for choice in others if choice.startswith(last)]


class RequirementList(ChoiceList):
    """What is required of a mesh, with commas between: names of a fixed set, and comparisons.

    Which comparisons there are is the settings' to know.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Split at commas; the default and TOML files give a list."""
        if isinstance(value, (tuple, list)):
            value = ",".join(value)
        return tuple(part.strip() for part in value.split(",") if part.strip())
