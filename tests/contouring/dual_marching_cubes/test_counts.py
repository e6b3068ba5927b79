"""The kernels reproduce the reference counts exactly."""

import numpy as np
import pytest

from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import NON_MANIFOLD_ISOVALUES, non_manifold_volume, paper_field
from tests.oracle.edges import pair_use, pair_valences
from tests.oracle.test_surface import NON_MANIFOLD_COUNTS
from tests.reference import rows_of_size, table


def irregular_percent(surface):
    """Share of MC polygons, unused ones included, whose vertex has not exactly four mesh edges."""
    valence = pair_valences(surface.mesh.faces.numpy(), len(surface.placement.cell))
    return 100.0 * (1.0 - np.count_nonzero(valence == 4) / surface.counts.polygons)


def counts_of(surface):
    use = pair_use(surface.mesh.faces.numpy())
    return {
        "vertices": surface.counts.polygons,
        "unused": surface.counts.unused_vertices,
        "quads": surface.mesh.face_count,
        "crossed_edges": surface.counts.crossed_edges,
        "boundary_edges": int((use == 1).sum()),
        "edges_with_4_quads": int((use == 4).sum()),
    }


def assert_counts_of_row(surface, row):
    expected = {key: int(row[key]) for key in counts_of(surface) if row.get(key)}
    assert {key: counts_of(surface)[key] for key in expected} == expected
    if row["irregular_percent"]:
        decimals = len(row["irregular_percent"].partition(".")[2])
        assert round(irregular_percent(surface), decimals) == float(row["irregular_percent"])


def name_of(row):
    return f"{row['field']}-{row['n']}"


@pytest.mark.parametrize("row", rows_of_size(32, 64, 128), ids=name_of)
def test_the_counts_of_the_papers_fields_are_exact(extract, row):
    surface = extract(paper_field(row["field"], int(row["n"])), topology="asymptotic")
    assert_counts_of_row(surface, row)


@pytest.mark.slow
@pytest.mark.parametrize("row", rows_of_size(256, 512), ids=name_of)
def test_the_counts_of_the_papers_large_fields_are_exact(extract, row):
    volume = paper_field.__wrapped__(row["field"], int(row["n"]))
    assert_counts_of_row(extract(volume, topology="asymptotic", threads=2), row)


@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_the_counts_of_the_non_manifold_volumes_are_exact(extract, name):
    isovalue = NON_MANIFOLD_ISOVALUES[name]
    surface = extract(non_manifold_volume(name), isovalue, topology="asymptotic")
    use = pair_use(surface.mesh.faces.numpy())
    found = (surface.counts.polygons, surface.mesh.face_count, int((use == 4).sum()), int((use == 3).sum()))
    assert found == NON_MANIFOLD_COUNTS[name]


def test_eight_of_the_304_ambiguous_faces_of_steiner_128_are_flipped(extract):
    counts = extract(paper_field("steiner", 128)).counts
    assert (counts.ambiguous_faces, counts.flipped_faces) == (304, 8)


@pytest.mark.real
@pytest.mark.parametrize("row", table("regression_real.csv"), ids=lambda row: row["volume"])
def test_the_counts_of_real_volumes_are_exact(extract, row, shared_data):
    volume, isovalue = read_real_volume(shared_data, row["volume"]), REAL_VOLUMES[row["volume"]][0]
    surface = extract(volume, isovalue, topology="asymptotic", border="closed", threads=2)
    assert surface.placement.frame.stored_isovalue == float(row["stored_isovalue"])
    assert_counts_of_row(surface, row)
