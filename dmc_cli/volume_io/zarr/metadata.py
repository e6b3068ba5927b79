"""Read and check what a Zarr store says of an array, once: nothing else decides how chunks are unpacked.

Version 2 (.zarray, .zgroup, .zattrs) and version 3 (zarr.json) of the Zarr specification. Consolidated
metadata repeat these files and are not read, so they cannot contradict them.
"""

import json
import math
import os
import re
import stat
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.climate import scale_of_values
from dmc_cli.volume_io.within import REMEDY, Bounds
from dmc_cli.volume_io.zarr.codecs import Packing, Step, checked_step

MAX_METADATA = 1 << 24
"""Longest metadata file that is read."""

MAX_AXES = 32

_KNOWN_KEYS = frozenset(
    (
        *("zarr_format", "node_type", "shape", "data_type", "chunk_grid", "chunk_key_encoding", "fill_value"),
        *("codecs", "attributes", "storage_transformers", "dimension_names", "consolidated_metadata"),
    )
)


@dataclass(frozen=True, kw_only=True)
class Sharding:
    """How a file holds many chunks: the codec sharding_indexed of version 3.

    Attributes:
        chunk: Nodes of an inner chunk along each axis.
        index_first: Whether the table of their places is at the start of the file, not at its end.
        index_order: Byte order of the table.
        has_checksum: Whether a CRC-32C of four bytes follows the table.
    """

    chunk: tuple[int, ...]
    index_first: bool
    index_order: str
    has_checksum: bool


