"""Bring a layout's values into memory: mapped where the file allows it, else one copy.

Uncompressed values in native byte order are mapped read-only and cost no memory. Everything else is
decoded straight into the one array that the run keeps. Sizes are checked first: a header that promises
more than its files can hold is refused before anything is allocated.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import DamagedVolumeError, VolumeError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.volume import Volume, allocate_values, check_affine, check_shape, map_file, storable_type
from dmc_cli.volume_io.decoding import LARGEST_RATIO, DecodedStream
from dmc_cli.volume_io.layout import FROM_END, Layout, check_file

MAX_LINE = 1 << 20
"""Longest line that `line_skip` skips."""

TOLD_BYTES = 1 << 24
"""After so many bytes of a file the progress is told."""

NODES_AT_ONCE = 1 << 16
"""Nodes of several values each that are read before those of the chosen component are picked."""

MOST_SKIPPED = {"gzip": 1 << 33, "bzip2": 1 << 30, "xz": 1 << 31, "zstd": 1 << 33}
SKIPPED_RATIO = 100
"""Bytes that are unpacked and passed over, at most: some seconds' worth, and so many times the file's."""


def load_volume(layout: Layout, progress: Progress = SILENT) -> Volume:
    """Return the volume of a layout, with its values mapped or read.

    Raises:
        VolumeError: A file cannot be read, or the volume is thinner than two nodes.
        UnsupportedFormatError: Values of a type that no volume holds.
        DamagedVolumeError: The files hold fewer bytes than the header promises, or cannot be decoded.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    check_shape(layout.name, layout.shape)
    check_affine(layout.name, layout.affine)
    storable_type(layout.name, layout.dtype)
    _check_sizes(layout)
    values = _loaded(layout, progress) if layout.between == (1, 1) else _picked(layout, progress)
    return Volume(
        values=values,
        affine=layout.affine,
        space=layout.space,
        slope=layout.slope,
        intercept=layout.intercept,
        path=layout.name,
        files=(*layout.headers, *layout.files),
        format=layout.format,
        warnings=layout.warnings,
        labels=layout.labels,
    )


def _loaded(layout: Layout, progress: Progress) -> AnyArray:
    values = _mapped(layout)
    return _copied(layout, progress) if values is None else values


def _picked(layout: Layout, progress: Progress) -> AnyArray:
    """Return the rows and slices of a layout that has others between them."""
    (nx, ny, nz), (rows, slices) = layout.shape, layout.between
    whole = replace(layout, shape=(nx, ny * rows, nz * slices), between=(1, 1))
    stored = _loaded(whole, progress)[layout.picked[1] :: slices, layout.picked[0] :: rows]
    values = allocate_values(layout.name, layout.shape, layout.dtype.newbyteorder("="))
    values[...] = stored
    return values


def _share(layout: Layout) -> int:
    """Return the bytes of values that each file holds after decoding."""
    total = layout.volume_bytes * layout.volumes
    if total % len(layout.files):
        raise DamagedVolumeError(
            f"{layout.name}: {len(layout.files)} data files named for {total} bytes of values; "
            "expected files of equal size; the header's list of files is wrong"
        )
    return total // len(layout.files)


def _check_sizes(layout: Layout) -> None:
    """Raise DamagedVolumeError where a file cannot hold what the header promises."""
    promised = _share(layout) + max(layout.offset, 0)
    nodes = " x ".join(str(n) for n in layout.shape)
    several = f" x {layout.components * layout.volumes}" if layout.components * layout.volumes > 1 else ""
    for path in layout.files:
        found = check_file(path, _label(layout, path))
        least = layout.start + math.ceil(promised / LARGEST_RATIO[layout.encoding])
        if found < least:
            stored = "" if layout.encoding == "raw" else f" even if {layout.encoding} packs at its best"
            raise DamagedVolumeError(
                f"{_label(layout, path)}: {found} bytes found, {least} expected{stored} for {nodes}{several} "
                "values of "
                f"{layout.dtype.name}; the file is cut short or its header is damaged; get the file again"
            )
        _check_skipped(layout, path, found)


def _check_skipped(layout: Layout, path: Path, found: int) -> None:
    """Raise DamagedVolumeError where gigabytes would be unpacked before the first value."""
    before = layout.volume * layout.volume_bytes if len(layout.files) == 1 else 0
    skipped = max(layout.offset, 0) + before
    most = MOST_SKIPPED.get(layout.encoding)
    if most is not None and skipped > most + SKIPPED_RATIO * found:
        raise DamagedVolumeError(
            f"{_label(layout, path)}: {skipped} bytes to pass over found in {found} bytes of "
            f"{layout.encoding}; expected values that begin sooner; unpack the file if that is right"
        )


def _label(layout: Layout, path: Path) -> str:
    """Return the input's name, with the data file's where that is another one."""
    return layout.name if path.name == Path(layout.name).name else f"{layout.name} ({path.name})"


@contextmanager
def _opened(layout: Layout, path: Path) -> Iterator[BinaryIO]:
    """Open the data file at what follows the header and the lines to skip."""
    try:
        file = path.open("rb")
    except OSError as error:
        raise VolumeError(
            f"{_label(layout, path)}: cannot be opened ({error.strerror}); check the path"
        ) from error
    with file:
        file.seek(layout.start)
        for _ in range(layout.line_skip):
            if not file.readline(MAX_LINE).endswith(b"\n"):
                raise DamagedVolumeError(
                    f"{_label(layout, path)}: fewer or longer lines found than the {layout.line_skip} to "
                    "skip; "
                    "check the header's line skip"
                )
        yield file


