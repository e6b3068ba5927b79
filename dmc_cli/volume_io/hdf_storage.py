"""Look at how a dataset of HDF5 is stored, before any value of it is read, and at its attributes.

What HDF5 would follow into other files, or would unpack whatever comes out, is refused; attributes on which
its library may crash are left out.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.decoding import DEFLATE_RATIO
from dmc_cli.volume_io.unpacked_size import SLACK, passes

LARGEST_CHUNK = 64
"""Times the dataset's own bytes that a chunk may have: what passes the border is stored, too."""

DEFLATE, SHUFFLE, FLETCHER, LZF = 1, 2, 3, 32000
"""HDF5's own numbers of the filters that are unpacked; the third is a checksum."""


class Attributes(Mapping[str, Any]):
    """Offer those attributes of a file, group or dataset of h5py that are texts or numbers.

    Others mean nothing here, and where a file is damaged HDF5's library may end the process over sequences of
    any length.
    """

    def __init__(self, owner: Any) -> None:
        self._all = owner.attrs

    def __getitem__(self, name: str) -> Any:
        """Return an attribute as h5py does; KeyError if it is not there or of another type."""
        if not self._is_plain(name):
            raise KeyError(name)
        return self._all[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return filter(self._is_plain, self._all)

    def __len__(self) -> int:
        """Return how many there are."""
        return sum(1 for _ in self)

    def _is_plain(self, name: str) -> bool:
        """Return whether an attribute is a text or numbers; KeyError if it is not there."""
        from h5py import h5t

        kind = self._all.get_id(name).get_type().get_class()
        return kind in (h5t.INTEGER, h5t.FLOAT, h5t.STRING, h5t.ENUM)


def check_inside(dataset: Any, name: str) -> None:
    """Raise UnsupportedFormatError for a dataset whose values lie in other files or datasets."""
    if dataset.external or dataset.is_virtual:
        raise UnsupportedFormatError(
            f"{name}: {dataset.name} found in other files; expected all values in this one; "
            "copy it with h5repack"
        )


def check_stored(
    dataset: Any, size: int, name: str, remedy: str, filters: Collection[int] = (DEFLATE, SHUFFLE, FLETCHER)
) -> None:
    """Refuse a dataset that its file cannot hold, chunks that are not there, and other filters.

    Args:
        dataset: An open dataset of h5py.
        size: Bytes of the file.
        name: The input, for messages.
        remedy: What to do about an unusual filter.
        filters: Those that are unpacked.

    Raises:
        UnsupportedFormatError: It is packed by another filter.
        DamagedVolumeError: More is promised than stored.
    """
    pipeline = dataset.id.get_create_plist()
    found = [pipeline.get_filter(index)[0] for index in range(pipeline.get_nfilters())]
    if {*found} - {*filters} or len({*found}) < len(found):
        raise UnsupportedFormatError(
            f"{name}: an image packed by HDF5's filters {found} found; expected gzip; {remedy}"
        )
    promised = math.prod(dataset.shape) * dataset.dtype.itemsize
    stored = min(dataset.id.get_storage_size(), size)
    grid = math.prod(-(-n // c) for n, c in zip(dataset.shape, dataset.chunks or dataset.shape, strict=True))
    is_absent = dataset.chunks is not None and dataset.id.get_num_chunks() < grid
    chunk = math.prod(dataset.chunks or ()) * dataset.dtype.itemsize
    is_absent = is_absent or chunk > LARGEST_CHUNK * promised + SLACK
    is_packed = DEFLATE in found or LZF in found
    if promised > stored * (DEFLATE_RATIO if is_packed else 1) or is_absent:
        raise DamagedVolumeError(
            f"{name}: {stored} bytes found for an image of {' x '.join(map(str, dataset.shape))} values of "
            f"{dataset.dtype.name}; the file is incomplete or damaged; get it again"
        )


def stored_slabs(dataset: Any, where: Sequence[int | None], name: str) -> Iterator[AnyArray]:
    """Yield a volume's planes along the first of its axes, as many at a time as lie in a chunk.

    Args:
        dataset: An open dataset of h5py.
        where: For each axis the volume's place, or None for the three axes that are its own.
        name: The input, for messages.

    Raises:
        DamagedVolumeError: A chunk unpacks to far more than its place.
    """
    along = list(where).index(None)
    depth = 1 if dataset.chunks is None else dataset.chunks[along]
    for first in range(0, dataset.shape[along], depth):
        parts: list[int | slice] = [
            slice(0, n) if w is None else w for w, n in zip(where, dataset.shape, strict=True)
        ]
        parts[along] = slice(first, min(first + depth, dataset.shape[along]))
        if dataset.compression == "gzip":
            _check_chunks(dataset, parts, name)
        yield dataset[tuple(parts)]


def _check_chunks(dataset: Any, parts: Sequence[int | slice], name: str) -> None:
    """Refuse chunks of a part of a dataset that unpack to far more than their place."""
    expected = math.prod(dataset.chunks) * dataset.dtype.itemsize
    along = (
        range(part // size * size, part + 1, size)
        if isinstance(part, int)
        else range(part.start // size * size, part.stop, size)
        for part, size in zip(parts, dataset.chunks, strict=True)
    )
    for offsets in product(*along):
        _, content = dataset.id.read_direct_chunk(offsets)
        if passes("zlib", content, expected):
            raise DamagedVolumeError(
                f"{name}: {len(content)} bytes found that unpack to more than the {expected} of a chunk; get "
                "the file again"
            )
