"""The kernels reproduce the reference counts of dual contouring and surface nets exactly."""

import numpy as np
import pytest

from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import PAPER_FIELDS, paper_field
from tests.oracle.edges import pair_use
from tests.reference import table

REAL = {name.split("/")[0].split("_")[1]: name for name in REAL_VOLUMES} | {
    "bone": "raw_microct_bone",
    "fetal": "nrrd_fetal_t2/template_T2.nrrd",
}
"""Names of real volumes in the table."""

ROWS = table("methods_counts.csv")
SMALL = [row for row in ROWS if row["volume"] in PAPER_FIELDS and int(row["nodes"]) <= 128]
LARGE = [row for row in ROWS if row["volume"] in PAPER_FIELDS and int(row["nodes"]) > 128]
REAL_ROWS = [row for row in ROWS if row["volume"] in REAL]


def name_of(row):
    return f"{row['volume']}-{row['nodes']}-{row['isovalue']}-{row['border']}"


def assert_counts_of_row(surface, row):
    counts, use = surface.counts, pair_use(surface.mesh.faces.numpy())
    found = {
        "active_cells": counts.active_cells,
        "inner_crossed_edges": surface.mesh.face_count,
        "mc_vertices": counts.crossed_edges,
        "dc_edges_with_4_quads": int(np.count_nonzero(use == 4)),
        "dc_edges_with_3_quads": int(np.count_nonzero(use == 3)),
    }
    assert found == {key: int(row[key]) for key in found}
    assert surface.mesh.vertex_count == counts.active_cells - counts.unused_vertices
    assert row["border"] == "open" or counts.unused_vertices == 0


@pytest.mark.parametrize("row", SMALL, ids=name_of)
def test_the_counts_of_the_papers_fields_are_exact(extract, row):
    volume = paper_field(row["volume"], int(row["nodes"]))
    surface = extract(volume, float(row["isovalue"]), method="nets", border=row["border"], threads=2)
    assert_counts_of_row(surface, row)


@pytest.mark.slow
@pytest.mark.parametrize("row", LARGE, ids=name_of)
def test_the_counts_of_the_papers_large_fields_are_exact(extract, row):
    volume = paper_field.__wrapped__(row["volume"], int(row["nodes"]))
    surface = extract(volume, float(row["isovalue"]), method="nets", border=row["border"], threads=2)
    assert_counts_of_row(surface, row)


@pytest.mark.real
@pytest.mark.parametrize("row", REAL_ROWS, ids=name_of)
def test_the_counts_of_real_volumes_are_exact(extract, row, shared_data):
    volume = read_real_volume(shared_data, REAL[row["volume"]])
    surface = extract(volume, float(row["isovalue"]), method="nets", border=row["border"], threads=2)
    assert_counts_of_row(surface, row)
