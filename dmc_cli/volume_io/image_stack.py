"""Put a volume together from a folder of images, a slice each, of whatever kind.

The slices are those of one name and kind, in the order of the numbers in their names; what else lies in the
folder is named. Distances are settled in `stack_spacing.py`; space none.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, VolumeError
from dmc_cli.notices import Notice
from dmc_cli.progress import Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, allocate_values, check_shape, storable_type, widened_type
from dmc_cli.volume_io.layout import check_file, chosen_origin, scale_affine
from dmc_cli.volume_io.left_out import left_out, shortened
from dmc_cli.volume_io.scanner_log import log_texts, read_logs
from dmc_cli.volume_io.slice_names import Slices, missing_numbers, ordered_slices
from dmc_cli.volume_io.stack_spacing import stack_spacing
from dmc_cli.volume_io.told_lengths import ToldLengths
from dmc_cli.volume_io.within import REMEDY, Bounds


@dataclass(frozen=True)
class Plane:
    """An image whose values are not decoded yet.

    Attributes:
        shape: Rows and columns.
        dtype: Type of its values.
        read: Decodes them: an array of that shape.
        notices: What is told of them.
        bits: Those of a pixel, where the type has more of them.
        told: What its file tells of distances.
    """

    shape: tuple[int, int]
    dtype: np.dtype[Any]
    read: Callable[[], AnyArray]
    notices: tuple[Notice, ...] = ()
    bits: int = 0
    told: ToldLengths | None = None

    @property
    def depth(self) -> int:
        """Return the bits of a pixel."""
        return self.bits or 8 * self.dtype.itemsize


@dataclass(frozen=True)
class ImageKind:
    """A kind of images.

    Attributes:
        format_name: The reader's name.
        title: What messages call them, such as `TIFF`.
        suffixes: Those of its files.
        open_plane: Opens a file: takes its path and the input's name.
        largest_ratio: Bytes of values a byte of the files, at most.
    """

    format_name: str
    title: str
    suffixes: tuple[str, ...]
    open_plane: Callable[[Path, str], AbstractContextManager[Plane]]
    largest_ratio: float


def find_slices(folder: Path, name: str, kind: ImageKind, allow_outside: bool) -> tuple[Slices, list[str]]:
    """Return the slices of a folder, and the names of its other files.

    Raises:
        VolumeError: There is none, or one is a link out of the folder.
        AmbiguousVolumeError: The names do not tell which file is which slice.
    """
    visible = sorted(path for path in folder.iterdir() if not path.name.startswith(".") and path.is_file())
    files = [path for path in visible if path.suffix.lower() in kind.suffixes]
    if not files:
        raise VolumeError(f"{name}: no {kind.title} file found; expected a stack of slices; check the path")
    bounds = Bounds(folder, allow_outside=allow_outside)
    for file in files:
        if file.is_symlink() and not bounds.hold(file):
            raise VolumeError(f"{name}: {file.name} is a link out of the folder; {REMEDY}")
    taken = set(files)
    others = [path.name for path in visible if path not in taken]
    return ordered_slices(files, name), others


def stack_volume(
    folder: Path, name: str, settings: ReadSettings, progress: Progress, kind: ImageKind
) -> Volume:
    """Return the volume of a folder of slices.

    Raises:
        VolumeError: There is no slice, or too few.
        UnsupportedFormatError: Images that are not grey.
        DamagedVolumeError: A file cannot be decoded, or slices differ in size or type.
        AmbiguousVolumeError: Names or numbers leave open which slices belong together; slices are missing.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    slices, others = find_slices(folder, name, kind, settings.allow_outside)
    positions, notices = _gaps(slices, settings, name)
    values, seen, lengths = _filled(slices.files, name, kind, progress)
    rows, columns = values.shape[1:]
    texts = log_texts(folder, others)
    log = read_logs(texts, columns, rows, len(slices.files), _stem(slices.files[0]))
    spacing, told = stack_spacing(lengths, log, slices.step, name, settings, kind.title)
    origin, _ = chosen_origin(None, settings)
    used = {log.file.name} if log is not None else set()
    strays = [*slices.strays, *(other for other in others if other not in used)]
    notices += [*seen, *slices.notices]
    notices += [Notice("W-FILES-LEFT-OUT", sentence) for sentence in left_out(strays, "file", "files")]
    return Volume(
        values=values,
        affine=scale_affine(spacing, origin),
        space="none",
        slice_positions=None if positions is None else positions * spacing[2],
        path=name,
        files=(*slices.files, *(text for text in texts if text.name in used)),
        format=kind.format_name,
        warnings=(*told, *notices),
    )


