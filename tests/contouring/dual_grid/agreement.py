"""Compare the dual of the grid that kernels make with the oracle's."""

import numpy as np

from dmc_cli.contouring import Surface
from tests.oracle.dual import OracleDual


def assert_same_dual(surface: Surface, oracle: OracleDual) -> None:
    """Fail unless both have the same counts, cells in the same order, and quads in the same order."""
    counts = surface.counts
    expected = (oracle.active_count, oracle.active_count - len(oracle.cells), oracle.crossed_edge_count)
    assert (counts.active_cells, counts.unused_vertices, counts.crossed_edges) == expected
    np.testing.assert_array_equal(surface.placement.cell.numpy(), oracle.cells)
    quads = surface.mesh.faces.numpy().reshape(-1, 4)
    assert len(quads) == len(oracle.quads)
    turned = np.stack([np.roll(oracle.quads, -c, axis=1) for c in range(4)])
    assert (turned == quads).all(axis=2).any(axis=0).all()
