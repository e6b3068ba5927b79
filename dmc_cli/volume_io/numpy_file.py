"""Read NumPy's own files, .npy and .npz: an array [z, y, x], spacing and origin from the settings.

Nothing is ever unpickled. Half-precision floats become float32 and truth values uint8; everything else
stays as it is. Axes have no names: the last three with more than one node are z, y, x, those before them
count volumes, as do the arrays of an .npz.
"""

import io
import math
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import (
    WIDENED,
    Volume,
    VolumeEntry,
    allocate_values,
    check_shape,
    intact,
    map_file,
    storable_type,
    widened_type,
)
from dmc_cli.volume_io.axes import (
    Image,
    chosen_volume,
    flat_index,
    images_entry,
    nameless_image,
    unnamed_axes,
)
from dmc_cli.volume_io.decoding import DEFLATE_RATIO
from dmc_cli.volume_io.layout import check_file, chosen_origin, chosen_spacing, scale_affine
from dmc_cli.volume_io.library_errors import library_errors

MAX_HEADER = 10_000
"""Longest header text that is parsed; real ones have a hundred bytes."""

MAX_ENTRIES = 10_000
"""More arrays than anybody keeps in a file."""

PACKERS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What NumPy packs by; with others Python's zip module unpacks more than it was asked for."""


LENGTHS = (
    *("spacing", "voxelsize", "voxelspacing", "pixelsize", "pixelspacing", "resolution", "affine", "origin"),
)
"""What arrays of lengths are called, without underscores."""


def numpy_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the array of an .npy file, mapped where it can be, or of an .npz.

    Raises:
        UnsupportedFormatError: No numeric array with three axes.
        DamagedVolumeError: The file ends early.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    check_file(path, name)
    with library_errors(f"{name}: the array cannot be read"):
        is_npz = zipfile.is_zipfile(path)
        values, image = (_from_npz if is_npz else _from_npy)(path, name, settings)
        beside = _lengths_beside(path) if is_npz and settings.spacing is None else ()
    progress.advance(1.0)
    spacing, warnings = chosen_spacing(None, settings)
    origin, _ = chosen_origin(None, settings)
    return Volume(
        values=values,
        affine=scale_affine(spacing, origin),
        space="none",
        path=name,
        files=(path,),
        format="numpy",
        warnings=(*unnamed_axes(image), *beside, *warnings),
    )


def _lengths_beside(path: Path) -> tuple[Notice, ...]:
    """Return what is told of arrays of an .npz that are called like lengths: they have no unit."""
    with zipfile.ZipFile(path) as archive:
        found = [entry.removesuffix(".npy") for entry in archive.namelist()]
    called = [entry for entry in found if entry.lower().replace("_", "") in LENGTHS]
    if not called:
        return ()
    sentence = f"the array {called[0][:40]!r} tells neither of which axes nor in which unit it is; not used"
    return (Notice("W-UNIT-MISSING", f"{sentence}; --spacing gives lengths"),)


def numpy_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the file as one entry with the volumes that it holds, without their values.

    Raises:
        UnsupportedFormatError: No numeric array with three axes.
    """
    check_file(path, name)
    with library_errors(f"{name}: the array cannot be read"):
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                images = list(_arrays(archive, name).values())
        else:
            with path.open("rb") as file:
                images = [nameless_image(_header(file, name)[0])]
    return [images_entry("numpy", images, settings, name)]


def _header(stream: BinaryIO, name: str) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return the shape, whether the order is Fortran's, and the type."""
    # NumPy lets its tokenizer's and its parser's errors through
    with library_errors(f"{name}: the array's header cannot be read"):
        version = np.lib.format.read_magic(stream)
        reader = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, fortran, dtype = reader(stream, max_header_size=MAX_HEADER)
    if dtype.kind not in "iufb" or len(shape) < 3:
        raise UnsupportedFormatError(
            f"{name}: an array of type {dtype} with {len(shape)} axes found; expected numbers with axes z, "
            "y, x"
        )
    if dtype.char not in WIDENED:
        storable_type(name, dtype)
    return shape, fortran, dtype


def _from_npy(path: Path, name: str, settings: ReadSettings) -> tuple[AnyArray, Image]:
    with path.open("rb") as file:
        shape, fortran, dtype = _header(file, name)
        start = file.tell()
    image = nameless_image(shape)
    choice = chosen_volume([image], settings, name)
    check_shape(name, image.nodes)
    expected = math.prod(shape) * dtype.itemsize
    found = path.stat().st_size - start
    if found < expected:
        raise DamagedVolumeError(
            f"{name}: {found} bytes of values found, {expected} expected for {shape} values of {dtype}; "
            "the file is cut short; get it again"
        )
    stored = _stored(path, start, shape, fortran, dtype)
    chosen: AnyArray = stored[tuple(slice(None) if place is None else place for place in choice.where)]
    if chosen.flags.c_contiguous and chosen.flags.aligned and dtype.isnative and dtype.char not in WIDENED:
        return chosen, image
    with intact(stored, name):
        return _copied(chosen, name), image