def _start(layout: Layout, file: BinaryIO) -> int:
    """Return where an uncompressed file's values begin."""
    if layout.offset != FROM_END:
        return file.tell() + layout.offset
    return file.seek(0, 2) - _share(layout)


def _mapped(layout: Layout) -> AnyArray | None:
    """Return a read-only view of the file, shape (nz, ny, nx), or None where it would need a change."""
    if (
        layout.encoding != "raw"
        or len(layout.files) != 1
        or layout.components != 1
        or not layout.dtype.isnative
    ):
        return None
    path = layout.files[0]
    with _opened(layout, path) as file:
        start = _start(layout, file) + layout.volume * layout.volume_bytes
        if start % layout.dtype.alignment:
            return None
        mapping = map_file(file)
        if mapping is None:
            return None
    found = len(mapping) - start
    if found < layout.volume_bytes:
        raise _too_short(layout, path, found, layout.volume_bytes)
    values = np.frombuffer(mapping, layout.dtype, math.prod(layout.shape), start)
    return values.reshape(layout.shape[::-1])


def _copied(layout: Layout, progress: Progress) -> AnyArray:
    """Return the values decoded into a new array of native byte order, shape (nz, ny, nx)."""
    values = allocate_values(layout.name, layout.shape, layout.dtype)
    stored = values.view(layout.dtype) if layout.components == 1 else values
    pieces = _pieces(layout, stored)
    for done, stream, path in _streams(layout):
        piece = pieces[done]
        if layout.components == 1:
            _fill(layout, path, stream, piece.data.cast("B"), progress)
        else:
            _fill_component(layout, path, stream, piece, progress)
        if layout.volume == layout.volumes - 1:
            stream.check_end()
        progress.advance((done + 1) / len(pieces))
    if layout.components == 1 and not layout.dtype.isnative:
        values.byteswap(inplace=True)
    return values


def _pieces(layout: Layout, stored: AnyArray) -> list[AnyArray]:
    """Return the part of the array that each file of the chosen volume fills, flat, in order."""
    count = len(_files_of_volume(layout))
    flat = stored.reshape(-1)
    if flat.size % count:
        raise DamagedVolumeError(f"{layout.name}: {count} data files do not share {flat.size} values evenly")
    return np.split(flat, count)


def _files_of_volume(layout: Layout) -> tuple[Path, ...]:
    """Return the files that hold the chosen volume."""
    if len(layout.files) == 1:
        return layout.files
    if len(layout.files) % layout.volumes:
        raise DamagedVolumeError(
            f"{layout.name}: {len(layout.files)} data files found for {layout.volumes} volumes; "
            "expected the same number of files for each"
        )
    count = len(layout.files) // layout.volumes
    return layout.files[layout.volume * count : (layout.volume + 1) * count]


def _streams(layout: Layout) -> Iterator[tuple[int, DecodedStream, Path]]:
    """Yield the number, the stream, at its first value, and the path of each file of the chosen volume."""
    for number, path in enumerate(_files_of_volume(layout)):
        with _opened(layout, path) as file:
            skip = layout.offset
            if skip == FROM_END and layout.encoding != "raw":
                raise DamagedVolumeError(
                    f"{layout.name}: byte skip -1 found with encoding {layout.encoding}; expected raw"
                )
            if layout.encoding == "raw":
                file.seek(_start(layout, file))
                skip = 0
            if len(layout.files) == 1:
                skip += layout.volume * layout.volume_bytes
            stream = DecodedStream(_label(layout, path), file, layout.encoding, layout.dtype)
            found = stream.skip(skip)
            if found < skip:
                raise _too_short(layout, path, found - skip, layout.volume_bytes)
            yield number, stream, path


def _fill(layout: Layout, path: Path, stream: DecodedStream, target: memoryview, progress: Progress) -> None:
    """Fill `target` from the stream, telling the progress now and then."""
    for begin in range(0, len(target), TOLD_BYTES):
        part = target[begin : begin + TOLD_BYTES]
        found = stream.fill(part)
        if found < len(part):
            raise _too_short(layout, path, begin + found, len(target))
        if len(layout.files) == 1:
            progress.advance((begin + len(part)) / len(target))


def _fill_component(
    layout: Layout,
    path: Path,
    stream: DecodedStream,
    target: AnyArray,
    progress: Progress,
) -> None:
    """Fill the flat `target` with one of several values a node."""
    staging = np.empty(NODES_AT_ONCE * layout.components, layout.dtype)
    for begin in range(0, target.size, NODES_AT_ONCE):
        count = min(NODES_AT_ONCE, target.size - begin)
        part = staging[: count * layout.components].data.cast("B")
        found = stream.fill(part)
        if found < len(part):
            raise _too_short(
                layout, path, begin * layout.components * layout.dtype.itemsize + found, layout.volume_bytes
            )
        target[begin : begin + count] = staging[
            layout.component : count * layout.components : layout.components
        ]
        if len(layout.files) == 1:
            progress.advance((begin + count) / target.size)


def _too_short(layout: Layout, path: Path, found: int, expected: int) -> DamagedVolumeError:
    return DamagedVolumeError(
        f"{_label(layout, path)}: {max(found, 0)} bytes of values found, {expected} expected for "
        f"{' x '.join(str(n) for n in layout.shape)} values of {layout.dtype.name}; "
        "the file is cut short or its header is damaged; get the file again"
    )
