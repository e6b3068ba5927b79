"""Read DICOM: a folder tree, a zip of one, or a file with many frames, to one volume; world axes LPS.

Steps: find the files, read their headers, turn them into frames, the frames into stacks, choose one,
lay out its slices, read their values.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, VolumeError
from dmc_cli.notices import Notice, notices
from dmc_cli.progress import SILENT, Progress
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import Volume, VolumeEntry, check_affine, check_shape
from dmc_cli.volume_io.dicom.directory import missing_told
from dmc_cli.volume_io.dicom.frames import Frame, read_frames
from dmc_cli.volume_io.dicom.geometry import slice_geometry
from dmc_cli.volume_io.dicom.header import read_header
from dmc_cli.volume_io.dicom.identity import identity_told
from dmc_cli.volume_io.dicom.mixed import mixed_told
from dmc_cli.volume_io.dicom.order import check_order, order_told, ordered_frames
from dmc_cli.volume_io.dicom.packed_slices import plain_slices
from dmc_cli.volume_io.dicom.philips import scale_told
from dmc_cli.volume_io.dicom.pixels import read_slices
from dmc_cli.volume_io.dicom.place import NoSlice
from dmc_cli.volume_io.dicom.segment_table import segment_table
from dmc_cli.volume_io.dicom.series import choose_stack, no_volume, put_aside, stacks_of
from dmc_cli.volume_io.dicom.source import DicomFile, dicom_files
from dmc_cli.volume_io.dicom.stack import Stack
from dmc_cli.volume_io.dicom.storage import MAX_FRAMES
from dmc_cli.volume_io.layout import without_effect
from dmc_cli.volume_io.left_out import MOST_NAMED, shortened


def dicom_volume(path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT) -> Volume:
    """Return the volume of the series `settings.series`, or of the only one.

    Raises:
        VolumeError: No slices of a volume; its subclasses tell of damaged or unsupported ones.
        AmbiguousVolumeError: Several series, duplicates or missing slices.
        SettingsError: No series of that number or UID.
        MemoryBudgetError: The values do not fit into the memory that is free.
    """
    check_order(settings, name)
    with _files(path, name, settings) as (files, notes):
        return _volume(_found(files, notes, name, settings, progress), name, settings, progress)


def dicom_entries(path: Path, name: str, settings: ReadSettings) -> list[VolumeEntry]:
    """Return every volume that `--series` can choose, in the order of their numbers.

    Raises:
        VolumeError: There is none.
    """
    check_order(settings, name)
    with _files(path, name, settings) as (files, notes):
        return _found(files, notes, name, settings, SILENT).entries()


def dicom_survey(
    path: Path, name: str, settings: ReadSettings, progress: Progress = SILENT
) -> tuple[list[VolumeEntry], Volume | None]:
    """Return what `dicom_entries` does, and the volume where no choice of a series is left.

    Raises:
        VolumeError: As `dicom_volume`.
    """
    check_order(settings, name)
    with _files(path, name, settings) as (files, notes):
        found = _found(files, notes, name, settings, progress)
        entries = found.entries()
        if len(entries) > 1 and settings.series is None:
            return entries, None
        return entries, _volume(found, name, settings, progress)


@contextmanager
def _files(path: Path, name: str, settings: ReadSettings) -> Iterator[tuple[list[DicomFile], list[str]]]:
    """Give the files of an input, unpacked where they are packed one by one, and what was left out."""
    with (
        dicom_files(path, name, settings.allow_outside) as (files, notes),
        plain_slices(files, name) as (plain, damaged),
    ):
        yield plain, [*notes, *damaged]


def _volume(found: "_Found", name: str, settings: ReadSettings, progress: Progress) -> Volume:
    """Return the volume that is chosen of what was found, its files still there."""
    stack = choose_stack(found.stacks, settings.series, settings.volume_index, name)
    aside = put_aside(found.frames, found.stacks, stack, settings.series)
    try:
        geometry = slice_geometry(stack, settings, name)
    except AmbiguousVolumeError as error:
        # one of those that were left out may be the slice that is missing
        raise AmbiguousVolumeError("; ".join([str(error), *found.files_told(), *aside])) from error
    columns, rows = geometry.frames[0].pixels.shape
    check_shape(name, (columns, rows, len(geometry.frames)))
    check_affine(name, geometry.affine)
    with progress.stage("reading slices"):
        slices = read_slices(geometry.frames, settings.threads, name, progress)
    is_in_patient = all(frame.is_placed and frame.is_in_patient for frame in geometry.frames)
    return Volume(
        values=slices.values,
        affine=geometry.affine,
        space="LPS" if is_in_patient else "none",
        slope=slices.slope,
        intercept=slices.intercept,
        padding=slices.padding,
        slice_positions=geometry.slice_positions,
        path=name,
        files=tuple(dict.fromkeys(frame.header.file.path for frame in geometry.frames)),
        format="dicom",
        modality=stack.modality,
        value_unit=_value_unit(geometry.frames),
        warnings=(
            *notices("W-FILE-DAMAGED", found.warnings()),
            *notices("W-FILES-LEFT-OUT", aside),
            *geometry.warnings,
            *identity_told(geometry.frames, found.frames, settings),
            *order_told(geometry.frames, settings),
            *_spacing_told(geometry.frames, settings),
            *notices("W-RESCALE-UNKNOWN", _scale_told(geometry.frames)),
            *mixed_told(geometry.frames),
            *_remarks(geometry.frames),
            *scale_told(geometry.frames),
            *slices.warnings,
        ),
        labels=segment_table(found.stacks, stack),
    )


def _value_unit(frames: list[Frame]) -> str:
    """Return what all slices say that their values are measured in, empty where they differ or do not say."""
    kinds = {frame.kind_of_values for frame in frames if not frame.is_blank}
    (kind,) = kinds if len(kinds) == 1 else ("US",)
    return "" if kind == "US" else kind


def _scale_told(frames: list[Frame]) -> list[str]:
    """Return a sentence on slopes of 0, if there are any."""
    found = [frame.name for frame in frames if frame.lacks_scale]
    if not found:
        return []
    return [
        f"RescaleSlope 0 found in {len(found)} of {len(frames)} slices, first {found[0]}, where it should be "
        "another number; their stored values are read with slope 1"
    ]


def _remarks(frames: list[Frame]) -> list[Notice]:
    """Return each different remark on slices once, with how many it is on."""
    found: dict[Notice, list[str]] = {}
    for frame in frames:
        for remark in frame.remarks:
            found.setdefault(remark, []).append(frame.name)
    return [
        Notice(remark.code, f"{remark.sentence} ({len(names)} of {len(frames)} slices, first {names[0]})")
        for remark, names in found.items()
    ]


def _spacing_told(frames: list[Frame], settings: ReadSettings) -> tuple[Notice, ...]:
    """Return a notice on a spacing that was given for slices that tell their own."""
    is_used = any(not (frame.is_placed and frame.stated_spacing) for frame in frames)
    return () if is_used else without_effect("spacing", settings)


@dataclass(frozen=True)
class _Found:
    """What an input holds.

    Attributes:
        stacks: The stacks, one at least.
        frames: All frames, in a stack or not.
        notes: Sentences on what was left out before it was looked at.
        damaged: What is wrong with each damaged file.
        reasons: Why other DICOM files have no frames.
    """

    stacks: list[Stack]
    frames: list[Frame]
    notes: list[str]
    damaged: list[str]
    reasons: list[str]

    def entries(self) -> list[VolumeEntry]:
        """Return the stacks as `--series` numbers them."""
        return [stack.entry(number) for number, stack in enumerate(self.stacks, 1)]

    def warnings(self) -> list[str]:
        """Return the sentences on what was left out and should not have been."""
        notes = [*self.notes, *(f"a file was left out: {told}" for told in self.damaged[:MOST_NAMED])]
        more = len(self.damaged) - MOST_NAMED
        if more > 0:
            notes.append(f"and {more} more damaged {'file was' if more == 1 else 'files were'} left out")
        return notes

    def files_told(self) -> list[str]:
        """Return a sentence on all files that have no frames, if there are any."""
        files = [*self.damaged, *self.reasons]
        told = [f"{len(files)} file(s) left out: {shortened(files, '; ')}"] if files else []
        return [*self.notes, *told]


def _found(
    files: list[DicomFile], notes: list[str], name: str, settings: ReadSettings, progress: Progress
) -> _Found:
    """Look at every file of an input; `notes` are sentences on what is none of them.

    Raises:
        VolumeError: There is no stack.
    """
    frames: list[Frame] = []
    reasons: list[str] = []
    damaged: list[VolumeError] = []
    notes = list(notes)
    with progress.stage("scanning"):
        for number, file in enumerate(files):
            try:
                header = read_header(file)
                if header is not None:
                    notes += missing_told(header, files)
                    frames += read_frames(header, settings)
                    if len(frames) > MAX_FRAMES + len(files):
                        raise VolumeError(
                            f"{name}: more than {MAX_FRAMES} frames found; expected a series; give it alone"
                        )
            except NoSlice as reason:
                reasons.append(f"{file.name}: {reason}")
            except DamagedVolumeError as error:
                told = str(error)
                damaged.append(
                    error if told.startswith(file.name) else DamagedVolumeError(f"{file.name}: {told}")
                )
            progress.advance((number + 1) / len(files))
    if settings.slice_order != "position":
        frames = ordered_frames(frames, settings, name)
    stacks = stacks_of(frames)
    if not stacks:
        raise damaged[0] if damaged else no_volume(name, [*notes, *reasons], len(frames))
    return _Found(stacks, frames, notes, [str(error) for error in damaged], reasons)
