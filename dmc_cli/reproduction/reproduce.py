"""Show the papers' tables, ours beside them: what is measured for them, and how it is shown.

Deviation is equation 7 against the field's own formula, as the paper does for synthetic data, in double
precision at the vertices' cells and local coordinates. A vertex that no quad uses counts as a vertex, and as
an irregular one, as the paper counts.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.array_types import IntArray
from dmc_cli.measures import (
    choose_diagonals,
    inspect_vertices,
    measure_quality,
)
from dmc_cli.mesh import REGULAR, REGULAR_OF_TRIANGLES, Mesh, Placement
from dmc_cli.reproduction.paper_tables import PAPER_VALUES, DataSet, MeshKind, PaperValue
from dmc_cli.volume_io import FIELDS

CHUNK = 1 << 20
"""Vertices at which a formula is evaluated at a time: temporaries of 8 MiB each."""

Found = Mapping[tuple[str, MeshKind], Mapping[str, float]]
"""What was found, by name of the data set and kind of mesh, then by quantity."""


@dataclass(frozen=True, kw_only=True)
class SyntheticMesh:
    """A mesh of a synthetic field with an open border.

    Attributes:
        data: The field and its nodes.
        mesh: Its positions on [-1, 1]^3, quads and halfedges.
        placement: Where its vertices lie.
        unused_vertices: Polygons whose vertex no quad uses; 0 after simplification.
    """

    data: DataSet
    mesh: Mesh
    placement: Placement
    unused_vertices: int


@dataclass(frozen=True, kw_only=True)
class Row:
    """A printed figure and ours; `found` and `difference` are None if nothing was found."""

    value: PaperValue
    found: float | None

    @property
    def difference(self) -> float | None:
        """Return the figure that was found less the printed one."""
        return None if self.found is None else self.found - self.value.printed


def measure_synthetic(mesh: SyntheticMesh) -> dict[str, float]:
    """Return every quantity of tables 3 and 6 to 9 that a mesh, which has vertices, by itself tells."""
    vertex_count = mesh.mesh.vertex_count
    valences = inspect_vertices(mesh.mesh).valences
    quality = measure_quality(mesh.mesh)
    triangle_valences = valences + _diagonal_ends(mesh.mesh)
    deviation = mean_field_value(mesh)
    irregular = int(np.count_nonzero(valences != REGULAR)) + mesh.unused_vertices
    irregular_triangle = int(np.count_nonzero(triangle_valences != REGULAR_OF_TRIANGLES))
    return {
        "vertices": vertex_count + mesh.unused_vertices,
        "quads": mesh.mesh.face_count - mesh.mesh.triangle_count,
        "triangles": mesh.mesh.triangle_count,
        "mean_deviation": deviation,
        "mean_deviation_1e4": 1e4 * deviation,
        "shape": quality.shape_mean or 0.0,
        "mean_ratio": quality.mean_ratio_mean or 0.0,
        "irregular_percent": 100.0 * irregular / (vertex_count + mesh.unused_vertices),
        "irregular_triangle_percent": 100.0 * irregular_triangle / vertex_count,
    }


def mean_field_value(mesh: SyntheticMesh) -> float:
    """Return the mean of |f| over the vertices, f the field's formula: equation 7 at isovalue 0."""
    formula, nodes = FIELDS[mesh.data.field], mesh.data.nodes
    step = 2.0 / (nodes - 1)
    all_cells, all_local = mesh.placement.cell.numpy(), mesh.placement.local.numpy()
    sums = []
    for start in range(0, len(all_cells), CHUNK):
        lowest = mesh.placement.frame.grid.lowest_nodes(all_cells[start : start + CHUNK])
        local = all_local[start : start + CHUNK].astype(np.float64)
        x, y, z = (step * (lowest[a] + local[:, a]) - 1.0 for a in range(3))
        sums.append(np.abs(formula(x, y, z)).sum())
    return float(np.sum(sums)) / len(all_cells)


def compare_tables(found: Found, values: Iterable[PaperValue] = PAPER_VALUES) -> list[Row]:
    """Put what was found beside what is printed, in the order of the tables."""
    return [
        Row(value=value, found=found.get((value.data.name, value.mesh), {}).get(value.quantity))
        for value in values
    ]


def rows_as_json(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return the rows as plain dicts."""
    return [
        {
            "table": row.value.table,
            "data": row.value.data.name,
            "mesh": row.value.mesh,
            "quantity": row.value.quantity,
            "paper": row.value.printed,
            "found": row.found,
            "difference": row.difference,
            "expected": row.value.expectation,
            "remark": row.value.remark,
        }
        for row in rows
    ]


def rows_as_text(rows: Iterable[Row]) -> Iterator[str]:
    """Yield the rows as lines of text, a heading before each table."""
    table = 0
    for row in rows:
        if row.value.table != table:
            table = row.value.table
            yield f"Table {table}"
            yield _columns("data", "mesh", "quantity", "paper", "found", "difference")
        yield _line(row)


def _line(row: Row) -> str:
    """Return one row as text."""
    value = row.value
    is_count = isinstance(value.printed, int)
    printed = f"{value.printed:d}" if is_count else f"{value.printed:.2f}"
    found = difference = "-"
    if row.found is not None:
        is_whole = is_count and float(row.found).is_integer()
        found = f"{row.found:.0f}" if is_whole else f"{row.found:.4f}"
        difference = f"{row.difference:+.0f}" if is_whole else f"{row.difference:+.4f}"
    text = _columns(value.data.name, value.mesh, value.quantity, printed, found, difference)
    note = value.remark or ("" if value.expectation in ("exact", "close") else value.expectation)
    return f"{text}  {note}".rstrip()


def _columns(data: str, mesh: str, quantity: str, paper: str, found: str, difference: str) -> str:
    """Return the entries of a line in their columns."""
    return f"  {data:<14} {mesh:<15} {quantity:<27} {paper:>10} {found:>12} {difference:>11}"


def _diagonal_ends(mesh: Mesh) -> IntArray:
    """Return how many diagonals of the MaxMin-angle split of quads end at each vertex."""
    if mesh.triangle_count:
        return np.zeros(mesh.vertex_count, np.int64)
    quads, diagonals = mesh.faces.numpy(), choose_diagonals(mesh).numpy() == 1
    ends = np.concatenate(
        [np.where(diagonals, quads[:, 1], quads[:, 0]), np.where(diagonals, quads[:, 3], quads[:, 2])]
    )
    return np.bincount(ends, minlength=mesh.vertex_count)
