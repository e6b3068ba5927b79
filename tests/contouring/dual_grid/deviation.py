"""How far the vertices of a mesh are from the papers' fields, and what shapes its quads have."""

import numpy as np

from tests.fields import FORMULAS, paper_field


def deviations(extract, field: str, nodes: int, **chosen) -> np.ndarray:
    """|f| at the vertices of a field's surface, (V,), from the field's formula at double positions."""
    surface = extract(paper_field(field, nodes), 0.0, threads=2, **chosen)
    placement = surface.placement
    index = np.stack(placement.frame.grid.lowest_nodes(placement.cell.numpy()), axis=1)
    x, y, z = (-1.0 + 2.0 / (nodes - 1) * (index + placement.local.numpy().astype(np.float64))).T
    return np.abs(FORMULAS[field](x, y, z))
