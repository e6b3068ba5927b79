"""Read MetaImage: .mha with its values, .mhd with detached ones; world axes LPS.

Each consecutive triple of TransformMatrix is the direction of one axis of the grid.
AnatomicalOrientation is not used: it repeats the matrix, and often wrongly, which is told.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.axes import Axis, chosen_volume, flat_index, listed_volumes, stacked_image
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.data_files import listed_files, named_file, pattern_files
from dmc_cli.volume_io.layout import (
    Encoding,
    Layout,
    Triple,
    check_file,
    chosen_origin,
    chosen_spacing,
)
from dmc_cli.volume_io.lengths import respaced
from dmc_cli.volume_io.units import scales_in_mm

MAX_HEADER = 1 << 20
"""Longest header that is read; real ones have some hundred bytes."""

TYPES = {
    "MET_CHAR": "int8",
    "MET_UCHAR": "uint8",
    "MET_SHORT": "int16",
    "MET_USHORT": "uint16",
    "MET_INT": "int32",
    "MET_UINT": "uint32",
    "MET_LONG": "int32",
    "MET_ULONG": "uint32",
    "MET_LONG_LONG": "int64",
    "MET_ULONG_LONG": "uint64",
    "MET_FLOAT": "float32",
    "MET_DOUBLE": "float64",
}
"""The format's types; its LONG has four bytes."""

MATRICES = "TransformMatrix", "Rotation", "Orientation"
ORIGINS = "Offset", "Position", "Origin"
BYTE_ORDERS = "BinaryDataByteOrderMSB", "ElementByteOrderMSB"
"""Fields that mean the same; the first one counts."""


def metaimage_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of a MetaImage; of a 4-D or multi-channel one the part `settings.volume_index`.

    Raises:
        UnsupportedFormatError: No MetaImage, or a variant of it that is not read.
        DamagedVolumeError: The header contradicts itself.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    check_file(path, name)
    fields, header_bytes, trailing = _read_header(path, name)
    sizes = _whole_numbers(fields, "DimSize", name)
    dimension = _whole_numbers(fields, "NDims", name)[0]
    if dimension != len(sizes) or not 1 <= dimension <= 10:
        raise DamagedVolumeError(f"{name}: NDims {dimension} found, but DimSize has {len(sizes)} numbers")
    check_shape(name, tuple(sizes[:3]))
    if any(n < 1 for n in sizes):
        raise DamagedVolumeError(
            f"{name}: DimSize {fields['DimSize'][:60]!r} found; expected positive numbers"
        )
    components = _whole_numbers(fields, "ElementNumberOfChannels", name, [1])[0]
    if not 1 <= components <= 1024:
        raise DamagedVolumeError(f"{name}: {components} channels found; expected one or some")
    volumes = math.prod(sizes[3:])
    others = [Axis(f"axis {n + 4}", size) for n, size in enumerate(sizes[3:])]  # the format names none
    image = stacked_image(sizes[:3], *reversed(others), behind=[Axis("channel", components)])
    choice = chosen_volume([image], settings, name, "channels or volumes")
    chosen = flat_index(image, choice)
    files = _data_files(path, fields, trailing, dimension, name, settings.allow_outside)
    attached = files == (path,)
    offset = _whole_numbers(fields, "HeaderSize", name, [0])[0]
    affine, notes = _affine(fields, dimension, settings, name)
    return Layout(
        name=name,
        shape=(sizes[0], sizes[1], sizes[2]),
        dtype=_dtype(fields, name),
        affine=affine,
        space="LPS",
        files=files,
        start=header_bytes if attached else 0,
        offset=0 if attached else max(offset, -1),
        encoding=_encoding(fields, None if attached else files[0]),
        components=components,
        component=chosen % components,
        volumes=volumes,
        volume=chosen // components,
        listed=listed_volumes([image], settings, name),
        format="meta",
        warnings=notes,
    )


def _encoding(fields: dict[str, str], detached: Path | None) -> Encoding:
    """Return how the values are stored: as the header says, or as the name of their own file does."""
    if not _flag(fields, ("BinaryData",), True):
        return "text"
    is_named = detached is not None and detached.suffix.lower() in (".gz", ".zraw")
    return "gzip" if is_named or _flag(fields, ("CompressedData",), False) else "raw"


