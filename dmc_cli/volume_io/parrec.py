"""Read Philips' pairs of .PAR and .REC, versions 4 to 4.2; world axes RAS.

The header is nibabel's, and so is the affine, which is that of the whole scan; a volume whose slices tell to
lie elsewhere is refused. Physical values are those that the console displays: slope and intercept of a slice
are its own.
"""

import math
import warnings
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, Float64Array, IntArray
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, check_affine, check_shape
from dmc_cli.volume_io.axes import chosen_volume, flat_index, listed_volumes
from dmc_cli.volume_io.content import first_bytes
from dmc_cli.volume_io.layout import check_file, file_entry
from dmc_cli.volume_io.packed import plain_file
from dmc_cli.volume_io.pair import checked_pair
from dmc_cli.volume_io.parrec_axes import parrec_image
from dmc_cli.volume_io.slices import stack_slices

LARGEST_HEADER = 1 << 26
LONGEST_LINE = 500
"""Of the scan's own fields: nibabel's pattern for them takes the third power of a line's length."""

MOST_STEPS = 1 << 30
"""Lines of slices times volumes: nibabel looks through all slices for each volume."""

LABELS = (
    "image_type_mr",
    "dynamic scan number",
    "label type",
    "diffusion b value number",
    "gradient orientation number",
    "cardiac phase number",
    "echo number",
    "scanning sequence",
)
"""What all slices of a volume share, as far as the version has it."""


def parrec_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of a pair that the settings choose.

    Raises:
        VolumeError: One of the two files is not there.
        UnsupportedFormatError: Slices that are no one volume.
        DamagedVolumeError: The header cannot be understood, or the values are fewer than it promises.
        AmbiguousVolumeError: Several volumes, and none chosen.
        SettingsError: The chosen one does not exist.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    header_path, data_path = checked_pair(path, name, settings.allow_outside)
    header = _header(header_path, name)
    shape = _grid(header, name)
    order = header.get_sorted_slice_indices()
    image = parrec_image(header.image_defs[order[:: shape[2]]], shape)
    index = flat_index(image, chosen_volume([image], settings, name))
    order = order[index * shape[2] : (index + 1) * shape[2]]
    slices = header.image_defs[order]
    with np.errstate(all="ignore"):  # what is not finite is refused
        affine = header.get_affine()
        check_affine(name, affine)
        _check_slices(slices, shape, affine, name)
    records = _records(header.image_defs, name)[order]
    scales = _scales(slices, name)
    dtype = header.get_data_dtype()
    size = len(header.image_defs) * shape[0] * shape[1] * dtype.itemsize
    check_file(data_path, name if data_path == path else f"{name} ({data_path.name})")
    with plain_file(data_path, name, size) as plain:
        found = plain.stat().st_size
        if found < size:
            raise DamagedVolumeError(
                f"{name}: {found} bytes found in {data_path.name}, {size} expected for "
                f"{len(header.image_defs)} slices of {shape[0]} x {shape[1]} values; the file is cut short; "
                "get it again"
            )
        planes = _planes(plain, records.tolist(), np.empty((1, shape[1], shape[0]), dtype), name)
        values, slope, intercept = stack_slices(name, shape, dtype, scales, planes, progress)
    return Volume(
        values=values,
        affine=affine,
        space="RAS",
        slope=slope,
        intercept=intercept,
        path=name,
        files=(header_path, data_path),
        format="parrec",
    )


