"""Open MINC 1, which is netCDF 3, by nibabel's reader: it reads the header, and the file is mapped by us.

So a file that shrinks meanwhile ends in a message, as everywhere (`dmc_cli/volume/mapping.py`).
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.volume import intact, map_file
from dmc_cli.volume_io.minc.image import MincImage
from dmc_cli.volume_io.minc.world import WHAT_PLACES

LONGEST_HEADER = 1 << 22
"""Bytes that the header is read for: more than any history of processing, and read within seconds."""


class _HeaderFile:
    """The file as far as its header goes: who asks for more is refused."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._rest = file, LONGEST_HEADER
        self.seek, self.tell, self.fileno, self.close = file.seek, file.tell, file.fileno, file.close

    @property
    def closed(self) -> bool:
        """Return whether the file was closed."""
        return self._file.closed

    def read(self, count: int) -> bytes:
        """Return the next bytes.

        Raises:
            ValueError: The header is longer than any, or ends within what is asked for.
        """
        self._rest -= max(count, 1)
        if count < 0 or self._rest < 0:
            raise ValueError(f"a header of more than {LONGEST_HEADER} bytes")
        found = self._file.read(count)
        if len(found) < count:
            raise ValueError("the header is cut short")
        return found


def open_netcdf(path: Path, name: str) -> MincImage:
    """Return the image of a file; what is wrong with it is any exception of nibabel's.

    Raises:
        DamagedVolumeError: The file shrank, or could not be read, meanwhile.
    """
    from nibabel.minc1 import Minc1File

    with path.open("rb") as file:
        # closed here, before the reader that holds it: the reader would complain of arrays that are left
        found = _mapped(file)
        minc = Minc1File(found)
    image, least, most = (found.variables[key] for key in ("image", "image-min", "image-max"))
    dtype = np.dtype(minc.get_data_dtype())
    values = np.asarray(image.data).view(dtype)
    if least.dimensions != most.dimensions:
        raise ValueError("image-min and image-max along different axes")
    ends = [getattr(image, key, None) for key in ("valid_min", "valid_max")]
    told = ends if None not in ends else None

    with intact(values, name):
        ranges = (np.array(least.data), np.array(most.data))

    def slabs(place: tuple[int, ...]) -> Iterator[AnyArray]:
        with intact(values, name):
            for plane in values[place]:
                yield plane[None]

    return MincImage(
        name=name,
        axes=tuple(image.dimensions),
        shape=values.shape,
        dtype=dtype,
        places=tuple(_places(found, axis) for axis in image.dimensions),
        valid=getattr(image, "valid_range", told),
        ends=ranges,
        ends_axes=tuple(least.dimensions),
        slabs=slabs,
    )


def _places(found: Any, axis: str) -> dict[str, Any]:
    """Return what an axis tells of where its nodes lie."""
    variable = found.variables.get(axis)
    return {key: getattr(variable, key) for key in WHAT_PLACES if hasattr(variable, key)}


def _mapped(file: BinaryIO) -> Any:
    """Return nibabel's reader of a file, its arrays in a mapping of ours.

    Raises:
        OSError: The file cannot be mapped.
    """
    from nibabel.externals.netcdf import netcdf_file

    mapping = map_file(file)
    if mapping is None:
        raise OSError("the file cannot be mapped into memory")
    stored = np.frombuffer(mapping, np.int8)

    class MappedNetcdf(netcdf_file):  # type: ignore[misc]
        def _read(self) -> None:
            """Read the header; the fields are those that the reader keeps a mapping of its own in."""
            self.__dict__.update(use_mmap=True, _mm=mapping, _mm_buf=stored)
            super()._read()

    return MappedNetcdf(_HeaderFile(file), mmap=False)
