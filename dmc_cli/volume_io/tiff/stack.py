"""Read a volume from a TIFF file with many pages: which images it has, and the planes of the one wanted.

tifffile names the axes of each image: by OME's, ImageJ's and others' metadata, or by none, as of plain pages,
which then are slices. Only pages of the chosen volume are read.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import allocate_values, check_shape, storable_type, widened_type
from dmc_cli.volume_io.axes import UNNAMED, Axis, Choice, Image, chosen_volume
from dmc_cli.volume_io.tiff.ome import check_modulo, check_ome, ome_channels
from dmc_cli.volume_io.tiff.pages import MIN_IS_BLACK, MIN_IS_WHITE, RGB, is_aside, is_colored
from dmc_cli.volume_io.unpacked_size import passes
from dmc_cli.volume_io.within import check_beside

SAMPLE = "sample"
"""The name of the axis of colours."""

AXES = {
    **{"X": "x", "Y": "y", "Z": "z", "T": "time", "C": "channel", "S": SAMPLE, "I": UNNAMED, "Q": UNNAMED},
    **{"A": "angle", "P": "position", "R": "tile", "H": "lifetime", "E": "wavelength", "L": "exposure"},
    **{"V": "event", "M": "mosaic", "J": "tile column", "K": "tile row"},
}
"""tifffile's letters for axes; pages that nothing names are I, the other axes of an array of any names Q."""

WHOLE_SLIDES = {
    **{"svs": "Aperio SVS", "ndpi": "Hamamatsu NDPI", "scn": "Leica SCN", "bif": "Ventana BIF"},
    **{"philips": "Philips TIFF", "qpi": "PerkinElmer QPI", "avs": "Argos AVS", "indica": "Indica Labs"},
}
"""tifffile's flags of images of whole slides, which are no volumes, and the names of their formats."""

LARGEST_RATIO = 5000
"""No compression of a TIFF packs a byte into less than 1/5000 byte; a file that claims more is damaged."""

PACKERS = {8: "zlib", 32946: "zlib", 34925: "lzma", 50000: "zstd"}
"""Compression codes whose segments unpack to whatever they hold; the others' know their size."""


def stack_images(tiff: Any, path: Path, name: str, settings: ReadSettings) -> list[Image]:
    """Return the images of an open file, in the order of tifffile's series.

    Raises:
        UnsupportedFormatError: None of them is a stack of grey slices, or they are of a whole slide.
        DamagedVolumeError: OME metadata promise more than any image has.
        VolumeError: They name a file that is not to be read.
    """
    slide = next((title for flag, title in WHOLE_SLIDES.items() if getattr(tiff, f"is_{flag}", False)), None)
    if slide is not None:
        raise UnsupportedFormatError(
            f"{name}: an image of a whole slide ({slide}) found; expected a volume; write its slices into a "
            "TIFF stack"
        )
    channels: list[tuple[str, ...]] = []
    if tiff.is_ome and tiff.ome_metadata:
        check_ome(tiff.ome_metadata, len(tiff.pages), path, name, settings.allow_outside)
        check_modulo(tiff.ome_metadata, name)
        channels = ome_channels(tiff.ome_metadata)
    images = []
    for number, series in enumerate(tiff.series):
        labels = channels[number] if number < len(channels) else ()
        names = AXES | ({"S": "channel"} if not is_colored(series) and "C" not in series.axes else {})
        axes = [
            Axis(names.get(letter, f"axis {letter}"), int(size), labels if letter == "C" else ())
            for letter, size in zip(series.axes, series.shape, strict=True)
        ]
        images.append(Image(tuple(axes), str(series.name or f"image {number}")))
    if not any(image.grid for image in images):
        raise UnsupportedFormatError(
            f"{name}: an image of {images[0].told()} found; expected a stack of grey slices along "
            "z; where another axis is z in truth, correct the metadata"
        )
    return _without_others(images, tiff.series)


