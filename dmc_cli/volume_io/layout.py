"""Describe where a volume's values lie in its files, and what they mean.

A format's reader turns a header into a `Layout` and touches no values; `values.py` loads the values of
any layout. So sizes are checked against files in one place, before anything is allocated.
"""

import math
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    VolumeError,
)
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Label, Space, VolumeEntry

Triple = tuple[float, float, float]

Encoding = Literal["raw", "gzip", "bzip2", "xz", "zstd", "text", "hex"]
"""How bytes are stored: as they are; a gzip or zlib stream; bzip2, xz, zstd; decimal text; hexadecimals."""

FROM_END = -1
"""As `Layout.offset`: the values are the last bytes of the file, whatever stands before them."""

ZARR_MARKERS = ("zarr.json", ".zarray", ".zgroup")
"""A folder with one of these files is a Zarr array or group."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """A volume whose values are still in its files.

    Attributes:
        name: The input as the user named it, for messages.
        shape: Nodes along x, y, z; x is the fastest in the files.
        dtype: Type of a stored value, with its byte order.
        affine: Shape (4, 4), float64: node index (i, j, k, 1) to millimetres in `space`.
        space: The world's axes.
        files: Files that hold the values, in order; each holds an equal share.
        start: Bytes of a header in front of everything, counted before decoding.
        line_skip: Lines to skip after that, counted before decoding.
        offset: Bytes to skip after that, counted after decoding; `FROM_END`: see there.
        encoding: How the values are stored.
        components: Values a node, stored beside each other; `component` is the one to read.
        between: Values between two rows and between two slices, of which there are that many times as many as
            `shape` says; `picked` are the rows and slices to read.
        volumes: Volumes one after the other; `volume` is the one to read.
        slope: Physical value a stored unit.
        intercept: Physical value of stored 0.
        format: The reader's name.
        headers: Files beside `files` that were read.
        listed: Where there are several volumes to choose from: what each of them is, in order.
        warnings: What the user is told.
        labels: What the file calls the labels of a label map.
    """

    name: str
    shape: tuple[int, int, int]
    dtype: np.dtype[Any]
    affine: Float64Array
    space: Space
    files: tuple[Path, ...]
    format: str
    start: int = 0
    offset: int = 0
    line_skip: int = 0
    encoding: Encoding = "raw"
    components: int = 1
    component: int = 0
    between: tuple[int, int] = (1, 1)
    picked: tuple[int, int] = (0, 0)
    volumes: int = 1
    volume: int = 0
    slope: float = 1.0
    intercept: float = 0.0
    headers: tuple[Path, ...] = ()
    listed: tuple[str, ...] = ()
    warnings: tuple[Notice, ...] = ()
    labels: tuple[Label, ...] = ()

    @property
    def count(self) -> int:
        """Return how many volumes there are to choose from."""
        return self.components * math.prod(self.between) * self.volumes

    @property
    def volume_bytes(self) -> int:
        """Return the bytes of one volume with its components and what lies between rows and slices."""
        stored = math.prod(self.shape) * math.prod(self.between)
        return stored * self.components * self.dtype.itemsize


def exists(path: Path) -> bool:
    """Return whether there is something at a path; False for one that the system does not even take."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def check_file(path: Path, name: str) -> int:
    """Return the size in bytes of a regular, readable, non-empty file.

    Raises:
        VolumeError: There is no such file, it cannot be read, or it is no regular file.
        DamagedVolumeError: It is empty.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise VolumeError(f"{name}: cannot be opened ({reason}); check the path") from error
    if not stat.S_ISREG(status.st_mode):
        raise VolumeError(
            f"{name}: found something that is not a regular file; expected a file with a volume"
        )
    if not os.access(path, os.R_OK):
        raise VolumeError(f"{name}: no permission to read it; check the file's access rights")
    if status.st_size == 0:
        raise DamagedVolumeError(f"{name}: the file is empty; expected a volume; get the file again")
    return status.st_size


def check_lengths(name: str, spacing: Triple) -> None:
    """Raise DamagedVolumeError unless three distances that a file gives are positive and finite."""
    if not all(math.isfinite(length) and length > 0 for length in spacing):
        raise DamagedVolumeError(
            f"{name}: distances of {' x '.join(f'{length:g}' for length in spacing)} mm between the nodes "
            "found; expected positive lengths; its metadata are damaged; correct them"
        )


def file_entry(
    format_name: str, count: int, shape: tuple[int, int, int], listed: tuple[str, ...] = ()
) -> VolumeEntry:
    """Return what `dmc info` lists of a file with one or several volumes of a shape."""
    several = f", {count} volumes (--volume-index 0 to {count - 1})" if count > 1 else ""
    return VolumeEntry(description=format_name + several, size=shape, volumes=listed)


def chosen_index(
    name: str, count: int, volume_index: int | None, what: str = "volumes", told: str = "", options: str = ""
) -> int:
    """Return which of `count` volumes to read.

    `told` is what a message says of them, `options` those that choose one, too.

    Raises:
        DamagedVolumeError: There is none.
        AmbiguousVolumeError: There are several and none was chosen.
        SettingsError: The chosen one does not exist.
    """
    if count < 1:
        raise DamagedVolumeError(f"{name}: {count} {what} found; expected one or some; get the file again")
    if volume_index is None:
        if count == 1:
            return 0
        others = f"{options}, or with " if options else ""
        raise AmbiguousVolumeError(
            f"{name}: {count} {what} found{told}; expected one; choose with {others}--volume-index N, "
            f"N from 0 to {count - 1}"
        )
    if not 0 <= volume_index < count:
        held = "1 volume" if count == 1 else f"{count} {what}"
        raise SettingsError(
            f"volume_index is {volume_index}; {name} holds {held}; expected {index_range(count)} "
            "(--volume-index)"
        )
    return volume_index


def index_range(count: int) -> str:
    """Return the numbers of so many volumes in words."""
    return "0, or none" if count == 1 else f"0 to {count - 1}"


def chosen_spacing(
    told: Triple | None,
    settings: ReadSettings,
    what: str = "the file",
    doubts: tuple[Notice, ...] = (),
) -> tuple[Triple, tuple[Notice, ...]]:
    """Return the spacing in millimetres, and warnings: what the header told, else the settings', else 1.

    `doubts` are what is told of the header's lengths; the settings' spacing counts then (see `respaced`).
    """
    if told is not None and not doubts:
        return told, without_effect("spacing", settings, what)
    if told is not None:
        return told, () if settings.spacing is not None else doubts
    if settings.spacing is not None:
        return settings.spacing, ()
    sentence = f"{what} tells no spacing; 1 mm is taken; --spacing gives it"
    return (1.0, 1.0, 1.0), (Notice("W-SPACING-MISSING", sentence),)


def chosen_origin(
    told: Triple | None, settings: ReadSettings, what: str = "the file"
) -> tuple[Triple, tuple[Notice, ...]]:
    """Return the origin in millimetres, and warnings: what the header told, else the settings', else 0."""
    if told is not None:
        return told, without_effect("origin", settings, what)
    return settings.origin or (0.0, 0.0, 0.0), ()


def without_effect(option: str, settings: ReadSettings, what: str = "the file") -> tuple[Notice, ...]:
    """Return a warning where an option was given for what the file tells itself."""
    if getattr(settings, option) is None:
        return ()
    return (Notice("W-OPTION-UNUSED", f"--{option} has no effect: {what} tells its own"),)


def scale_affine(spacing: Triple, origin: Triple) -> Float64Array:
    """Return the affine, shape (4, 4), of a grid along the world's axes; lengths in millimetres."""
    affine = np.diag([*spacing, 1.0]).astype(np.float64)
    affine[:3, 3] = origin
    return affine
