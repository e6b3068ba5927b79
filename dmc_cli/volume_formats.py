"""Register the formats of volumes that are read: a file or a folder of `volume_io/` each, and an entry here.

Settings, help texts, messages and the README's table are made from this list. Readers are imported when a
file of theirs is read, so that `dmc --help` stays light.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any

_NAMED_AXES = ("channel", "time")
"""Options that choose along axes which a file names."""

_GRID = ("spacing", "origin")
"""Options of formats whose files may tell no spacing, unit or origin; readers warn of those that do."""

_ZIP = b"PK\x03\x04"

ARCHIVES = (".zip", ".tar", ".tgz", ".tbz2", ".txz", ".tzst")
"""Suffixes of archives: of DICOM, or of whatever is found in them."""

_HDF = b"\x89HDF"

_IMAGES = (
    *(b"\x89PNG\r\n", b"\xff\xd8\xff"),
    *(b"\0\0\0\x0cjP  \r\n", b"\xff\x4f\xff\x51"),
)
"""How PNG, JPEG and JPEG 2000 begin."""

_MGH_TYPES = tuple(bytes((0, 0, 0, code)) for code in (0, 1, 3, 4, 10))


def _never(_start: bytes) -> bool:
    return False


@dataclass(frozen=True, kw_only=True)
class VolumeFormat:
    """A format: what its files look like, and where its readers are, as `module:function`.

    Attributes:
        title: Its name, and what of it is read where suffixes do not say so.
        suffixes: Those that mean it; any other file is judged by its content.
        begins: Whether a file with these first bytes, unpacked where they are packed, is one of it.
        may_begin: Whether it is one of it unless it begins like another format.
        options: The fields of `ReadSettings` that its reader looks at, but those that are for all formats.
        unpacks: Whether its reader unpacks a packed file itself, piece by piece into the values.
        layout: Of a format whose header tells where the values lie: returns its `Layout`.
        read: Of any other: puts a volume together from pieces. Such a format comes from standard input only
            if it tells how it begins.
        entries: Beside `read`: lists the volumes that there are.
        survey: Beside both, where each looks at every file: does both, and reads no volume where several
            series leave a choice.
    """

    title: str
    suffixes: tuple[str, ...] = ()
    begins: Callable[[bytes], bool] = _never
    may_begin: Callable[[bytes], bool] = _never
    options: tuple[str, ...] = ()
    unpacks: bool = False
    layout: str = ""
    read: str = ""
    entries: str = ""
    survey: str = ""

    def can_begin(self, start: bytes) -> bool:
        """Return whether a file with these first bytes can be one of the format."""
        return self.begins(start) or self.may_begin(start)


FORMATS: dict[str, VolumeFormat] = {
    "dicom": VolumeFormat(
        title="DICOM (folders, archives, files with many frames)",
        suffixes=(".dcm", ".ima", *ARCHIVES),
        begins=lambda start: (
            start[128:132] == b"DICM" or start.startswith(_ZIP) or start[257:262] == b"ustar"
        ),
        # without its preamble it begins with an element of group 2 or 8
        may_begin=lambda start: start[:2] in (b"\x02\0", b"\x08\0"),
        options=(
            "series",
            "slice_gaps",
            "duplicates",
            "slice_order",
            "volume_index",
            "spacing",
            "allow_outside",
        ),
        read="dicom:dicom_volume",
        entries="dicom:dicom_entries",
        survey="dicom:dicom_survey",
    ),
    "nrrd": VolumeFormat(
        title="NRRD",
        suffixes=(".nrrd", ".nhdr"),
        begins=lambda start: start.startswith(b"NRRD0"),
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        layout="nrrd:nrrd_layout",
    ),
    "nifti": VolumeFormat(
        title="NIfTI",
        suffixes=(".nii", ".nii.gz"),
        begins=lambda start: start[344:347] in (b"n+1", b"ni1") or start[4:7] in (b"n+2", b"ni2"),
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        unpacks=True,
        layout="nifti:nifti_layout",
    ),
    "meta": VolumeFormat(
        title="MetaImage",
        suffixes=(".mha", ".mhd"),
        may_begin=lambda start: b"NDims" in start and b"DimSize" in start,
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        layout="metaimage:metaimage_layout",
    ),
    "analyze": VolumeFormat(
        title="Analyze (.hdr and .img)",
        begins=lambda start: start[:4] in (b"\x5c\x01\0\0", b"\0\0\x01\x5c"),
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        unpacks=True,
        layout="analyze:analyze_layout",
    ),
    "mgh": VolumeFormat(
        title="FreeSurfer MGH",
        suffixes=(".mgh", ".mgz", ".mgh.gz"),
        begins=lambda start: (
            start[:4] == b"\0\0\0\1" and start[20:24] in _MGH_TYPES and start[28:29] == b"\0"
        ),
        options=(*_NAMED_AXES, "volume_index"),
        unpacks=True,
        layout="mgh:mgh_layout",
    ),
    "afni": VolumeFormat(
        title="AFNI (pairs)",
        suffixes=(".head", ".brik", ".brik.gz"),
        options=(*_NAMED_AXES, "volume_index", "allow_outside"),
        unpacks=True,
        layout="afni:afni_layout",
    ),
    "parrec": VolumeFormat(
        title="Philips PAR/REC (pairs)",
        suffixes=(".par", ".rec"),
        options=(*_NAMED_AXES, "volume_index", "allow_outside"),
        read="parrec:parrec_volume",
        entries="parrec:parrec_entries",
    ),
    "minc": VolumeFormat(
        title="MINC 1 and 2",
        suffixes=(".mnc",),
        begins=lambda start: (
            start[:4] in (b"CDF\x01", b"CDF\x02") or (start[:4] == _HDF and b"minc-2.0" in start)
        ),
        may_begin=lambda start: start[:4] == _HDF,
        options=(*_NAMED_AXES, "volume_index", *_GRID),
        read="minc:minc_volume",
        entries="minc:minc_entries",
    ),
    "hdf5": VolumeFormat(
        title="HDF5, NeXus, Imaris, BigDataViewer (FILE:/DATASET where a file holds several)",
        suffixes=(".h5", ".hdf5", ".hdf", ".nxs", ".nx5", ".he5", ".ims"),
        begins=lambda start: (start[:4] == _HDF and b"minc-2.0" not in start) or b"<SpimData" in start,
        may_begin=lambda start: start[:4] == _HDF,
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        read="hdf5:hdf5_volume",
        entries="hdf5:hdf5_entries",
    ),
    "images": VolumeFormat(
        title="folders of PNG, BMP, JPEG or JPEG 2000 slices",
        begins=lambda start: start.startswith(_IMAGES) or (start[:2] == b"BM" and start[6:10] == bytes(4)),
        options=("slice_gaps", "allow_outside", *_GRID),
        read="images:images_volume",
        entries="images:images_entries",
    ),
    "tiff": VolumeFormat(
        title="TIFF stacks",
        suffixes=(".tif", ".tiff"),
        begins=lambda start: start[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
        options=(*_NAMED_AXES, "volume_index", "slice_gaps", "allow_outside", *_GRID),
        read="tiff:tiff_volume",
        entries="tiff:tiff_entries",
    ),
    "zarr": VolumeFormat(
        title="Zarr and OME-Zarr (folders)",
        options=(*_NAMED_AXES, "volume_index", "allow_outside", *_GRID),
        read="zarr:zarr_volume",
        entries="zarr:zarr_entries",
    ),
    "numpy": VolumeFormat(
        title="NumPy",
        suffixes=(".npy", ".npz"),
        begins=lambda start: start.startswith(b"\x93NUMPY"),
        may_begin=lambda start: start.startswith(_ZIP),  # an .npz
        options=(*_NAMED_AXES, "volume_index", *_GRID),
        read="numpy_file:numpy_volume",
        entries="numpy_file:numpy_entries",
    ),
    "raw": VolumeFormat(
        title="raw",
        suffixes=(".raw", ".raw.gz"),
        options=("shape", "dtype", "byte_order", "skip_bytes", *_GRID),
        unpacks=True,
        layout="raw:raw_layout",
    ),
}
"""The formats by their names for `--input-format`; a file whose start is asked about is held against them in
this order."""


def reader(place: str) -> Callable[..., Any]:
    """Import and return the function at a place of `VolumeFormat`."""
    function: Callable[..., Any] = resolve_name(f"dmc_cli.volume_io.{place}")
    return function


def known_suffixes() -> list[str]:
    """Return all suffixes that mean a format, sorted."""
    return sorted(suffix for known in FORMATS.values() for suffix in known.suffixes)


def format_of_suffix(name: str) -> str | None:
    """Return the format that a file's name means by the longest suffix of it that is known, or None."""
    lower = name.lower()
    fitting = [
        (len(suffix), key)
        for key, known in FORMATS.items()
        for suffix in known.suffixes
        if lower.endswith(suffix)
    ]
    return max(fitting, key=lambda pair: pair[0])[1] if fitting else None


def format_of_start(start: bytes) -> str | None:
    """Return the format of a file with these first bytes, unpacked where they are packed, or None."""
    certain = (key for key, known in FORMATS.items() if known.begins(start))
    likely = (key for key, known in FORMATS.items() if known.may_begin(start))
    return next(certain, None) or next(likely, None)


def formats_with(option: str) -> list[str]:
    """Return the formats whose readers look at an option, sorted."""
    return sorted(key for key, known in FORMATS.items() if option in known.options)