def _without_others(images: list[Image], series: list[Any]) -> list[Image]:
    """Return the images, without axes those that are no volume: previews, and colours beside grey ones.

    Where all have colours, the axis of these counts one volume: they may be grey in truth.
    """
    kinds = [(is_aside(each), is_colored(each)) for each in series]
    wanted = min(kind for kind, image in zip(kinds, images, strict=True) if image.grid)
    return [
        _grey_image(image) if kind == wanted else Image(()) for image, kind in zip(images, kinds, strict=True)
    ]


def _grey_image(image: Image) -> Image:
    """Return an image with one of its colours."""
    axes = (replace(axis, size=1) if axis.name == SAMPLE else axis for axis in image.axes)
    return replace(image, axes=tuple(axes))


def read_stack(tiff: Any, path: Path, name: str, settings: ReadSettings) -> tuple[AnyArray, Image, int]:
    """Return the values [k, j, i] of the chosen volume of an open file, its image and the image's number.

    Raises:
        UnsupportedFormatError: There is no stack of grey slices.
        DamagedVolumeError: The file cannot hold it, or lacks planes of it.
        AmbiguousVolumeError: Several volumes, and none chosen.
    """
    images = stack_images(tiff, path, name, settings)
    choice = chosen_volume(images, settings, name)
    image, series = images[choice.image], tiff.series[choice.image]
    check_shape(name, image.nodes)
    storable_type(name, widened_type(series.dtype))
    if series.nbytes > LARGEST_RATIO * path.stat().st_size:
        raise DamagedVolumeError(
            f"{name}: {path.stat().st_size} bytes found for {tuple(series.shape)} values; get the file again"
        )
    for other in {page.parent.filehandle.path for page in series.pages if page is not None}:
        check_beside(path, Path(other), Path(other).name, name, settings.allow_outside)
    values = _values(tiff, image, choice, name)
    if is_colored(series):
        _check_grey(values, tiff, image, choice, name)
    return values, image, choice.image


def _values(tiff: Any, image: Image, choice: Choice, name: str) -> AnyArray:
    """Return the values [k, j, i] of a volume."""
    series = tiff.series[choice.image]
    dtype = storable_type(name, widened_type(series.dtype))
    planes = _Planes(tiff, series, name)
    if not planes.are_pages:
        for page in series.pages:
            check_segments(page, name)
        nz = math.prod(series.shape) // (image.nodes[0] * image.nodes[1])
        whole = allocate_values(name, (*image.nodes[:2], nz), series.dtype).reshape(series.shape)
        series.asarray(out=whole)
        found = whole[tuple(slice(None) if w is None else w for w in choice.where)]
        return np.ascontiguousarray(found.transpose(_order(image, back=True)), dtype)
    values = allocate_values(name, image.nodes, dtype)
    planes.read(values, image, choice)
    return values


def _check_grey(values: AnyArray, tiff: Any, image: Image, choice: Choice, name: str) -> None:
    """Refuse an image whose colours are not all the same, or not opaque; `values` are those of the first.

    Raises:
        UnsupportedFormatError: It is not grey.
    """
    series = tiff.series[choice.image]
    place = series.axes.index("S")
    colors = {MIN_IS_WHITE: 1, MIN_IS_BLACK: 1, RGB: 3}.get(int(series.keyframe.photometric), 0)
    is_grey = colors <= series.shape[place] <= colors + 1 and values.dtype.kind == "u"
    for number in range(1, series.shape[place] if is_grey else 1):
        where = (*choice.where[:place], number, *choice.where[place + 1 :])
        other = _values(tiff, image, replace(choice, where=where), name)
        is_grey &= bool((other == (values if number < colors else np.iinfo(values.dtype).max)).all())
    if not is_grey:
        raise UnsupportedFormatError(
            f"{name}: an image with colours or transparent pixels found; expected a stack of grey slices; "
            "convert it to grey"
        )


def _order(image: Image, back: bool = False) -> tuple[int, ...]:
    """Return how to transpose [k, j, i] to the order in which the image's axes are stored, or back."""
    assert image.grid is not None
    order = np.argsort(image.grid)
    return tuple(int(axis) for axis in (np.argsort(order) if back else order))


