"""Find what a DICOMDIR lists and the file set does not hold: slices that were not copied."""

from pathlib import PurePosixPath

from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.source import DicomFile
from dmc_cli.volume_io.left_out import shortened

DIRECTORY = "1.2.840.10008.1.3.10"
MOST_RECORDS = 1 << 18


def missing_told(header: Header, files: list[DicomFile]) -> list[str]:
    """Return a sentence on files that a DICOMDIR lists and that are not there; none of any other file.

    Raises:
        DamagedVolumeError: Its records cannot be read.
    """
    meta = getattr(header.dataset, "file_meta", None)
    if meta is None or elements.text(meta, 0x00020002) != DIRECTORY:
        return []
    folder = PurePosixPath(header.file.name).parent
    there = {_plain(PurePosixPath(file.name)) for file in files}
    missing = []
    for record in elements.items(header.dataset, 0x00041220, MOST_RECORDS):
        parts = elements.texts(record, 0x00041500)
        if parts and _plain(folder.joinpath(*parts)) not in there:
            missing.append("/".join(parts))
    if not missing:
        return []
    told = f"{header.file.name} lists {len(missing)} file(s) that are not there: {shortened(missing, ', ')}"
    return [f"{told}; slices may be missing; copy the whole file set"]


def _plain(name: PurePosixPath) -> str:
    """Return a name as a DICOMDIR has it: media keep no lower case, and some append a version."""
    return str(name).upper().partition(";")[0].rstrip(".")
