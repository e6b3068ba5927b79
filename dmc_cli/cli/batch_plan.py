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
from dmc_cli.cli.options import gather
from dmc_cli.cli.templates import fill_template, name_part
from dmc_cli.errors import SettingsError
from dmc_cli.setting_checks import check_path
from dmc_cli.settings import (
    STREAM,
    ConvertSettings,
    MeshSettings,
    OutputSettings,
    ReadSettings,
    SurfaceSettings,
)
from dmc_cli.volume_io import exists

_COMPRESSED = {".gz", ".bz2", ".xz", ".zst", ".zstd", ".zip"}
"""Suffixes that stand behind another one; both go from the stem."""

_PATHS = ("output", "halfedges", "report")
"""Options that are templates of paths."""


def plan_batch(ctx: click.Context, inputs: tuple[str, ...], values: dict[str, Any]) -> list[ConvertSettings]:
    """Return what to convert, in the order of the inputs, the isovalues within an input.

    Raises:
        SettingsError: No input, standard input for several, a pattern without a file, an isovalue or a
            template that is missing or wrong, an output that is an input or another output, a file that is no
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
    items: list[ConvertSettings] = []
    for table in tables:
        ours = {name: value for name, value in values.items() if name in given or name not in table}
        base = Path() if "output" in given else folder
        items.extend(_expand(table | ours, folder, base))
    if sum(item.input == STREAM for item in items) > 1:
        raise SettingsError(
            "standard input is read by several items, but it comes once; expected one item for it; save it to"
            " a file, and name that"
        )
    refuse_overlaps(items, own, tells=True)
    return items


def _expand(values: dict[str, Any], folder: Path, base: Path) -> Iterator[ConvertSettings]:
    """Yield the conversions of one table: each input with each isovalue."""
    read = gather(ReadSettings, values)
    if not values.get("isovalue"):
        raise SettingsError(
            "no isovalue was given; expected one or more, with -i or as `isovalue` in the file"
        )
    if not values.get("inputs"):
        raise SettingsError(
            "no input was given; expected one or more, as `inputs` in the file or in each item"
        )
    templates = {name: values[name] for name in _PATHS if values.get(name) is not None}
    for index, source in enumerate(_sources(values["inputs"], folder), 1):
        named = {
            "stem": name_part(_stem(source)),
            "name": name_part(_name(source)),
            "parent": _parent(source, base),
        }
        for isovalue in values["isovalue"]:
            fields = named | {"isovalue": isovalue, "index": index}
            paths = {
                name: fill_template(name, template, fields, base) for name, template in templates.items()
            }
            files = {name: paths.get(name) for name in ("halfedges", "report")}
            output = gather(OutputSettings, values | files, path=paths["output"])
            surface = gather(SurfaceSettings, values | {"isovalue": isovalue})
            yield gather(
                ConvertSettings,
                values,
                input=source,
                read=read,
                surface=surface,
                mesh=gather(MeshSettings, values),
                output=output,
            )


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


def _stem(source: str) -> str:
    """Return an input's name without folder and suffixes."""
    if source.startswith("synth:"):
        return source.replace(":", "_")
    path = Path(_name(source))
    if exists(Path(source)) and Path(source).is_dir():
        return path.name
    return Path(path.stem).stem if path.suffix.lower() in _COMPRESSED else path.stem


def _name(source: str) -> str:
    """Return an input's name without its folder; for `.` and `..` the name of the folder that is meant."""
    if source.startswith("synth:"):
        return source
    name = Path(source).name
    return name if name not in ("", "..") else Path(source).resolve().name


def _parent(source: str, base: Path) -> Path:
    """Return an input's folder as a template names it: relative to the outputs' folder if it lies there."""
    parent = Path() if source.startswith("synth:") else Path(source).parent
    return parent.relative_to(base) if parent.is_relative_to(base) else parent