class _Planes:
    """The planes of a series: a page each, or all of them one after the other behind a single page."""

    def __init__(self, tiff: Any, series: Any, name: str) -> None:
        """Tell whether planes can be read one by one."""
        self.tiff, self.series, self.name = tiff, series, name
        self.shape = tuple(int(n) for n in series.keyframe.shape)
        self.leading = tuple(int(n) for n in series.shape[: len(series.shape) - len(self.shape)])
        files = {id(page.parent) for page in series.pages if page is not None}
        self.start = series.dataoffset if len(files) == 1 else None
        count = math.prod(self.leading)
        self.are_pages = (
            series.transform is None
            and tuple(series.shape) == self.leading + self.shape
            and (self.start is not None or len(series) == count)
        )

    def read(self, values: AnyArray, image: Image, choice: Choice) -> None:
        """Fill `values` [k, j, i] with the planes of a volume."""
        count = len(self.leading)
        kept = tuple(slice(None) if w is None else w for w in choice.where)
        numbers = np.arange(math.prod(self.leading)).reshape(self.leading)[kept[:count]]
        if self.start is None:
            self._check(numbers)
        is_whole = all(k == slice(None) for k in kept[count:])  # each plane is a slice
        if (
            is_whole
            and numbers.ndim == 1
            and _order(image) == (0, 1, 2)
            and values.dtype.itemsize == self.series.dtype.itemsize
        ):
            self._read_stack(numbers, values.view(self.series.dtype))
            return
        target = values.transpose(_order(image))
        for place in np.ndindex(numbers.shape):
            target[place] = self._plane(int(numbers[place]))[kept[count:]]

    def _check(self, numbers: AnyArray) -> None:
        """Refuse planes that are not there, or that unpack to more than they are."""
        for number in numbers.ravel():
            page = self.series[int(number)]
            if page is None:
                raise DamagedVolumeError(
                    f"{self.name}: plane {number} of {math.prod(self.leading)} is missing that the metadata "
                    "name; get the file again, with all files that belong to it"
                )
            check_segments(page, self.name)

    def _read_stack(self, numbers: AnyArray, values: AnyArray) -> None:
        """Fill an array with planes that are its slices."""
        if self.start is None:
            self.tiff.asarray(key=[int(n) for n in numbers], series=self.series, out=values)
        elif (np.diff(numbers) == 1).all():
            self._stored(int(numbers[0]), len(numbers), values)
        else:
            for plane, number in zip(values, numbers, strict=True):
                self._stored(int(number), 1, plane)

    def _plane(self, number: int) -> AnyArray:
        if self.start is None:
            found: AnyArray = self.series[number].asarray()
            return found.reshape(self.shape)
        return self._stored(number, 1, None).reshape(self.shape)

    def _stored(self, first: int, count: int, out: AnyArray | None) -> AnyArray:
        """Return uncompressed planes that lie one after the other."""
        dtype, nodes = self.series.dtype, math.prod(self.shape)
        page = self.series.pages[0]  # which may lie in another file
        with _file_of(page) as file:
            found: AnyArray = file.read_array(
                dtype.newbyteorder(page.parent.byteorder),
                count * nodes,
                self.start + first * nodes * dtype.itemsize,
                out=out,
            )
        return found


def check_segments(page: Any, name: str) -> None:
    """Refuse a page with a strip or tile that unpacks to far more than its place in the page.

    Raises:
        DamagedVolumeError: It has one.
    """
    if page is None or int(page.keyframe.compression) not in PACKERS:
        return
    frame = page.keyframe
    packer, expected = PACKERS[int(frame.compression)], math.prod(frame.chunks) * frame.dtype.itemsize
    with _file_of(page) as file:
        for begin, count in zip(page.dataoffsets, page.databytecounts, strict=False):
            file.seek(begin)
            if passes(packer, file.read(count), expected):
                raise DamagedVolumeError(
                    f"{name}: {count} bytes found that unpack to more than the {expected} of a part of page "
                    f"{page.index}; get the file again"
                )


@contextmanager
def _file_of(page: Any) -> Iterator[Any]:
    """Give the open file in which a page lies, as tifffile does: it leaves the further ones closed."""
    file = page.parent.filehandle
    was_closed = file.closed
    if was_closed:
        file.open()
    try:
        yield file
    finally:
        if was_closed:
            file.close()
