"""List the formats of volumes that are read: a file or a folder each, and a line here.

Help texts, messages and the README's table are made from this list. Readers are imported when a file of
theirs is read, so that `dmc --help` stays light.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any


@dataclass(frozen=True, kw_only=True)
class VolumeFormat:
    """A format, and where its readers are, as `module:function`.

    Attributes:
        title: Its name, and what of it is read where suffixes do not say so.
        suffixes: Those that mean it; any other file is judged by its content.
        layout: Of a format whose header tells where the values lie: returns its `Layout`.
        read: Of any other: puts a volume together from pieces.
        entries: Beside `read`: lists the volumes that there are.
        begins: What a file looks like by its first bytes, where it may come from standard input and tells no
            length; an .npz is a zip, as DICOM may be.
    """

    title: str
    suffixes: tuple[str, ...] = ()
    layout: str = ""
    read: str = ""
    entries: str = ""
    begins: tuple[str, ...] = ()


FORMATS = {
    "dicom": VolumeFormat(
        title="DICOM (folders, zips, files with many frames)",
        suffixes=(".dcm", ".ima", ".zip"),
        read="dicom:dicom_volume",
        entries="dicom:dicom_entries",
        begins=("dicom",),
    ),
    "nifti": VolumeFormat(title="NIfTI", suffixes=(".nii", ".nii.gz"), layout="nifti:nifti_layout"),
    "nrrd": VolumeFormat(title="NRRD", suffixes=(".nrrd", ".nhdr"), layout="nrrd:nrrd_layout"),
    "meta": VolumeFormat(title="MetaImage", suffixes=(".mha", ".mhd"), layout="metaimage:metaimage_layout"),
    "analyze": VolumeFormat(title="Analyze (.hdr and .img)", layout="analyze:analyze_layout"),
    "mgh": VolumeFormat(
        title="FreeSurfer MGH", suffixes=(".mgh", ".mgz", ".mgh.gz"), layout="mgh:mgh_layout"
    ),
    "afni": VolumeFormat(
        title="AFNI (pairs)", suffixes=(".head", ".brik", ".brik.gz"), layout="afni:afni_layout"
    ),
    "parrec": VolumeFormat(
        title="Philips PAR/REC (pairs)",
        suffixes=(".par", ".rec"),
        read="parrec:parrec_volume",
        entries="parrec:parrec_entries",
    ),
    "minc": VolumeFormat(
        title="MINC 1 and 2",
        suffixes=(".mnc",),
        read="minc:minc_volume",
        entries="minc:minc_entries",
        begins=("minc",),
    ),
    "tiff": VolumeFormat(
        title="TIFF stacks",
        suffixes=(".tif", ".tiff"),
        read="tiff:tiff_volume",
        entries="tiff:tiff_entries",
        begins=("tiff",),
    ),
    "zarr": VolumeFormat(
        title="Zarr and OME-Zarr (folders)", read="zarr:zarr_volume", entries="zarr:zarr_entries"
    ),
    "numpy": VolumeFormat(
        title="NumPy",
        suffixes=(".npy", ".npz"),
        read="numpy_file:numpy_volume",
        entries="numpy_file:numpy_entries",
        begins=("numpy", "dicom"),
    ),
    "raw": VolumeFormat(title="raw", suffixes=(".raw", ".raw.gz"), layout="raw:raw_layout"),
}
"""The formats by their names for `--input-format`."""


def reader(place: str) -> Callable[..., Any]:
    """Import and return the function at a place of `VolumeFormat`."""
    function: Callable[..., Any] = resolve_name(f"dmc_cli.volume_io.{place}")
    return function


def known_suffixes() -> list[str]:
    """Return all suffixes that mean a format, sorted."""
    return sorted(suffix for known in FORMATS.values() for suffix in known.suffixes)


def format_of_suffix(name: str) -> str | None:
    """Return the format that a file's name means by the longest suffix of it that is known, or None."""
    fitting = [suffix for suffix in known_suffixes() if name.lower().endswith(suffix)]
    longest = max(fitting, key=len, default=None)
    return next((key for key, known in FORMATS.items() if longest in known.suffixes), None)
