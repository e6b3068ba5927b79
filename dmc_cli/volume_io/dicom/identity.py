"""Tell slices taken together that are not of one patient and study, or not all of what their file names."""

from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.missing import doubts_told

_OWNERS = {0x00100020: "patients (0010,0020)", 0x0020000D: "studies (0020,000D)"}


def identity_told(chosen: list[Frame], frames: list[Frame], settings: ReadSettings) -> list[Notice]:
    """Return notices on whose the slices of a volume are, and on which of them are missing.

    Args:
        chosen: The slices.
        frames: All frames of the input, for an object in parts may hold several volumes.
        settings: How to read.
    """
    return [
        *_owners_told(chosen),
        *_parts_told(chosen, frames),
        *doubts_told(_counts(chosen, frames), settings),
    ]


def _owners_told(chosen: list[Frame]) -> list[Notice]:
    """Return notices on slices of several patients or studies; who they are is not told."""
    told = []
    for tag, what in _OWNERS.items():
        count = len({elements.text(frame.header.dataset, tag) for frame in chosen} - {""})
        if count > 1:
            sentence = f"slices of {count} {what} found in one series; they are taken as one volume"
            told.append(Notice("W-IDENTITY-CONTRADICTED", sentence))
    return told


def _parts_told(chosen: list[Frame], frames: list[Frame]) -> list[Notice]:
    """Return notices on files that are not there of an object in several files (a concatenation)."""
    own = {elements.text(frame.header.dataset, 0x00209161) for frame in chosen} - {""}
    told = []
    for uid in sorted(own):
        headers = {id(frame.header): frame.header.dataset for frame in frames}.values()
        parts = [dataset for dataset in headers if elements.text(dataset, 0x00209161) == uid]
        found = {elements.integer(dataset, 0x00209162, 0) or 0 for dataset in parts}
        total = max([*found, *(elements.integer(dataset, 0x00209163, 0) or 0 for dataset in parts)])
        if missing := total - len(found - {0}):
            sentence = (
                f"{missing} of the {total} files of one object (its concatenation) are not there; slices are "
                "missing; get all of them"
            )
            told.append(Notice("W-FILE-DAMAGED", sentence))
    return told


def _counts(chosen: list[Frame], frames: list[Frame]) -> list[str]:
    """Return sentences on numbers of slices, of the volume or of its acquisition, that are not all there."""
    dataset = chosen[0].header.dataset
    series = elements.text(dataset, 0x0020000E)
    own = sum(elements.text(frame.header.dataset, 0x0020000E) == series for frame in frames)
    slices = elements.integer(dataset, 0x00540081, 0) or 0
    counted = elements.text(dataset, 0x00201002)
    images = int(counted) if counted.isdecimal() else 0
    told = []
    if slices > len(chosen):
        told.append(f"NumberOfSlices is {slices}, but {len(chosen)} found: others may be missing")
    if images > own:
        told.append(f"ImagesInAcquisition is {images}, but {own} found: slices may be missing")
    return told
