"""Name what an input becomes at each of several isovalues: one conversion each."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dmc_cli.cli.labels import label_settings
from dmc_cli.cli.options import DEFAULT_OUTPUT, gather, isovalues_of
from dmc_cli.cli.templates import fill_template, name_part
from dmc_cli.settings import (
    ConvertSettings,
    LabelSettings,
    MeshSettings,
    OutputSettings,
    PartSettings,
    ReadSettings,
    SurfaceSettings,
)
from dmc_cli.volume_io import exists

_COMPRESSED = {".gz", ".bz2", ".xz", ".zst", ".zstd", ".zip"}
"""Suffixes that stand behind another one; both go from the stem."""

_OF_A_LABEL = re.compile(r"\{((?:label|name)(?::[^{}]*)?)\}")
"""A field that is filled in when a label is known."""

_PATHS = ("output", "halfedges", "report", "marked")
"""Options that are templates of paths."""


def conversions_of(
    source: str,
    values: dict[str, Any],
    read: ReadSettings,
    *,
    base: Path,
    index: int = 1,
    one_mesh: bool = False,
) -> Iterator[ConvertSettings]:
    """Yield the conversions of one input, one for each isovalue.

    Args:
        source: The input.
        values: The options; those of `_PATHS` are templates.
        read: How the input is read.
        base: The folder that outputs are named from.
        index: The number of the input.
        one_mesh: All meshes go to one file, `output`, whose name is no template then.

    Raises:
        SettingsError: A template or a setting is wrong.
    """
    templates = {name: values[name] for name in _PATHS if values.get(name) is not None}
    shared = {"output": templates.pop("output")} if one_mesh else {}
    named = {
        "stem": name_part(_stem(source)),
        "name": name_part(_name(source)),
        "parent": _parent(source, base),
    }
    for isovalue in isovalues_of(values):
        fields = named | {"isovalue": isovalue, "index": index}
        paths = shared | {name: fill_template(name, form, fields, base) for name, form in templates.items()}
        files = {name: paths.get(name) for name in _PATHS[1:]}
        yield conversion_of(source, values | files, read, isovalue, paths["output"])


def label_conversion_of(
    source: str, values: dict[str, Any], read: ReadSettings, *, base: Path, index: int
) -> LabelSettings:
    """Return the conversion of the labels of one input; the arguments are those of `conversions_of`.

    Of the template `output` what is of a label is left to be filled in: `{label}` and `{name}`.

    Raises:
        SettingsError: A template or a setting is wrong.
    """
    form = values["output"]
    if form == DEFAULT_OUTPUT:
        form = "{stem}.ply" if values["conforming"] else "{stem}_{label}.ply"
    fields = {"stem": name_part(_stem(source)), "parent": _parent(source, base), "index": index}
    of_labels = _OF_A_LABEL.sub(r"{{\1}}", form)
    path = fill_template("output", of_labels, fields | {"label": None, "name": None}, base)
    report = values.get("report")
    if report is not None:
        report = fill_template("report", report, fields | {"name": name_part(_name(source))}, base)
    return label_settings(source, path, values | {"report": report}, read)


def conversion_of(
    source: str, values: dict[str, Any], read: ReadSettings, isovalue: float | str | None, path: str
) -> ConvertSettings:
    """Return the conversion of an input at an isovalue to a file, by the options as they are."""
    return gather(
        ConvertSettings,
        values,
        input=source,
        read=read,
        surface=gather(SurfaceSettings, values | _border(values), isovalue=isovalue),
        part=gather(PartSettings, values),
        mesh=gather(MeshSettings, values),
        output=gather(OutputSettings, values, path=path),
    )


def _border(values: dict[str, Any]) -> dict[str, Any]:
    """Return the border where none is named but a print is wanted, which has no open ends."""
    return {"border": "closed"} if values.get("border") is None and "print" in values["require"] else {}


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