def _read_header(path: Path, name: str) -> tuple[dict[str, str], int, list[str]]:
    """Return the fields by name, the header's length, and the lines after `ElementDataFile = LIST`."""
    start = first_bytes(path, name, MAX_HEADER)
    fields: dict[str, str] = {}
    position = 0
    while position < len(start) and "ElementDataFile" not in fields:
        end = start.find(b"\n", position)
        end = len(start) if end < 0 else end
        line = start[position:end].decode("utf-8", "replace").strip()
        position = end + 1
        key, separator, value = line.partition("=")
        if line and not separator:
            break
        key, value = key.strip(), value.strip()
        if fields.setdefault(key, value) != value:
            raise DamagedVolumeError(
                f"{name}: {key[:60]} found twice, {fields[key][:60]!r} and {value[:60]!r}; expected each "
                "field once; correct the header"
            )
    if "NDims" not in fields or "ElementDataFile" not in fields:
        raise UnsupportedFormatError(
            f"{name}: no MetaImage header found; expected lines `key = value` from NDims to ElementDataFile; "
            "choose another --input-format"
        )
    for key in ("DimSize", "ElementType"):
        if key not in fields:
            raise DamagedVolumeError(f"{name}: the header has no {key}; expected NDims, DimSize, ElementType")
    is_list = fields["ElementDataFile"].split()[:1] == ["LIST"]
    trailing = start[position:].decode("utf-8", "replace").splitlines() if is_list else []
    return fields, position, [line.strip() for line in trailing if line.strip()]


def _numbers(
    fields: dict[str, str], keys: tuple[str, ...], name: str, default: list[float] | None = None
) -> list[float]:
    """Return the numbers of the first of `keys` that the header has."""
    key = next((k for k in keys if k in fields), None)
    if key is None:
        return default or []
    try:
        numbers = [float(token) for token in fields[key].split()]
        if not numbers or not all(math.isfinite(n) for n in numbers):
            raise ValueError
    except ValueError as error:
        raise DamagedVolumeError(
            f"{name}: {key} = {fields[key][:60]!r} found; expected finite numbers"
        ) from error
    return numbers


def _whole_numbers(
    fields: dict[str, str], key: str, name: str, default: list[float] | None = None
) -> list[int]:
    """Return the whole numbers of a field; half a node is none."""
    numbers = _numbers(fields, (key,), name, default)
    if any(n != int(n) for n in numbers):
        raise DamagedVolumeError(f"{name}: {key} = {fields[key][:60]!r} found; expected whole numbers")
    return [int(n) for n in numbers]


def _flag(fields: dict[str, str], keys: tuple[str, ...], default: bool) -> bool:
    key = next((k for k in keys if k in fields), None)
    return default if key is None else fields[key][:1].lower() in ("t", "1", "y")


def _dtype(fields: dict[str, str], name: str) -> np.dtype[Any]:
    """Return the type of a value, with its byte order."""
    wanted = fields["ElementType"].removesuffix("_ARRAY")
    if wanted not in TYPES:
        raise UnsupportedFormatError(
            f"{name}: ElementType {wanted[:60]!r} found; expected one of {', '.join(TYPES)}"
        )
    is_big = _flag(fields, BYTE_ORDERS, False)
    is_text = not _flag(fields, ("BinaryData",), True)
    return np.dtype(TYPES[wanted]).newbyteorder("=" if is_text else ">" if is_big else "<")


def _affine(
    fields: dict[str, str], dimension: int, settings: ReadSettings, name: str
) -> tuple[Float64Array, tuple[Notice, ...]]:
    """Return the affine of the first three axes, in millimetres, and warnings."""
    identity = [float(r == c) for r in range(dimension) for c in range(dimension)]
    matrix = _numbers(fields, MATRICES, name, identity)
    spacing = _numbers(fields, ("ElementSpacing", "ElementSize"), name)
    origin = _numbers(fields, ORIGINS, name)
    if len(matrix) != dimension**2 or any(len(told) not in (0, dimension) for told in (spacing, origin)):
        raise DamagedVolumeError(
            f"{name}: {len(matrix)}, {len(spacing)} and {len(origin)} numbers found in TransformMatrix, "
            "ElementSpacing and "
            f"Offset; expected {dimension**2}, {dimension} and {dimension}"
        )
    directions = np.array(matrix).reshape(dimension, dimension)[:3, :3]
    # the format's own unit is the millimetre: a header without the field leaves nothing open
    (unit, *_), doubts = scales_in_mm([fields.get("DistanceUnits", "mm")] * 3, name, "the header")
    lengths, notes = chosen_spacing(_scaled(spacing, unit), settings, doubts=doubts)
    first, unused = chosen_origin(_scaled(origin, unit), settings)
    affine = np.eye(4)
    affine[:3, :3] = directions.T * np.array(lengths)
    affine[:3, 3] = first
    notes = (*notes, *unused, *_synonyms(fields, name), *_contradiction(fields, directions.T))
    notes = (*notes, *_mapped(fields, name))
    return respaced(affine, doubts, settings), notes


