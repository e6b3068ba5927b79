"""Read NRRD: .nrrd with its values, .nhdr with detached ones; every encoding of the format but `zrl`.

The header is read here and not by pynrrd, which refuses files that users have: lists and patterns of
data files, `encoding: hex`, repeated fields, `space` beside `spacings`. Where the grid
lies is told by `geometry.py`.
"""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.axes import UNNAMED, Axis, Choice, Image, chosen_volume, listed_volumes
from dmc_cli.volume_io.data_files import listed_files, named_file, pattern_files
from dmc_cli.volume_io.layout import FROM_END, Encoding, Layout, check_file
from dmc_cli.volume_io.nrrd.geometry import nrrd_geometry
from dmc_cli.volume_io.nrrd.header import numbers, per_axis, read_header, vector
from dmc_cli.volume_io.nrrd.labels import axis_names, spatial_axes, unnamed_order
from dmc_cli.volume_io.nrrd.segments import segment_labels

TYPES = {
    "int8": ("signed char", "int8", "int8_t"),
    "uint8": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "int16": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "uint16": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "int32": ("int", "signed int", "int32", "int32_t"),
    "uint32": ("uint", "unsigned int", "uint32", "uint32_t"),
    "int64": (
        "longlong",
        "long long",
        "long long int",
        "signed long long",
        "signed long long int",
        "int64",
        "int64_t",
    ),
    "uint64": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "float32": ("float",),
    "float64": ("double",),
}
"""NumPy's name of a type to the format's spellings."""

ENCODINGS: dict[str, Encoding] = {
    "raw": "raw",
    "txt": "text",
    "text": "text",
    "ascii": "text",
    "hex": "hex",
    "gz": "gzip",
    "gzip": "gzip",
    "bz2": "bzip2",
    "bzip2": "bzip2",
}

VALUE_KINDS = re.compile(r".*(vector|color|matrix|point|normal|gradient|quaternion|complex)$")
"""Kinds of an axis along which one node has several numbers, none of which stands for the node alone."""

PER_AXIS = (
    *("space directions", "kinds", "labels", "spacings", "thicknesses", "axis mins", "axis maxs"),
    *("centerings", "centers"),
)
"""Fields that have one entry an axis; of units, those that are missing are told."""


def nrrd_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of a NRRD file; of a 4-D one the part `settings.volume_index`.

    Raises:
        UnsupportedFormatError: No NRRD file, or a variant of it that is not read.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    check_file(path, name)
    fields, header_bytes, trailing = read_header(path, name)
    sizes = numbers(fields, "sizes", name, int)
    image = _image(fields, sizes, name)
    check_shape(name, image.nodes)
    dtype = _dtype(fields, name)
    assert image.grid is not None
    z, y, x = (len(sizes) - 1 - axis for axis in image.grid)
    affine, space, notes = nrrd_geometry(fields, (x, y, z), settings, name)
    _check_values(fields, image, settings, name)
    choice = chosen_volume([image], settings, name)
    encoding = ENCODINGS.get(fields.get("encoding", "raw").lower())
    if encoding is None:
        known = ", ".join(dict.fromkeys(ENCODINGS.values()))
        raise UnsupportedFormatError(
            f"{name}: encoding {fields['encoding']!r} found; expected one of {known}"
        )
    files = _data_files(path, fields, trailing, len(sizes), name, settings.allow_outside)
    return Layout(
        name=name,
        shape=image.nodes,
        dtype=dtype,
        affine=affine,
        space=space,
        files=files,
        start=header_bytes if files == (path,) else 0,
        offset=_skip(fields, "byte skip", name),
        line_skip=_skip(fields, "line skip", name),
        encoding=encoding,
        format="nrrd",
        listed=listed_volumes([image], settings, name),
        warnings=(*unnamed_order(fields, sizes), *_quantized(fields, dtype), *notes),
        labels=segment_labels(path, name),
        **_placed(image, choice),
    )


def _quantized(fields: dict[str, str], dtype: np.dtype[Any]) -> tuple[Notice, ...]:
    """Return a warning where whole numbers stand for a range of others, from which they were rounded."""
    ends = [fields.get(f"old {end}", fields.get(f"old{end}", "nan")) for end in ("min", "max")]
    if dtype.kind not in "iu" or any(end.lower() == "nan" for end in ends):
        return ()
    sentence = (
        f"the header's values were {ends[0][:20]} to {ends[1][:20]} before they were rounded to "
        f"{dtype.name}; they are taken as they are stored"
    )
    return (Notice("W-VALUES-MAPPED", sentence),)


def _skip(fields: dict[str, str], key: str, name: str) -> int:
    if key not in fields:
        return 0
    found = numbers(fields, key, name, int)
    least = FROM_END if key == "byte skip" else 0
    if len(found) != 1 or not least <= found[0] <= 2**40:
        raise DamagedVolumeError(
            f"{name}: {key} {fields[key][:60]!r} found in the header; expected one number"
        )
    return int(found[0])


def _dtype(fields: dict[str, str], name: str) -> np.dtype[Any]:
    """Return the type of a value, with its byte order."""
    wanted = " ".join(fields["type"].lower().split())
    found = next((numpy for numpy, spellings in TYPES.items() if wanted in spellings), None)
    if found is None:
        raise UnsupportedFormatError(
            f"{name}: type {fields['type'][:60]!r} found; expected integers, float or double"
        )
    order = fields.get("endian", "little").lower()
    if order not in ("little", "big"):
        raise DamagedVolumeError(f"{name}: endian {order[:60]!r} found; expected little or big")
    text = ENCODINGS.get(fields["encoding"].lower()) == "text"
    return np.dtype(found).newbyteorder("=" if text else ">" if order == "big" else "<")


