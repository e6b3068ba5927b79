"""Decode compressed or otherwise unusual pixel data, by pydicom and its plugins."""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.dicom.codestream import image_size, lacks_end
from dmc_cli.volume_io.dicom.effort import PiecewiseStream
from dmc_cli.volume_io.dicom.elements import (
    BIG_ENDIAN,
    DOUBLE_PIXEL_DATA,
    EXPLICIT,
    FLOAT_PIXEL_DATA,
    IMPLICIT,
    PIXEL_DATA,
    RLE,
    Header,
)
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.storage import Pixels
from dmc_cli.volume_io.dicom.wanted import OFFSETS, WANTED
from dmc_cli.volume_io.library_errors import library_errors

UNPACKED = (IMPLICIT, EXPLICIT, BIG_ENDIAN, RLE)
"""Syntaxes without a codestream that states a size of its own: uncompressed ones, and RLE."""

PLUGINS = {
    "1.2.840.10008.1.2.4.50": "python-gdcm",
    "1.2.840.10008.1.2.4.51": "python-gdcm",
    "1.2.840.10008.1.2.4.57": "python-gdcm",
    "1.2.840.10008.1.2.4.70": "python-gdcm",
    "1.2.840.10008.1.2.4.80": "pyjpegls",
    "1.2.840.10008.1.2.4.81": "pyjpegls",
}
"""Transfer syntax to the package that decodes it; the JPEG 2000 family is `JPEG_2000`."""

JPEG_2000 = "pylibjpeg pylibjpeg-openjpeg"

PREFERRED = ("pylibjpeg", "pyjpegls")
"""pydicom's names of the plugins that are asked alone where they are there: python-gdcm has the same
libraries for JPEG 2000 and JPEG-LS, but takes longer and prints what it finds damaged."""

PIXELS = frozenset([PIXEL_DATA, FLOAT_PIXEL_DATA, DOUBLE_PIXEL_DATA])

DECODED = (0x0028, 0x7FE0)
"""Groups of the elements that decoders look at: the image's, and those of its pixels."""

MOST_FRAGMENTS = 4096
"""More fragments than a frame has."""

COMPRESSED_SLACK = 1 << 20
"""Bytes beside twice the values that compressed ones may take with all their tables."""

RLE_SLACK = 1 << 16
"""The same of RLE, which pydicom unpacks byte by byte."""

TABLE_BYTES = 1024
"""Bytes of tables beside that in each frame, which may have fewer values."""


def decode(task: list[tuple[int, Frame]]) -> Iterator[AnyArray]:
    """Decode compressed or otherwise unusual slices by pydicom and its plugins."""
    from pydicom.pixels import get_decoder  # type: ignore[attr-defined]

    header, pixels = task[0][1].header, task[0][1].pixels
    try:
        decoder = get_decoder(header.syntax)  # type: ignore[arg-type]
    except NotImplementedError as error:
        raise UnsupportedFormatError(
            f"{header.file.name}: transfer syntax {header.syntax!r:.80} found; expected that of an image"
        ) from error
    if not decoder.is_available:
        raise _plugin_missing(header, str(decoder.UID.name))
    with library_errors(f"{header.file.name}: the pixel data cannot be decoded"):  # plugins raise whatever
        slack = RLE_SLACK if header.syntax == RLE else COMPRESSED_SLACK
        slack += TABLE_BYTES * pixels.frames
        most = (header.pixel_start or 0) + 2 * pixels.frames * pixels.frame_bytes + slack
        with header.file.open(most) as file:
            dataset = _with_pixels(header, PiecewiseStream(file, header.file.effort))
            if not any(tag in dataset for tag in (PIXEL_DATA, FLOAT_PIXEL_DATA, DOUBLE_PIXEL_DATA)):
                raise EOFError("the file ends before its pixel data are complete")
            if (
                header.syntax == BIG_ENDIAN
                and PIXEL_DATA in dataset
                and dataset[PIXEL_DATA].is_undefined_length
            ):
                raise undefined_length(header)
            wanted = [frame.index for _, frame in task]
            if header.syntax not in UNPACKED:
                _check_streams(dataset, wanted, header, pixels)
            plugin = next((name for name in PREFERRED if name in decoder.available_plugins), "")
            # pydicom's own correction of unused bits knows no HighBit
            planes = decoder.iter_array(
                dataset, indices=wanted, decoding_plugin=plugin, correct_unused_bits=False
            )
            for plane, _ in planes:
                if plane.shape != pixels.shape[::-1]:
                    raise DamagedVolumeError(
                        f"{header.file.name}: an image of {plane.shape[::-1]} pixels found, {pixels.shape} "
                        "expected"
                    )
                yield np.array(plane)


