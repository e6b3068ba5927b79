"""Plan a batch: inputs x isovalues, each with its output, from the options or a TOML file.

Options on the command line go before the file's. Paths in a file are relative to its folder.
"""

import glob
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from dmc_cli.app import refuse_overlaps
from dmc_cli.cli.batch_file import read_tables
from dmc_cli.cli.conversions import conversions_of, label_conversion_of
from dmc_cli.cli.labels import are_of_labels, refuse_others
from dmc_cli.cli.options import gather
from dmc_cli.errors import SettingsError
from dmc_cli.settings import (
    STREAM,
    ConvertSettings,
    LabelSettings,
    ReadSettings,
    check_path,
)
from dmc_cli.volume_io import exists


def plan_batch(
    ctx: click.Context, inputs: tuple[str, ...], values: dict[str, Any], junit: str | None = None
) -> list[ConvertSettings | LabelSettings]:
    """Return what to convert, in the order of the inputs, the isovalues within an input.

    Raises:
        SettingsError: No input, standard input for several, a pattern without a file, an isovalue or a
            template that is wrong, an output that is an input or another output, a file that is no
            TOML or has keys that are no options.
    """
    given = {
        name for name in values if ctx.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT
    }
    if len(inputs) == 1 and inputs[0].lower().endswith(".toml"):
        path = Path(inputs[0])
        tables = read_tables(path, ctx)
        folder, own = path.parent, [path]
    else:
        tables, folder, own = [{"inputs": list(inputs)}], Path(), []
    items: list[ConvertSettings | LabelSettings] = []
    for table in tables:
        ours = {name: value for name, value in values.items() if name in given or name not in table}
        base = Path() if "output" in given else folder
        if are_of_labels(table | ours):
            refuse_others(ctx, given | table.keys())
        items.extend(_expand(table | ours, folder, base))
    if sum(item.input == STREAM for item in items) > 1:
        raise SettingsError(
            "standard input is read by several items, but it comes once; expected one item for it; save it to"
            " a file, and name that"
        )
    refuse_overlaps(items, own, tells=True, junit=junit)
    return items


def _expand(values: dict[str, Any], folder: Path, base: Path) -> Iterator[ConvertSettings | LabelSettings]:
    """Yield the conversions of one table: each input with each isovalue, or of its labels."""
    read = gather(ReadSettings, values)
    if not values.get("inputs"):
        raise SettingsError(
            "no input was given; expected one or more, as `inputs` in the file or in each item"
        )
    for index, source in enumerate(_sources(values["inputs"], folder), 1):
        if are_of_labels(values):
            yield label_conversion_of(source, values, read, base=base, index=index)
        else:
            yield from conversions_of(source, values, read, base=base, index=index)


def _sources(patterns: Any, folder: Path) -> Iterator[str]:
    """Yield the inputs: patterns expanded and sorted, `synth:FIELD:N` and names as they are."""
    for pattern in patterns:
        check_path("inputs", pattern)
        if not pattern:
            raise SettingsError("an input's name is empty; expected a file, a folder or a pattern; give one")
        if pattern.startswith("synth:"):
            yield pattern
        elif glob.has_magic(pattern) and not exists(folder / pattern):
            found = sorted(glob.glob(str(folder / pattern), recursive=True))  # noqa: PTH207 - absolute ones too
            if not found:
                raise SettingsError(f"no file matches {pattern}; expected at least one; check the pattern")
            yield from found
        else:
            yield str(folder / pattern)
