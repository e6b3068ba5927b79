"""Read NRRD: .nrrd with its values, .nhdr with detached ones; every encoding of the format but `zrl`.

The header is read here and not by pynrrd, which refuses files that users have: lists and patterns of
data files, `encoding: hex`, repeated fields, `space` beside `spacings`. Where the grid
lies is told by `geometry.py`.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.data_files import listed_files, named_file, pattern_files
from dmc_cli.volume_io.layout import FROM_END, Encoding, Layout, check_file, chosen_index
from dmc_cli.volume_io.nrrd.geometry import nrrd_geometry
from dmc_cli.volume_io.nrrd.header import numbers, per_axis, read_header, vector

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

SPATIAL_KINDS = {"domain", "space"}
VALUE_KINDS = re.compile(r".*(vector|color|matrix|point|normal|gradient|quaternion|complex)$")
"""Kinds of an axis along which one node has several numbers, none of which stands for the node alone."""


@dataclass(frozen=True)
class _Axes:
    """Which axes are space and how many numbers lie before (components) and behind (volumes) them."""

    spatial: tuple[int, int, int]
    components: int
    volumes: int
    value_kind: str


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
    axes = _axes(fields, sizes, name)
    shape = tuple(sizes[a] for a in axes.spatial)
    check_shape(name, shape)
    dtype = _dtype(fields, name)
    affine, space, notes = nrrd_geometry(fields, axes.spatial, settings, name)
    component, volume = _choice(axes, settings, name)
    encoding = ENCODINGS.get(fields.get("encoding", "raw").lower())
    if encoding is None:
        known = ", ".join(dict.fromkeys(ENCODINGS.values()))
        raise UnsupportedFormatError(
            f"{name}: encoding {fields['encoding']!r} found; expected one of {known}"
        )
    files = _data_files(path, fields, trailing, len(sizes), name, settings.allow_outside)
    return Layout(
        name=name,
        shape=(shape[0], shape[1], shape[2]),
        dtype=dtype,
        affine=affine,
        space=space,
        files=files,
        start=header_bytes if files == (path,) else 0,
        offset=_skip(fields, "byte skip", name),
        line_skip=_skip(fields, "line skip", name),
        encoding=encoding,
        components=axes.components,
        component=component,
        volumes=axes.volumes,
        volume=volume,
        format="nrrd",
        warnings=notes,
    )


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


def _axes(fields: dict[str, str], sizes: list[int], name: str) -> _Axes:
    """Tell the three axes of space from the others."""
    if str(len(sizes)) != fields["dimension"].strip():
        raise DamagedVolumeError(
            f"{name}: dimension {fields['dimension'][:20]} found, but {len(sizes)} sizes"
        )
    if any(n < 1 for n in sizes) or len(sizes) > 16:
        raise DamagedVolumeError(f"{name}: sizes {fields['sizes'][:60]!r} found; expected positive numbers")
    kinds = [kind.lower() for kind in per_axis(fields.get("kinds", ""))]
    directions = per_axis(fields.get("space directions", ""))
    if len(directions) == len(sizes):
        spatial = [a for a, d in enumerate(directions) if d.lower() != "none"]
        if len(spatial) > 3:  # a space with time: the axis that moves in time only is none of space
            spatial = [a for a in spatial if any(vector(directions[a], name)[:3])]
    elif len(kinds) == len(sizes) and any(k in SPATIAL_KINDS for k in kinds):
        spatial = [a for a, kind in enumerate(kinds) if kind in SPATIAL_KINDS]
    else:
        spatial = list(range(len(sizes)))
    spatial = spatial[:3]
    if len(spatial) != 3 or spatial[2] - spatial[0] != 2 + sum(sizes[a] == 1 for a in _between(spatial)):
        raise UnsupportedFormatError(
            f"{name}: sizes {' x '.join(map(str, sizes))} found; expected three neighbouring axes of space, "
            "and at most others before or behind them"
        )
    value_kind = next(
        (kinds[a] for a in range(spatial[0]) if len(kinds) == len(sizes) and VALUE_KINDS.match(kinds[a])), ""
    )
    return _Axes(
        (spatial[0], spatial[1], spatial[2]),
        math.prod(sizes[: spatial[0]]),
        math.prod(sizes[spatial[2] + 1 :]),
        value_kind,
    )


def _between(spatial: list[int]) -> list[int]:
    return [a for a in range(spatial[0], spatial[-1]) if a not in spatial]


def _choice(axes: _Axes, settings: ReadSettings, name: str) -> tuple[int, int]:
    """Return the component and volume to read; numbered with the components fastest."""
    if axes.value_kind and axes.components > 1 and settings.volume_index is None:
        raise AmbiguousVolumeError(
            f"{name}: every node holds {axes.components} numbers ({axes.value_kind}); expected one; "
            f"choose a component with --volume-index N, N from 0 to {axes.components * axes.volumes - 1}"
        )
    volume, component = divmod(
        chosen_index(name, axes.components * axes.volumes, settings.volume_index), axes.components
    )
    return component, volume


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