def _synonyms(fields: dict[str, str], name: str) -> tuple[Notice, ...]:
    """Return a warning for each two fields that mean the same and differ."""
    told = []
    for keys in (MATRICES, ORIGINS):
        first, *others = [key for key in keys if key in fields] or [""]
        differing = [o for o in others if _numbers(fields, (o,), name) != _numbers(fields, (first,), name)]
        told += [
            Notice(
                "W-GEOMETRY-CONTRADICTED",
                f"the header's {first} is {fields[first][:60]}, its {other} {fields[other][:60]}, which "
                "should be the same; the first is taken",
            )
            for other in differing
        ]
    if len({_flag(fields, (key,), False) for key in BYTE_ORDERS if key in fields}) > 1:
        sentence = f"the header's {' and '.join(BYTE_ORDERS)} differ; the first is taken"
        told.append(Notice("W-BITS-CONTRADICTED", sentence))
    return tuple(told)


def _contradiction(fields: dict[str, str], directions: Float64Array) -> tuple[Notice, ...]:
    """Return a warning where AnatomicalOrientation has other axes than the matrix, columns in LPS.

    Its letters say from where the axes come, as ITK writes them: RAI is LPS.
    """
    told = fields.get("AnatomicalOrientation", "").upper()
    if sorted("RAI".find(letter) + "LPS".find(letter) + 1 for letter in told) != [0, 1, 2]:
        return ()
    nearest = np.abs(directions).argmax(axis=0)
    found = "".join("RAI"[n] if directions[n, axis] > 0 else "LPS"[n] for axis, n in enumerate(nearest))
    if told == found:
        return ()
    sentence = f"the header's AnatomicalOrientation is {told}, its matrix has {found}; the matrix is taken"
    return (Notice("W-GEOMETRY-CONTRADICTED", sentence),)


def _mapped(fields: dict[str, str], name: str) -> tuple[Notice, ...]:
    """Return a warning where a function of the values is told, which no program applies."""
    slope = _numbers(fields, ("ElementToIntensityFunctionSlope",), name, [1.0])[0]
    offset = _numbers(fields, ("ElementToIntensityFunctionOffset",), name, [0.0])[0]
    if (slope, offset) == (1.0, 0.0):
        return ()
    sentence = (
        f"the header's intensities, {slope:g} x value + {offset:g}, are not applied; values are as stored"
    )
    return (Notice("W-VALUES-MAPPED", sentence),)


def _scaled(numbers: list[float], unit: float) -> Triple | None:
    """Return the first three numbers of a field in millimetres, or None where there is no such field."""
    return (numbers[0] * unit, numbers[1] * unit, numbers[2] * unit) if numbers else None


def _data_files(
    path: Path,
    fields: dict[str, str],
    trailing: list[str],
    dimension: int,
    name: str,
    allow_outside: bool,
) -> tuple[Path, ...]:
    """Return the files with the values, in order; the file itself where they are attached."""
    tokens = fields["ElementDataFile"].split()
    if not tokens:
        raise DamagedVolumeError(
            f"{name}: an empty ElementDataFile found; expected LOCAL, a file, a pattern or LIST"
        )
    if tokens[0].upper() == "LOCAL":
        return (path,)
    if tokens[0] == "LIST":
        if tokens[1:2] not in ([], [str(dimension - 1)], [f"{dimension - 1}D"]):
            raise UnsupportedFormatError(
                f"{name}: ElementDataFile = {' '.join(tokens)[:60]} found; expected a list of slices"
            )
        return listed_files(path, trailing, name, allow_outside)
    if "%" in tokens[0] and len(tokens) == 4:
        return pattern_files(path, tokens[0], tokens[1:4], name, allow_outside)
    return (named_file(path, fields["ElementDataFile"], name, allow_outside),)