@dataclass(frozen=True, kw_only=True)
class ZarrArray:
    """An array as its metadata describe it.

    Attributes:
        shape: Nodes along each axis.
        chunk: Nodes that a file holds along each axis.
        packing: How a chunk, or of a file with many an inner one, is stored.
        fill: The value of nodes whose chunk is not there.
        prefix: What the names of all files begin with.
        separator: What stands between the numbers in their names.
        sharding: Where files hold many chunks, how; else None.
        names: What the axes are called, "" for one without a name; none where nothing names them.
        scale: Physical value a stored unit, and of stored 0, as CF's attributes have it.
        notices: What is told of these.
        attributes: All that its metadata say beside.
    """

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    packing: Packing
    fill: Any
    prefix: str
    separator: str
    sharding: Sharding | None = None
    names: tuple[str, ...] = ()
    scale: tuple[float, float] = (1.0, 0.0)
    notices: tuple[Notice, ...] = ()
    attributes: dict[str, Any] = field(default_factory=dict)

    @property
    def grid(self) -> tuple[int, ...]:
        """Return the number of files along each axis."""
        return tuple(-(-n // m) for n, m in zip(self.shape, self.chunk, strict=True))

    def place_of(self, key: str) -> tuple[int, ...] | None:
        """Return the place in the grid of a file's name below the array's folder; None for any other file."""
        if not key.startswith(self.prefix):
            return None
        parts = key[len(self.prefix) :].split(self.separator)
        if len(parts) != len(self.shape) or not all(re.fullmatch(r"0|[1-9][0-9]{0,11}", p) for p in parts):
            return None
        place = tuple(int(part) for part in parts)
        return place if all(i < n for i, n in zip(place, self.grid, strict=True)) else None


def read_json(path: Path, bounds: Bounds, name: str) -> Any:
    """Return a metadata file's content, None where there is no such file.

    Raises:
        VolumeError: It is not to be read.
        DamagedVolumeError: It is too long.
    """
    try:
        status = os.stat(path)  # noqa: PTH116 -- Path.stat hides which error it was on old Pythons
    except FileNotFoundError:
        return None
    if not bounds.hold(path):
        raise VolumeError(f"{name}: {path.name} is a link out of the store; {REMEDY}")
    if not stat.S_ISREG(status.st_mode):
        raise VolumeError(f"{name}: {path.name} is no regular file; expected metadata; get the store again")
    with path.open("rb") as file:
        content = file.read(MAX_METADATA + 1)
    if len(content) > MAX_METADATA:
        raise DamagedVolumeError(
            f"{name}: {path.name} has more than {MAX_METADATA} bytes; expected metadata; get the store again"
        )
    return json.loads(content)


def read_node(folder: Path, bounds: Bounds, name: str) -> ZarrArray | dict[str, Any] | None:
    """Return the array in a folder, or the attributes of the group; None where there is neither.

    Raises:
        VolumeError: Its metadata cannot be used.
        ValueError, KeyError, TypeError, ...: They are not what the specifications say.
    """
    new = read_json(folder / "zarr.json", bounds, name)
    if new is not None:
        if new["zarr_format"] != 3:
            raise ValueError(f"zarr_format is {new['zarr_format']!r}; expected 3")
        attributes = dict(new.get("attributes") or {})
        return attributes if new["node_type"] == "group" else _scaled(_version_3(new, name), attributes)
    old = read_json(folder / ".zarray", bounds, name)
    if old is not None:
        attributes = read_json(folder / ".zattrs", bounds, name) or {}
        if "_ARRAY_DIMENSIONS" in attributes and old.get("fill_value"):
            # so xarray marks missing values; 0 is what others fill with
            attributes = {"_FillValue": old["fill_value"], **attributes}
        return _scaled(_version_2(old, name), dict(attributes))
    group = read_json(folder / ".zgroup", bounds, name)
    if group is None:
        return None
    return dict(read_json(folder / ".zattrs", bounds, name) or {})


def _scaled(array: ZarrArray, attributes: dict[str, Any]) -> ZarrArray:
    """Return an array with its attributes, the names of its axes and CF's scale, as xarray writes them."""
    slope, intercept, told = scale_of_values(attributes)
    names = array.names or _names(attributes.get("_ARRAY_DIMENSIONS"))
    return replace(array, scale=(slope, intercept), notices=told, names=names, attributes=attributes)


def _version_2(meta: dict[str, Any], name: str) -> ZarrArray:
    if meta["zarr_format"] != 2:
        raise ValueError(f"zarr_format is {meta['zarr_format']!r}; expected 2")
    shape, chunk = _sizes(meta["shape"], 0), _sizes(meta["chunks"], 1)
    dtype = _number_type(meta["dtype"], name)
    axes = tuple(range(len(shape)))
    separator = meta.get("dimension_separator") or "."
    if meta["order"] not in ("C", "F") or separator not in (".", "/") or len(shape) != len(chunk):
        raise ValueError("order, dimension separator or chunks are not what they can be")
    codecs = [*(meta.get("filters") or []), *([meta["compressor"]] if meta.get("compressor") else [])]
    steps = tuple(checked_step(str(c["id"]), {k: v for k, v in c.items() if k != "id"}, name) for c in codecs)
    packing = Packing(dtype, axes if meta["order"] == "C" else axes[::-1], steps)
    return ZarrArray(
        shape=shape,
        chunk=chunk,
        packing=packing,
        fill=_fill(meta.get("fill_value"), dtype),
        prefix="",
        separator=separator,
    )


def _version_3(meta: dict[str, Any], name: str) -> ZarrArray:
    if meta["node_type"] != "array":
        raise ValueError(f"node_type is {meta['node_type']!r}; expected array or group")
    strange = [k for k, v in meta.items() if k not in _KNOWN_KEYS and _must_understand(v)]
    grid, keys = meta["chunk_grid"], meta["chunk_key_encoding"]
    strange += [f"chunk grid {grid['name']}"] if grid["name"] != "regular" else []
    strange += ["storage transformers"] if meta.get("storage_transformers") else []
    strange += [f"chunk keys {keys['name']}"] if keys["name"] not in ("default", "v2") else []
    if strange:
        raise UnsupportedFormatError(
            f"{name}: an extension of Zarr found ({', '.join(map(str, strange))[:200]}); expected a plain "
            "array; convert the store"
        )
    shape, chunk = _sizes(meta["shape"], 0), _sizes(grid["configuration"]["chunk_shape"], 1)
    dtype = _number_type(meta["data_type"], name)
    separator = (keys.get("configuration") or {}).get("separator", "/" if keys["name"] == "default" else ".")
    if separator not in (".", "/") or len(shape) != len(chunk):
        raise ValueError("separator or chunk shape are not what they can be")
    codecs = [c if isinstance(c, dict) else {"name": c} for c in meta["codecs"]]
    sharding = None
    if any(c["name"] == "sharding_indexed" for c in codecs):
        if len(codecs) != 1:
            raise UnsupportedFormatError(
                f"{name}: codecs beside sharding_indexed found; expected it alone; convert the store"
            )
        sharding, codecs = _sharding(codecs[0]["configuration"], chunk, name)
    return ZarrArray(
        shape=shape,
        chunk=chunk,
        packing=_packing(codecs, dtype, len(shape), name),
        fill=_fill(meta["fill_value"], dtype),
        prefix=f"c{separator}" if keys["name"] == "default" else "",
        separator=separator,
        sharding=sharding,
        names=_names(meta.get("dimension_names")),
    )


def _names(told: Any) -> tuple[str, ...]:
    """Return the names of axes as xarray's attribute of version 2 or a field of version 3 has them."""
    return tuple("" if named is None else str(named)[:100] for named in told or ())


def _must_understand(value: Any) -> bool:
    return not (isinstance(value, dict) and value.get("must_understand") is False)


def _sharding(told: dict[str, Any], shard: tuple[int, ...], name: str) -> tuple[Sharding, list[Any]]:
    """Return the table of a file with many chunks, and the codecs of these."""
    chunk = _sizes(told["chunk_shape"], 1)
    location = told.get("index_location", "end")
    index = [c if isinstance(c, dict) else {"name": c} for c in told["index_codecs"]]
    names = [c["name"] for c in index]
    if names not in (["bytes"], ["bytes", "crc32c"]):
        raise UnsupportedFormatError(f"{name}: an index of codecs {names} found; expected bytes and crc32c")
    if len(chunk) != len(shard) or any(n % m for n, m in zip(shard, chunk, strict=True)):
        raise ValueError(f"files of {shard} nodes do not hold chunks of {chunk}")
    order = (index[0].get("configuration") or {}).get("endian", "little")
    if location not in ("start", "end") or order not in ("little", "big"):
        raise ValueError("index location or byte order are not what they can be")
    sharding = Sharding(
        chunk=chunk, index_first=location == "start", index_order=order, has_checksum="crc32c" in names
    )
    return sharding, [c if isinstance(c, dict) else {"name": c} for c in told["codecs"]]


def _packing(codecs: list[dict[str, Any]], dtype: np.dtype[Any], dimension: int, name: str) -> Packing:
    """Return the codecs of version 3: transposes, then filters, `bytes`, and what packs the bytes."""
    order = tuple(range(dimension))
    steps: list[Step] = []
    byte_order = "little"
    has_bytes = False
    for codec in codecs:
        kind, told = str(codec["name"]), codec.get("configuration") or {}
        if kind == "transpose" and not steps and not has_bytes:
            axes = _axes(told["order"], dimension)
            order = tuple(order[a] for a in axes)
        elif kind == "bytes" and not has_bytes:
            has_bytes, byte_order = True, told.get("endian", "little")
            if byte_order not in ("little", "big") or (byte_order == "big" and steps):
                raise ValueError(f"endian is {byte_order!r}; expected little")
        else:
            steps.append(checked_step(kind.removeprefix("numcodecs."), told, name))
    if not has_bytes:
        raise ValueError("no codec turns values into bytes")
    return Packing(dtype.newbyteorder("<" if byte_order == "little" else ">"), order, tuple(steps))


def _axes(order: Any, dimension: int) -> list[int]:
    axes = list(range(dimension))
    found = {"C": axes, "F": axes[::-1]}.get(order, order) if isinstance(order, str) else list(order)
    if sorted(found) != axes:
        raise ValueError(f"transpose has the order {order!r}; expected the axes")
    return list(found)


def _sizes(found: Any, least: int) -> tuple[int, ...]:
    sizes = tuple(found)
    if len(sizes) > MAX_AXES or any(type(n) is not int or not least <= n < 2**40 for n in sizes):
        raise ValueError(f"{str(found)[:80]} found; expected numbers of nodes")
    return sizes


def _number_type(found: Any, name: str) -> np.dtype[Any]:
    """Return the type of a value; whether a volume can hold it is asked later."""
    if not isinstance(found, str) or not re.fullmatch(r"[<>|=]?[a-z][0-9]{1,2}|[a-z]{3,7}[0-9]{0,3}", found):
        raise UnsupportedFormatError(
            f"{name}: values of type {str(found)[:80]} found; expected integers, float32 or float64"
        )
    try:
        return np.dtype(found)
    except TypeError as error:
        raise UnsupportedFormatError(
            f"{name}: values of type {found} found; expected integers, float32 or float64"
        ) from error


def _fill(told: Any, dtype: np.dtype[Any]) -> Any:
    """Return the value of nodes that are not stored; 0 where the metadata have none."""
    if told is None or dtype.kind not in "iufb":
        return dtype.type(0)
    if dtype.kind == "b":
        if told not in (False, True):
            raise ValueError(f"fill value {told!r} found; expected true or false")
        return dtype.type(told)
    if dtype.kind == "f":
        if isinstance(told, str) and told.startswith("0x"):
            return np.array(int(told, 16), f"u{dtype.itemsize}").view(f"f{dtype.itemsize}")[()]
        number = float(told)  # which takes "NaN" and "Infinity", too
        if math.isfinite(number) and abs(number) > float(np.finfo(dtype).max):
            raise ValueError(f"fill value {told!r} found; expected a {dtype.name}")
        return dtype.type(number)
    if isinstance(told, str) or not math.isfinite(told) or told != int(told):
        raise ValueError(f"fill value {told!r} found; expected an integer")
    return np.array(int(told), dtype)[()]
