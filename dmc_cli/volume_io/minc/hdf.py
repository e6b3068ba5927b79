"""Open MINC 2, which is HDF5, by h5py, an extra, and nibabel.

What HDF5 would follow elsewhere (links, storage in other files), or would unpack whatever comes out, is
looked at before any value is read.
"""

import math
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.decoding import DEFLATE_RATIO
from dmc_cli.volume_io.minc.image import MincImage, unit_of
from dmc_cli.volume_io.unpacked_size import SLACK, passes

MISSING = 'h5py is not installed; pip install "dmc-cli[minc]" or pip install h5py'

LARGEST_CHUNK = 64
"""Times the image's own bytes that a chunk may have: what passes the image's border is stored, too."""

DEFLATE, SHUFFLE, FLETCHER = 1, 2, 3
"""HDF5's own numbers of the filters that are unpacked; the third is a checksum."""


def open_hdf(path: Path, name: str) -> MincImage:
    """Return the image of a file, which stays open as long as it is used.

    Raises:
        UnsupportedFormatError: h5py is missing, or the file leads elsewhere or is packed in an unusual way.
        DamagedVolumeError: The image is larger than what is stored of it.
        Exception: Whatever h5py and nibabel find wrong with it.
    """
    try:
        import h5py
    except ImportError as error:
        raise UnsupportedFormatError(f"{name}: a MINC 2 file found, but {MISSING}") from error
    from nibabel.minc2 import Minc2File

    file = h5py.File(path, "r")
    for group in ("/", "minc-2.0", "minc-2.0/image", "minc-2.0/image/0", "minc-2.0/dimensions"):
        _check_links(file[group], name, h5py)
    folder = file["minc-2.0/image/0"]
    image, ends = folder["image"], (folder["image-min"], folder["image-max"])
    for dataset in (image, *ends):
        if dataset.external or dataset.is_virtual:
            raise UnsupportedFormatError(
                f"{name}: {dataset.name} found in other files; expected all values in this one; "
                "copy it with h5repack"
            )
    _check_size(image, path.stat().st_size, name)
    minc = Minc2File(file)
    axes, ends_axes = _axes(image), _axes(ends[0])
    if ends_axes != _axes(ends[1]) or any(end.shape != image.shape[: end.ndim] for end in ends):
        raise ValueError("image-min and image-max along different axes")
    return MincImage(
        name=name,
        axes=axes,
        shape=image.shape,
        dtype=np.dtype(minc.get_data_dtype()),
        affine=minc.get_affine(),
        units=tuple(unit_of(file[f"minc-2.0/dimensions/{axis}"].attrs.get("units")) for axis in axes),
        valid=image.attrs.get("valid_range"),
        ends=(np.asarray(ends[0]), np.asarray(ends[1])),
        ends_axes=ends_axes,
        slabs=lambda place: _slabs(image, place, name),
    )


def _check_links(group: Any, name: str, h5py: Any) -> None:
    """Refuse a group with a link to elsewhere, in this file or another one."""
    for key in group:
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            raise UnsupportedFormatError(
                f"{name}: {group.name} holds a link, {key[:80]!r}; expected all values in this file; "
                "copy it with h5repack"
            )


def _axes(dataset: Any) -> tuple[str, ...]:
    """Return the names of a dataset's axes: as many as it has, whatever is written."""
    names = dataset.attrs.get("dimorder", b"").decode("latin-1").split(",")
    return tuple(names[: dataset.ndim])


def _check_size(image: Any, size: int, name: str) -> None:
    """Refuse an image that its file cannot hold, chunks that are not there, and filters but gzip's."""
    pipeline = image.id.get_create_plist()
    filters = [pipeline.get_filter(index)[0] for index in range(pipeline.get_nfilters())]
    if {*filters} - {DEFLATE, SHUFFLE, FLETCHER} or len({*filters}) < len(filters):
        raise UnsupportedFormatError(
            f"{name}: an image packed by HDF5's filters {filters} found; expected gzip; convert it "
            "with mincconvert"
        )
    promised = math.prod(image.shape) * image.dtype.itemsize
    stored = min(image.id.get_storage_size(), size)
    grid = math.prod(-(-n // c) for n, c in zip(image.shape, image.chunks or image.shape, strict=True))
    is_absent = image.chunks is not None and image.id.get_num_chunks() < grid
    chunk = math.prod(image.chunks or ()) * image.dtype.itemsize
    is_absent = is_absent or chunk > LARGEST_CHUNK * promised + SLACK
    if promised > stored * (DEFLATE_RATIO if DEFLATE in filters else 1) or is_absent:
        raise DamagedVolumeError(
            f"{name}: {stored} bytes found for an image of {' x '.join(map(str, image.shape))} values of "
            f"{image.dtype.name}; the file is incomplete or damaged; get it again"
        )


def _slabs(image: Any, place: tuple[int, ...], name: str) -> Iterator[AnyArray]:
    """Yield a volume's slices, as many at a time as lie in a chunk."""
    nz = image.shape[-3]
    depth = 1 if image.chunks is None else image.chunks[-3]
    for first in range(0, nz, depth):
        last = min(first + depth, nz)
        if image.chunks is not None:
            _check_chunks(image, (*place, first), name)
        yield image[(*place, slice(first, last))]


def _check_chunks(image: Any, start: tuple[int, ...], name: str) -> None:
    """Refuse chunks of the slices from `start` on that unpack to far more than their place."""
    chunk = image.chunks
    expected = math.prod(chunk) * image.dtype.itemsize
    outer = tuple(at // size * size for at, size in zip(start, chunk, strict=False))
    inner = (range(0, n, size) for n, size in zip(image.shape[-2:], chunk[-2:], strict=True))
    for offsets in product(*inner):
        _, content = image.id.read_direct_chunk((*outer, *offsets))
        if passes("zlib", content, expected):
            raise DamagedVolumeError(
                f"{name}: {len(content)} bytes found that unpack to more than the {expected} of a chunk; get "
                "the file again"
            )