def undefined_length(header: Header) -> DamagedVolumeError:
    """Return the error of pixels that are compressed, by their length, and are not, by their syntax."""
    return DamagedVolumeError(
        f"{header.file.name}: pixel data of undefined length or in fragments, as compressed ones are, found "
        f"under the transfer syntax {header.syntax}, of those that are not; expected the syntax that they "
        "have; correct (0002,0010)"
    )


def _with_pixels(header: Header, file: Any) -> Any:
    """Return pydicom's data set of what decoders need: of a long header all else is not read once more."""
    from pydicom.filereader import read_dataset, read_partial

    known = header.dataset
    if not hasattr(known, "original_encoding"):  # found without pydicom
        tags: list[Any] = sorted(PIXELS | OFFSETS | WANTED)
        return read_partial(file, _behind_pixels(), force=True, specific_tags=tags)
    file.seek(header.pixel_start or 0)
    is_implicit, is_little_endian = known.original_encoding
    dataset = read_dataset(file, is_implicit, is_little_endian, stop_when=_behind_pixels())
    for group in DECODED:
        dataset.update(known.group_dataset(group))
    return dataset


def _behind_pixels() -> Callable[[int, str | None, int], bool]:
    """Tell pydicom to stop at the element behind the pixel data, whatever it is."""
    seen = False

    def stop(tag: int, _kind: str | None, _length: int) -> bool:
        nonlocal seen
        passed, seen = seen, tag == PIXEL_DATA
        return passed

    return stop


def _check_streams(dataset: Any, wanted: list[int], header: Header, pixels: Pixels) -> None:
    """Refuse a compressed image that has no end, or another size than its header: decoders trust both."""
    from pydicom.encaps import generate_frames

    _check_fragments(dataset.PixelData, header, pixels)
    offsets = None
    if "ExtendedOffsetTable" in dataset:
        offsets = (dataset.ExtendedOffsetTable, dataset.ExtendedOffsetTableLengths)
    streams = generate_frames(dataset.PixelData, number_of_frames=pixels.frames, extended_offsets=offsets)
    chosen = set(wanted)
    for index, stream in enumerate(islice(streams, max(wanted) + 1)):
        found = image_size(stream) if index in chosen else (*pixels.shape, 1)
        if found != (*pixels.shape, 1):
            told = "no size" if found is None else "{} x {} pixels of {} component(s)".format(*found)
            raise DamagedVolumeError(
                f"{header.file.name}: a compressed image of {told} found; expected {pixels.shape[0]} x "
                f"{pixels.shape[1]} pixels as its header says; get the file again"
            )
        if index in chosen and lacks_end(stream):
            raise DamagedVolumeError(
                f"{header.file.name}: a compressed image of {len(stream)} bytes without its end found; the "
                "file was cut short; get it again"
            )


def _check_fragments(content: bytes, header: Header, pixels: Pixels) -> None:
    """Refuse more fragments than frames can have: each costs pydicom microseconds, and may hold nothing."""
    most = MOST_FRAGMENTS * (pixels.frames + 1)
    position = count = 0
    while position + 8 <= len(content) and count <= most:
        position += 8 + int.from_bytes(content[position + 4 : position + 8], "little")
        count += 1
    if count > most:
        raise DamagedVolumeError(
            f"{header.file.name}: more than {most} fragments found for {pixels.frames} frame(s); expected a "
            "few a frame; get the file again"
        )


def _plugin_missing(header: Header, syntax_name: str) -> UnsupportedFormatError:
    package = PLUGINS.get(header.syntax, JPEG_2000)
    return UnsupportedFormatError(
        f"{header.file.name}: pixel data compressed as {syntax_name} found, but no package here decodes it; "
        f'pip install "dmc-cli[dicom]" or pip install {package}'
    )