def _image(fields: dict[str, str], sizes: list[int], name: str) -> Image:
    """Return the axes: those of space by their directions, else by their kinds, else by their labels.

    An axis that nothing names is one of space where some are missing.
    """
    if str(len(sizes)) != fields["dimension"].strip():
        raise DamagedVolumeError(
            f"{name}: dimension {fields['dimension'][:20]} found, but {len(sizes)} sizes"
        )
    if any(n < 1 for n in sizes) or len(sizes) > 16:
        raise DamagedVolumeError(f"{name}: sizes {fields['sizes'][:60]!r} found; expected positive numbers")
    directions = per_axis(fields.get("space directions", ""))
    _check_counts(fields, len(sizes), name)
    if len(directions) == len(sizes):
        spatial = [a for a, d in enumerate(directions) if not _is_none(d, len(sizes))]
        if len(spatial) > 3:  # a space with time: the axis that moves in time only is none of space
            spatial = [a for a in spatial if any(vector(directions[a], name)[:3])]
    else:
        spatial = spatial_axes(fields, len(sizes))
    spatial = spatial[:3]
    if len(spatial) != 3:
        raise UnsupportedFormatError(
            f"{name}: sizes {' x '.join(map(str, sizes))} found with {len(spatial)} axes of space; expected "
            "three axes of space among them; where another axis is one in truth, correct kinds and labels"
        )
    axes = [Axis(UNNAMED, n) if a in spatial else _other_axis(fields, sizes, a) for a, n in enumerate(sizes)]
    return Image(tuple(reversed(axes)))


def _check_counts(fields: dict[str, str], count: int, name: str) -> None:
    """Raise DamagedVolumeError for a field that has not one entry an axis; an empty one tells nothing.

    Of units some may be missing, which is told, but none is too many.
    """
    found = len(per_axis(fields.get("units", "")))
    if found > count:
        raise DamagedVolumeError(
            f"{name}: {found} units found, but {count} axes; expected one an axis; correct the header"
        )
    for key in PER_AXIS:
        found = len(per_axis(fields.get(key, "")))
        if found not in (0, count):
            raise DamagedVolumeError(
                f"{name}: {found} {key} found, but {count} axes; expected one an axis; correct the header"
            )


def _is_none(direction: str, count: int) -> bool:
    """Return whether an axis has no direction: `none`, or (nan,nan,nan) where there are more than three."""
    return direction.lower() == "none" or (
        count > 3 and re.fullmatch(r"\((nan,?)+\)", direction.lower()) is not None
    )


def _other_axis(fields: dict[str, str], sizes: list[int], number: int) -> Axis:
    """Return an axis that is none of space, whatever its label is."""
    axis = Axis(axis_names(fields, len(sizes))[number], sizes[number])
    return axis if axis.name and axis.kind not in ("x", "y", "z") else Axis(f"axis {number}", axis.size)


def _placed(image: Image, choice: Choice) -> dict[str, Any]:
    """Return where a volume lies among the values, as a `Layout` has it."""
    fastest_first = [(axis.size, place) for axis, place in zip(image.axes, choice.where, strict=True)][::-1]
    counts, places = [1], [0]  # before, between and behind the axes of space
    for size, place in fastest_first:
        if place is None:
            counts.append(1)
            places.append(0)
        else:
            places[-1] += counts[-1] * place
            counts[-1] *= size
    return {
        "components": counts[0],
        "component": places[0],
        "between": (counts[1], counts[2]),
        "picked": (places[1], places[2]),
        "volumes": counts[3],
        "volume": places[3],
    }


def _check_values(fields: dict[str, str], image: Image, settings: ReadSettings, name: str) -> None:
    """Raise AmbiguousVolumeError where nodes hold several numbers of which none was chosen."""
    kinds = [kind.lower() for kind in per_axis(fields.get("kinds", ""))]
    for number in image.others:
        axis, size = len(image.axes) - 1 - number, image.axes[number].size
        if (
            axis < len(kinds)
            and VALUE_KINDS.match(kinds[axis])
            and size > 1
            and settings.volume_index is None
        ):
            count = math.prod(image.axes[other].size for other in image.others)
            raise AmbiguousVolumeError(
                f"{name}: every node holds {size} numbers ({kinds[axis]}); expected one; "
                f"choose a component with --volume-index N, N from 0 to {count - 1}"
            )


def _data_files(
    path: Path,
    fields: dict[str, str],
    trailing: list[str],
    dimension: int,
    name: str,
    allow_outside: bool,
) -> tuple[Path, ...]:
    """Return the files with the values, in order; the file itself where they are attached."""
    if "data file" not in fields:
        return (path,)
    tokens = fields["data file"].split()
    if not tokens:
        raise DamagedVolumeError(
            f"{name}: an empty data file field found; expected a file, a pattern or LIST"
        )
    if tokens[0] == "LIST":
        subdim = tokens[1] if len(tokens) > 1 else str(dimension - 1)
        if subdim not in (str(dimension - 1), str(dimension)):
            raise UnsupportedFormatError(
                f"{name}: data file LIST {subdim} found; expected slices of {dimension - 1} axes"
            )
        return listed_files(path, trailing, name, allow_outside)
    if "%" in tokens[0] and len(tokens) in (4, 5):
        return pattern_files(path, tokens[0], tokens[1:4], name, allow_outside)
    return (named_file(path, fields["data file"], name, allow_outside),)
