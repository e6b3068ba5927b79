"""Tell the options of reading that were given but have no effect on a format."""

from collections.abc import Iterator

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.layout import without_effect

_RAW = ("raw",)
_DICOM = ("dicom",)
_PLACED = ("meta", "nrrd", "numpy", "raw", "tiff", "zarr")
_MANY_FILES = ("afni", "analyze", "dicom", "meta", "nifti", "nrrd", "parrec", "tiff", "zarr")
_SEVERAL = ("afni", "analyze", "meta", "mgh", "minc", "nifti", "nrrd", "numpy", "parrec", "tiff", "zarr")

USED_BY: dict[str, tuple[str, ...]] = {
    "series": _DICOM,
    "slice_gaps": _DICOM,
    "duplicates": _DICOM,
    "volume_index": _SEVERAL,
    "allow_outside": _MANY_FILES,
    "shape": _RAW,
    "dtype": _RAW,
    "byte_order": _RAW,
    "skip_bytes": _RAW,
    "spacing": _PLACED,
    "origin": _PLACED,
}
"""The formats that an option is for. Of these some files tell their own spacing: their readers warn then."""


def unused_options(format_name: str, settings: ReadSettings) -> Iterator[str]:
    """Yield a warning for each option that was given and that a format's reader never looks at."""
    default = ReadSettings()
    for option, formats in USED_BY.items():
        if format_name in formats or getattr(settings, option) == getattr(default, option):
            continue
        flag = f"--{option.replace('_', '-')}"
        if option in ("spacing", "origin"):
            what = "field" if format_name == "synthetic" else "file"
            yield from without_effect(option, settings, f"the {what}")
        else:
            yield f"{flag} has no effect on {format_name} input; it is for {', '.join(formats)}"
