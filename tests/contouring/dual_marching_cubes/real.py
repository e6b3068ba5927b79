"""The real volumes with reference counts, and how to read them."""

from pathlib import Path

from dmc_cli.settings import ReadSettings
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_io.read import read_volume

REAL_VOLUMES = {
    "nrrd_tooth/tooth.nhdr": (500.0, {}),
    "raw_microct_bone": (85.0, {"shape": (128, 128, 128), "dtype": "uint8"}),
    "raw_engine": (75.0, {"shape": (256, 256, 110), "dtype": "uint8"}),
    "nrrd_skull_mask/Skull.nrrd": (0.5, {}),
    "nifti_bonsai/bonsai.nii.gz": (40.0, {}),
    "nrrd_fetal_t2/template_T2.nrrd": (150.0, {}),
}
"""Isovalue and what the reader needs to be told, by the name in the table."""


def read_real_volume(folder: Path, name: str) -> Volume:
    """Read one of `REAL_VOLUMES`; a folder holds one raw file."""
    path = folder / name
    if path.is_dir():
        path = next(path.glob("*.raw"))
    return read_volume(str(path), ReadSettings(**REAL_VOLUMES[name][1]))