def _stored(path: Path, start: int, shape: tuple[int, ...], fortran: bool, dtype: np.dtype[Any]) -> AnyArray:
    """Return the array as the file has it: mapped, or read where it cannot be mapped."""
    order: Literal["C", "F"] = "F" if fortran else "C"
    with path.open("rb") as file:
        mapping = map_file(file)
    if mapping is None:
        return np.fromfile(path, dtype, math.prod(shape), offset=start).reshape(shape, order=order)
    return np.ndarray(shape, dtype, mapping, start, order=order)


def _copied(stored: AnyArray, name: str) -> AnyArray:
    """Return the values in native byte order, x fastest, in a type that a volume holds."""
    nz, ny, nx = stored.shape
    values = allocate_values(name, (nx, ny, nz), widened_type(stored.dtype))
    values[...] = stored
    return values


def _arrays(archive: zipfile.ZipFile, name: str) -> dict[str, Image]:
    """Return the numeric arrays with three axes or more of an .npz, by the names of their entries."""
    entries = archive.infolist()
    if len(entries) > MAX_ENTRIES:
        raise DamagedVolumeError(f"{name}: {len(entries)} entries found; expected at most {MAX_ENTRIES}")
    found = {}
    for entry in entries:
        if not entry.filename.endswith(".npy") or entry.compress_type not in PACKERS:
            continue
        with archive.open(entry) as stream, suppress(UnsupportedFormatError):
            shape, _, _ = _header(io.BytesIO(stream.read(MAX_HEADER + 16)), name)
            found[entry.filename] = nameless_image(shape, entry.filename.removesuffix(".npy"))
    if not found:
        raise UnsupportedFormatError(
            f"{name}: no numeric array with three axes found; expected one by np.savez"
        )
    return found


def _from_npz(path: Path, name: str, settings: ReadSettings) -> tuple[AnyArray, Image]:
    with zipfile.ZipFile(path) as archive:
        arrays = _arrays(archive, name)
        choice = chosen_volume(list(arrays.values()), settings, name)
        chosen = list(arrays)[choice.image]
        image, entry = arrays[chosen], archive.getinfo(chosen)
        check_shape(name, image.nodes)
        with archive.open(entry) as stream:
            shape, fortran, dtype = _header(stream, name)  # type: ignore[arg-type]
            count = math.prod(shape) * dtype.itemsize
            if entry.file_size < count or entry.file_size > DEFLATE_RATIO * max(entry.compress_size, 1):
                raise DamagedVolumeError(
                    f"{name}: {entry.file_size} bytes found, {count} expected; get the file again"
                )
            nx, ny, nz = image.nodes
            volumes = math.prod(shape) // (nx * ny * nz)
            stored = allocate_values(name, (nx, ny, nz * volumes if fortran else nz), dtype)
            before = 0 if fortran else flat_index(image, choice) * stored.nbytes
            found = _skip(stream, before)  # type: ignore[arg-type]
            found += _fill(stream, stored.reshape(-1).data.cast("B"))  # type: ignore[arg-type]
            if found < before + stored.nbytes:
                raise DamagedVolumeError(
                    f"{name}: {found} bytes of values found, {count} expected; get the file again"
                )
    if not dtype.isnative:
        stored.byteswap(inplace=True)
    if fortran:
        whole = stored.reshape(-1).reshape(shape, order="F")
        stored = whole[tuple(slice(None) if place is None else place for place in choice.where)]
    return _copied(stored, name) if fortran or dtype.char in WIDENED else stored, image


def _skip(stream: BinaryIO, count: int) -> int:
    """Pass over bytes of a stream; returns how many there were."""
    passed = 0
    while passed < count:
        piece = stream.read(min(1 << 20, count - passed))
        if not piece:
            break
        passed += len(piece)
    return passed


def _fill(stream: BinaryIO, target: memoryview) -> int:
    """Fill `target` from the stream; returns how many bytes there were."""
    filled = 0
    while filled < len(target):
        piece = stream.read(min(1 << 20, len(target) - filled))
        if not piece:
            break
        target[filled : filled + len(piece)] = piece
        filled += len(piece)
    return filled
