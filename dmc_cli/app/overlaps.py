"""Refuse outputs that are inputs or other outputs, by whatever path or link.

Links and other spellings of a path hide no file (`file_keys.py`). Inputs have more files than their name
tells: detached data, pairs, folders. They are looked up only where an output exists already, because what
does not exist is part of no input.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from dmc_cli.app.file_keys import FileKeys
from dmc_cli.errors import DmcError, SettingsError
from dmc_cli.isovalue_choices import isovalue_text
from dmc_cli.mesh_io import choose_format, companion_path
from dmc_cli.settings import STREAM, ConvertSettings, LabelSettings, ReadSettings
from dmc_cli.volume_formats import FORMATS
from dmc_cli.volume_io import (
    Bounds,
    Walk,
    exists,
    input_format,
    is_zarr,
    pair_files,
    read_layout,
)

_SINGLE_FILES = (
    *(".nii", ".nii.gz", ".npy", ".npz", ".dcm", ".raw", ".raw.gz", ".zip", ".tif", ".tiff"),
    *(".mgh", ".mgz", ".mnc"),
)
"""Suffixes of inputs that are one file."""


MATERIALS = "file of materials"
"""The role of the file beside an OBJ."""


class Output(NamedTuple):
    """An output of an item, or of the whole run: which it is, and where it goes."""

    item: ConvertSettings | LabelSettings | None
    role: str
    path: str


def refuse_overlaps(
    items: Sequence[ConvertSettings | LabelSettings],
    others: Iterable[Path | str] = (),
    *,
    tells: bool = False,
    junit: str | None = None,
    one_mesh: bool = False,
) -> None:
    """Raise if an output of one of the items is a file that one of them reads, or another one's output.

    Args:
        items: Conversions that are about to run, in whatever order.
        others: Further files that are read: those that a volume was found to consist of, a batch's own file.
        tells: Whether the outcomes are printed on standard output, as a batch does.
        junit: The file that a batch writes its verdicts to, or None.
        one_mesh: Whether all items write parts of the first one's mesh file.

    Raises:
        SettingsError: Two of the settings name the same file.
    """
    files = FileKeys()
    owners: dict[object, Output] = {}
    outputs = [Output(None, "outcomes", STREAM)] if tells else []
    outputs += [] if junit is None else [Output(None, "verdicts", junit)]
    outputs += [output for item in items for output in _outputs(item)]
    if one_mesh:
        parts = ("mesh", MATERIALS)
        outputs = [output for output in outputs if output.role not in parts or output.item is items[0]]
    for output in outputs:
        for key in files.of_output(output.path):
            other = owners.setdefault(key, output)
            if other is not output:
                raise _shared(output, other, files)
    inputs = {item.input: item.read for item in items}
    for path in inputs:
        _refuse_read(files.of_input(path), owners, path)
    stores = {key for path in inputs for key in files.of_store(path)}
    for output in outputs if stores else ():
        if files.of_folders_above(output.path) & stores:
            raise _read_too(output, "lies in a Zarr store, which is read")
    if files.has_outputs:
        further = (file for path, read in inputs.items() for file in _further_files(path, read, files))
        for path in (*(os.fspath(other) for other in others), *further):
            _refuse_read(files.of_input(path), owners, path)


def _outputs(item: ConvertSettings | LabelSettings) -> Iterator[Output]:
    output = item.output
    paths = {"mesh": output.path, "halfedges": output.halfedges, "report": output.report}
    for role, path in (*paths.items(), ("marked mesh", output.marked)):
        if path is not None:
            yield Output(item, role, path)
    with suppress(SettingsError):  # whoever chooses the format will tell
        companion = companion_path(output.path, choose_format(output.path, output.output_format))
        if companion is not None:
            yield Output(item, MATERIALS, companion)


def _further_files(path: str, read: ReadSettings, files: FileKeys) -> Iterator[str]:
    """Yield the files of an input beside the one that it is named by, as far as its headers tell."""
    found = Path(path)
    is_folder = exists(found) and found.is_dir()
    if path.lower().endswith(_SINGLE_FILES) and read.input_format is None and not is_folder:
        return
    if found.name.upper() == "DICOMDIR" and exists(found) and found.is_file():
        found, is_folder = found.parent, True
    if is_folder:
        walk = Walk(found, Bounds(found, allow_outside=read.allow_outside))
        for name, status in walk.files():
            file = os.fspath(found / name)
            # a mesh of an earlier run may lie in the folder of its slices
            if files.is_output(status) and (is_zarr(found) or _holds_values(file)):
                yield file
        return
    with suppress(DmcError, OSError):  # the item itself will tell
        yield from map(os.fspath, pair_files(found))
        format_name = input_format(found, path, read)
        if FORMATS[format_name].layout:
            files_of = read_layout(
                format_name, found, path, replace(read, volume_index=0, channel=None, time=None)
            ).files
            yield from map(os.fspath, files_of)


def _holds_values(file: str) -> bool:
    """Return whether a file in a folder looks like a slice or a volume."""
    try:
        with Path(file).open("rb") as stream:
            start = stream.read(400)
    except OSError:
        return True
    is_zip = start.startswith(b"PK") and start[128:] != b"DICM"
    return not is_zip and any(known.can_begin(start) for known in FORMATS.values())


def _refuse_read(keys: set[object], owners: dict[object, Output], path: str) -> None:
    """Raise if one of the keys of a file that is read is an output's."""
    for key in keys & owners.keys():
        raise _read_too(owners[key], f"is the file {path}, which is read")


def _read_too(output: Output, found: str) -> SettingsError:
    """Say that an output is read as well."""
    return SettingsError(
        f"{output.path}, the {output.role} to be written, {found}; expected a file of its own, as what is"
        " there would be lost, with --force too; choose another name"
    )


def _shared(output: Output, other: Output, files: FileKeys) -> SettingsError:
    """Say that two outputs are one file."""
    item, first = output.item, other.item
    assert item is not None  # what belongs to the whole run comes first
    if first is None or item is first:
        return SettingsError(
            f"{output.path} is the {output.role} and {other.path} the {other.role} of {item.input}, which is"
            " one file; expected a file for each; choose another name for one of them"
        )
    if isinstance(item, LabelSettings) or isinstance(first, LabelSettings):
        return SettingsError(
            f"{output.path} and {other.path} are one file, for two labels of {item.input}; expected a file"
            " for each; put {label} into the name of the output"
        )
    is_same = item.input == first.input
    is_same = is_same or bool(files.of_input(item.input) & files.of_input(first.input))
    isovalue, other_isovalue = (isovalue_text(one.surface.isovalue) for one in (item, first))
    if is_same and item.surface.isovalue == first.surface.isovalue:
        return SettingsError(
            f"{output.path} is the output of {item.input} at {isovalue} twice; expected each input at each"
            " isovalue once; leave one of the two out, or choose another name for its output"
        )
    return SettingsError(
        f"{output.path} is the output of {first.input} at {other_isovalue} and of {item.input} at {isovalue};"
        " expected one file an item; use {stem} and {isovalue} in its name, and where they do not differ"
        " {parent}, {index} or more digits, as in {isovalue:.9f}"
    )
