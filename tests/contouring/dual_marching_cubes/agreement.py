"""Compare a kernel's surface with the oracle's: same polygons, same quads in the same order."""

import numpy as np

from dmc_cli.contouring import Surface, extract_surface
from dmc_cli.field import upload_volume
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume
from tests.oracle.surface import OracleSurface


def extract_on(device: str, volume: Volume, settings: SurfaceSettings, *, threads: int = 1) -> Surface:
    """The kernels' surface of a volume on the named device."""
    return extract_surface(upload_volume(volume, select_device(device, threads)), settings)


def oracle_counts(oracle: OracleSurface) -> dict[str, int]:
    """The oracle's counts under the names of the report."""
    return {
        "polygons": oracle.polygon_count,
        "unused_vertices": oracle.unused_count,
        "crossed_edges": oracle.crossed_edge_count,
        "active_cells": len(oracle.cells),
        "multi_polygon_cells": sum(len(polygons) > 1 for polygons in oracle.polygons.values()),
        "ambiguous_faces": len(oracle.decisions),
        "flipped_faces": len(oracle.flipped),
    }


def assert_same_surface(surface: Surface, oracle: OracleSurface) -> None:
    """Fail unless both have the same counts, quads and vertices."""
    expected = oracle_counts(oracle)
    assert {name: getattr(surface.counts, name) for name in expected} == expected
    quads, cells = surface.mesh.faces.numpy(), surface.placement.cell.numpy()
    assert len(quads) == len(oracle.quads)
    meaning: dict[int, object] = {}
    for q, (edge, corners) in enumerate(oracle.quads):
        expected_cells = [oracle.grid.linear_index(v.cell) for v in corners]
        found_cells = cells[quads[q]].tolist()
        turned = [expected_cells[c:] + expected_cells[:c] for c in range(4)]
        assert found_cells in turned, f"quad {q} round {edge} lies in cells {found_cells}"
        c = turned.index(found_cells)
        for vertex, corner in zip(quads[q].tolist(), corners[c:] + corners[:c], strict=True):
            known = meaning.setdefault(vertex, corner)
            assert known == corner, f"vertex {vertex} stands for {known} and, in quad {q}, for {corner}"
    assert len(set(meaning.values())) == len(meaning), "two vertices stand for one polygon or fan"
    assert sorted(meaning) == list(range(len(cells))), "a vertex belongs to no quad"


def as_arrays(surface: Surface) -> dict[str, np.ndarray]:
    """The surface's arrays, for comparing bytes."""
    mesh, placement = surface.mesh, surface.placement
    arrays = {"positions": mesh.positions, "cell": placement.cell, "local": placement.local}
    arrays["faces"] = mesh.faces
    return {name: array.numpy() for name, array in arrays.items()}