def parrec_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return the volumes of a pair as one entry.

    Raises:
        VolumeError: As `parrec_volume`.
    """
    header_path, _ = checked_pair(path, name, settings.allow_outside)
    header = _header(header_path, name)
    shape = _grid(header, name)
    image = parrec_image(header.image_defs[header.get_sorted_slice_indices()[:: shape[2]]], shape)
    listed = listed_volumes([image], settings, name)
    count = len(listed) if settings.time is not None else math.prod(image.axes[n].size for n in image.others)
    return [file_entry("parrec", count, shape, listed if count > 1 else ())]


def _header(path: Path, name: str) -> Any:
    """Return the header of nibabel's class, volumes in the order of their labels.

    Raises:
        DamagedVolumeError: It cannot be understood.
    """
    from nibabel.parrec import PARRECHeader, parse_PAR_header

    size = check_file(path, name)
    if size > LARGEST_HEADER:
        raise DamagedVolumeError(
            f"{name}: {size} bytes of {path.name} found; expected a header of at most {LARGEST_HEADER}"
        )
    file = StringIO(first_bytes(path, name, LARGEST_HEADER).decode("latin-1"), newline=None)
    try:
        if any(len(line) > LONGEST_LINE and line.lstrip().startswith(".") for line in file):
            raise ValueError(f"a line of more than {LONGEST_LINE} characters")
        file.seek(0)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # what matters of it is looked at here
            info, slices = parse_PAR_header(file)
            most = max(np.unique(slices["slice number"], return_counts=True)[1])
            if not 1 <= info["max_slices"] <= len(slices) or most * len(slices) > MOST_STEPS:
                raise ValueError(f"{info['max_slices']} slices in {len(slices)} lines of them")
            header = PARRECHeader(info, slices, strict_sort=True)
            header.get_affine()
    except Exception as error:
        # nibabel raises whatever its parsing runs into: a version that it does not know is a KeyError
        told = " ".join(str(error).split())[:200]
        raise DamagedVolumeError(
            f"{name}: {path.name} is no PAR header that can be understood ({type(error).__name__}: {told}); "
            "expected version 4, 4.1 or 4.2, all slices there and of one orientation; export the scan anew, "
            "or as DICOM"
        ) from error
    return header


def _grid(header: Any, name: str) -> tuple[int, int, int]:
    """Return the nodes along x, y, z."""
    nx, ny, nz = (int(n) for n in header.get_data_shape()[:3])
    if min(nx, ny) < 1:
        raise DamagedVolumeError(f"{name}: slices of {nx} x {ny} values found; expected positive numbers")
    check_shape(name, (nx, ny, nz))
    return nx, ny, nz


def _check_slices(slices: Any, shape: tuple[int, int, int], affine: Float64Array, name: str) -> None:
    """Refuse slices that differ in a label, or lie where the affine does not put them."""
    for label in LABELS:
        if label in slices.dtype.names and len(found := np.unique(slices[label])) > 1:
            raise UnsupportedFormatError(
                f"{name}: slices with the {label} {found[0]} and {found[1]} found in one volume; expected "
                "one; export the scan anew, or as DICOM"
            )
    k = np.arange(shape[2])
    middle = np.column_stack((np.broadcast_to([(n - 1) / 2 for n in shape[:2]], (len(k), 2)), k))
    placed = middle @ affine[:3, :3].T + affine[:3, 3]
    back, up, left = slices["image offcentre"].T
    off = np.linalg.norm(placed - np.column_stack((-left, -back, up)), axis=1)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not off.max() < spacing.min():
        worst = int(np.argmax(off))
        raise UnsupportedFormatError(
            f"{name}: slice {worst} found {off[worst]:.3g} mm from where the header puts the whole scan; "
            "expected slices one after the other at its angulation and off-centre; export the scan as DICOM"
        )


def _records(slices: Any, name: str) -> IntArray:
    """Return for each line of the header the number of its slice in the data file."""
    records: IntArray = slices["index in REC file"]
    if not np.array_equal(np.sort(records), np.arange(len(records))):
        raise DamagedVolumeError(
            f"{name}: slices at {np.unique(records).size} places of the data file found for {len(records)} "
            "lines; expected each slice once; the header is damaged; export the scan anew"
        )
    return records


def _scales(slices: Any, name: str) -> Float64Array:
    """Return slope and intercept of each slice, shape (n, 2)."""
    scales = np.column_stack((slices["rescale slope"], slices["rescale intercept"]))
    if not scales[:, 0].all():
        k = int(np.argmin(scales[:, 0] != 0))
        raise DamagedVolumeError(
            f"{name}: slope 0 and intercept {scales[k, 1]:g} of slice {k} found; expected another "
            "slope; the header is damaged; export the scan anew"
        )
    return scales


def _planes(path: Path, records: list[int], plane: AnyArray, name: str) -> Iterator[AnyArray]:
    """Yield slices of the data file, each in `plane`, shape (1, ny, nx)."""
    with path.open("rb") as file:
        for record in records:
            file.seek(record * plane.nbytes)
            if file.readinto(plane.data.cast("B")) < plane.nbytes:
                raise DamagedVolumeError(f"{name}: {path.name} ends within slice {record}; get it again")
            yield plane
