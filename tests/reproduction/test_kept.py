"""What docs/reproduction.md shows is what is found: the smallest data set, and in the slow suite all."""

import pytest

from dmc_cli.reproduction.paper_tables import PAPER_VALUES
from dmc_cli.reproduction.reproduce_run import reproduce_tables
from dmc_cli.settings import ReproduceSettings
from tests.docs.reproduction import found_rows

SCANS = {"engine": "nifti_engine/engine.nii.gz", "bonsai": "nifti_bonsai/bonsai.nii.gz"}


def key_of(row):
    return row.value.table, row.value.data.name, row.value.mesh, row.value.quantity


def assert_kept(rows, least):
    """Fail unless what is found is what was kept, to seven digits."""
    kept = {key_of(row): row.found for row in found_rows()}
    compared = [row for row in rows if row.value.expectation != "machine" and row.found is not None]
    assert len(compared) >= least
    for row in compared:
        assert row.found == pytest.approx(kept[key_of(row)], rel=2e-6, abs=1e-12), key_of(row)


def test_what_was_kept_is_found_on_the_smallest_data_set():
    assert_kept(reproduce_tables(ReproduceSettings(up_to=64, device="cpu", threads=2)), 20)


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_what_was_kept_is_found_on_all_data_sets():
    rows = reproduce_tables(ReproduceSettings(device="cpu"))
    assert len(rows) == len(PAPER_VALUES)
    assert_kept(rows, 100)
    assert all(row.found is not None for row in rows if row.value.expectation != "other_data")


@pytest.mark.real
@pytest.mark.slow
def test_what_was_kept_is_found_on_the_scans(shared_data):
    scans = tuple(f"{name}={shared_data / path}" for name, path in SCANS.items())
    assert_kept(reproduce_tables(ReproduceSettings(table=("I",), scans=scans, device="cpu")), 12)
