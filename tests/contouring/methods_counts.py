"""The rows of `methods_counts.csv`, and the volumes that they are of."""

from pathlib import Path

import pytest

from dmc_cli.settings import ReadSettings
from dmc_cli.volume.volume import Volume
from dmc_cli.volume_io import read_volume
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import PAPER_FIELDS, paper_field
from tests.reference import table

REAL_NAMES = {
    "tooth": "nrrd_tooth/tooth.nhdr",
    "bone": "raw_microct_bone",
    "engine": "raw_engine",
    "engine128": "nifti_engine",
    "skull": "nrrd_skull_mask/Skull.nrrd",
    "bonsai": "nifti_bonsai/bonsai.nii.gz",
    "fetal": "nrrd_fetal_t2/template_T2.nrrd",
}


def rows(*, smallest: int = 0, largest: int = 10**9, real: bool = False) -> list[dict[str, str]]:
    """The rows of synthetic fields with so many nodes an axis, or those of real volumes."""
    found = table("methods_counts.csv")
    if real:
        return [row for row in found if row["volume"] in REAL_NAMES]
    return [
        row for row in found if row["volume"] in PAPER_FIELDS and smallest <= int(row["nodes"]) <= largest
    ]


LARGE_SCANS = {"bonsai", "engine", "engine128"}
"""Real volumes of seven million nodes and more."""


def scans() -> list:
    """The rows of real volumes as parameters, those of large ones marked as slow."""
    return [
        pytest.param(row, marks=pytest.mark.slow if row["volume"] in LARGE_SCANS else (), id=row_name(row))
        for row in rows(real=True)
    ]


def row_name(row: dict[str, str]) -> str:
    return f"{row['volume']}-{row['nodes']}-{row['isovalue']}-{row['border']}"


def volume_of_row(row: dict[str, str], shared_data: Path | None = None) -> Volume:
    """The volume of a row; real ones lie in a folder beside the checkout."""
    if row["volume"] in PAPER_FIELDS:
        make = paper_field if int(row["nodes"]) <= 128 else paper_field.__wrapped__
        return make(row["volume"], int(row["nodes"]))
    name = REAL_NAMES[row["volume"]]
    if name in REAL_VOLUMES:
        return read_real_volume(shared_data, name)
    return read_volume(str(next((shared_data / name).glob("*.nii.gz"))), ReadSettings())