def _stem(file: Path) -> str:
    """Return what comes before a slice's number, in small letters."""
    return file.stem.lower().rstrip("0123456789")


def _gaps(slices: Slices, settings: ReadSettings, name: str) -> tuple[AnyArray | None, list[Notice]]:
    """Return where slices lie whose numbers have gaps, in steps from the first, or None where they have none.

    Raises:
        AmbiguousVolumeError: Numbers are missing, and the settings do not keep the gaps.
    """
    missing = missing_numbers(slices)
    steps = np.diff(slices.numbers)
    if not len(steps) or (steps == slices.step).all():
        return None, []
    told = f"numbers {shortened(list(map(str, missing)), ', ')}" if missing else "numbers of uneven steps"
    if settings.slice_gaps != "keep":
        raise AmbiguousVolumeError(
            f"{name}: {told} missing between {slices.files[0].name} and {slices.files[-1].name}; expected "
            f"numbers that go by {slices.step}; add the slices, or span the gaps with --slice-gaps keep"
        )
    positions = (np.array(slices.numbers, np.float64) - slices.numbers[0]) / slices.step
    return positions, [Notice("W-SLICES-MISSING", f"{told} missing; the gaps are spanned")]


def _filled(
    files: tuple[Path, ...], name: str, kind: ImageKind, progress: Progress
) -> tuple[AnyArray, list[Notice], dict[ToldLengths, str]]:
    """Return the values of all slices, shape (nz, ny, nx), what is told of them and of lengths, each once.

    Raises:
        DamagedVolumeError: Slices of different sizes or types, or more values than the files can hold.
    """
    size = sum(check_file(file, f"{name} ({file.name})") for file in files)
    values: AnyArray | None = None
    seen: dict[Notice, None] = {}
    lengths: dict[ToldLengths, str] = {}
    depth = 0
    for k, file in enumerate(files):
        with kind.open_plane(file, name) as plane:
            values = _held(values, plane, files, name, kind, size)
            depth = depth or plane.depth
            _check_alike(plane, values, depth, file, files[0], name)
            values[k] = plane.read()
            seen.update(dict.fromkeys(plane.notices))
            if plane.told is not None:
                lengths.setdefault(plane.told, file.name)
        progress.advance((k + 1) / len(files))
    assert values is not None
    return values, list(seen), lengths


def _held(
    values: AnyArray | None, plane: Plane, files: tuple[Path, ...], name: str, kind: ImageKind, size: int
) -> AnyArray:
    """Return the array of all slices, made when the first one is known.

    Raises:
        DamagedVolumeError: Files of `size` bytes in all cannot hold it.
    """
    if values is not None:
        return values
    rows, columns = plane.shape
    dtype = widened_type(plane.dtype).newbyteorder("=")
    storable_type(name, dtype)
    check_shape(name, (columns, rows, len(files)))
    if len(files) * rows * columns * plane.dtype.itemsize > kind.largest_ratio * size:
        raise DamagedVolumeError(
            f"{name}: {size} bytes found for {len(files)} slices of {columns} x {rows} pixels; get the files "
            "again"
        )
    return allocate_values(name, (columns, rows, len(files)), dtype)


def _check_alike(plane: Plane, values: AnyArray, depth: int, file: Path, first: Path, name: str) -> None:
    """Raise DamagedVolumeError for a slice of another size, type or number of bits than the first one."""
    if plane.shape != values.shape[1:] or widened_type(plane.dtype).newbyteorder("=") != values.dtype:
        raise DamagedVolumeError(
            f"{name}: {file.name}: {plane.shape} pixels of {plane.dtype} found; expected "
            f"{values.shape[1:]} of {values.dtype} as in {first.name}; put what is no slice elsewhere"
        )
    if plane.depth != depth:
        raise DamagedVolumeError(
            f"{name}: {file.name} has {plane.depth} bits a pixel, {first.name} has {depth}; expected the "
            "same of all, for their values mean something else; convert them to one depth"
        )
