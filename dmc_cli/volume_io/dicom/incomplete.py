"""Tell DICOM files that never had pixel data, as plans and reports, from images that were cut short."""

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.deflated import DeflatedFile
from dmc_cli.volume_io.dicom.elements import Header


def check_pixels_expected(header: Header) -> None:
    """Tell a file that has no pixel data and should have some.

    Raises:
        DamagedVolumeError: It is an image, or it ends before it tells what it is.
    """
    kind = _sop_class(header)
    if _names_image(kind) if kind else _begins_as_dicom(header):
        raise DamagedVolumeError(
            f"{header.file.name}: the file ends before its pixel data; get the file again"
        )


def _sop_class(header: Header) -> str:
    """Return what the file is, as a UID; empty where the data set does not begin."""
    dataset = header.dataset
    if len(dataset) == 0:
        # the UID in the meta elements may be cut, too
        return ""
    meta = getattr(dataset, "file_meta", None)
    return elements.text(meta, 0x00020002) or elements.text(dataset, 0x00080016)


def _names_image(sop_class: str) -> bool:
    from pydicom.config import IGNORE
    from pydicom.uid import UID

    return "Image Storage" in UID(sop_class, IGNORE).name


def _begins_as_dicom(header: Header) -> bool:
    """Return whether a file is certainly DICOM: by its preamble, or by telling a series."""
    is_marked = isinstance(header.file, DeflatedFile) or getattr(header.dataset, "preamble", None)
    return bool(is_marked) or bool(elements.text(header.dataset, 0x0020000E))
