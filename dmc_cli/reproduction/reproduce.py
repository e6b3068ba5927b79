"""Show the papers' tables, ours beside them: what is measured for them, and how it is shown.

Deviation is equation 7 against the field's own formula, as the paper does for synthetic data, in double
precision at the vertices' cells and local coordinates. A vertex that no quad uses counts as a vertex, and as
an irregular one, as the paper counts.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.measures import inspect_vertices, measure_quality
from dmc_cli.mesh import REGULAR, REGULAR_OF_TRIANGLES, Mesh, Placement
from dmc_cli.reproduction.diagonals import diagonal_ends
from dmc_cli.reproduction.paper_tables import PAPER_VALUES
from dmc_cli.reproduction.paper_values import SCHMITZ, DataSet, MeshKind, PaperValue, Scan
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

    @property
    def agrees(self) -> bool:
        """Return whether the found figure is the printed one, to its digits; counts must be equal."""
        printed = self.value.printed
        return self.found is not None and round(self.found, decimals(printed)) == printed

    @property
    def reason(self) -> str:
        """Return why the found figure is not the printed one; "same" where it is."""
        value = self.value
        if self.found is None:
            is_scan = isinstance(value.data, Scan)
            return f"no scan: --scan {value.data.name}=FILE" if is_scan else "not made"
        if value.expectation == "machine":
            return "a time, theirs on an RTX 2080 Ti"
        return "same" if self.agrees else value.remark or "not explained"


def decimals(printed: float) -> int:
    """Return how many decimals a figure is printed with: none of a count, else two at least."""
    if isinstance(printed, int):
        return 0
    return max(2, -int(Decimal(repr(printed)).as_tuple().exponent))


def measure_synthetic(mesh: SyntheticMesh) -> dict[str, float]:
    """Return every quantity of tables 3 and 6 to 9 that a mesh, which has vertices, by itself tells."""
    vertex_count = mesh.mesh.vertex_count
    fans = inspect_vertices(mesh.mesh)
    valences = fans.valences
    quality = measure_quality(mesh.mesh)
    triangle_valences = valences + diagonal_ends(mesh.mesh, mesh.placement)
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
        "non_manifold_percent": 100.0 * min(2 * fans.nonmanifold_edges / vertex_count, 1.0),
    }


def mean_field_value(mesh: SyntheticMesh) -> float:
    """Return the mean of |f| over the vertices: equation 7 at isovalue 0."""
    sums = [values.sum() for values in _field_chunks(mesh)]
    return float(np.sum(sums)) / len(mesh.placement.cell)


def field_values(mesh: SyntheticMesh) -> Float64Array:
    """Return |f| at each vertex, float64 (V,)."""
    return np.concatenate(list(_field_chunks(mesh)))


def _field_chunks(mesh: SyntheticMesh) -> Iterator[Float64Array]:
    """Yield |f| at the vertices, f the field's formula, some of them at a time."""
    formula, nodes = FIELDS[mesh.data.field], mesh.data.nodes
    step = 2.0 / (nodes - 1)
    all_cells, all_local = mesh.placement.cell.numpy(), mesh.placement.local.numpy()
    for start in range(0, len(all_cells), CHUNK):
        lowest = mesh.placement.frame.grid.lowest_nodes(all_cells[start : start + CHUNK])
        local = all_local[start : start + CHUNK].astype(np.float64)
        x, y, z = (step * (lowest[a] + local[:, a]) - 1.0 for a in range(3))
        yield np.abs(formula(x, y, z))


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
            "same": row.agrees,
            "reason": row.reason,
        }
        for row in rows
    ]


def rows_as_text(rows: Iterable[Row]) -> Iterator[str]:
    """Yield the rows as lines of text, a heading before each table."""
    table: int | str = 0
    for row in rows:
        if row.value.table != table:
            table = row.value.table
            yield f"Table {table}{' of Schmitz et al. 2009' if table == SCHMITZ else ''}"
            yield _columns("data", "mesh", "quantity", "paper", "found", "difference") + "  reason"
        yield _line(row)


def _line(row: Row) -> str:
    """Return one row as text."""
    value = row.value
    text = _columns(value.data.name, value.mesh, value.quantity, *figures(row))
    return f"{text}  {row.reason}"


def figures(row: Row) -> tuple[str, str, str]:
    """Return the printed figure, the found one and their difference as text."""
    printed, found, difference = row.value.printed, row.found, row.difference
    if isinstance(printed, int):
        shown = f"{printed:d}"
        if found is None or difference is None:
            return shown, "-", "-"
        if float(found).is_integer():
            return shown, f"{found:.0f}", f"{difference:+.0f}"
        return shown, f"{found:.4f}", f"{difference:+.4f}"
    is_small = 0 < printed < 0.005
    shown = f"{printed:.3e}" if is_small else f"{printed:.{min(decimals(printed), 4)}f}"
    if found is None or difference is None:
        return shown, "-", "-"
    if is_small:
        return shown, f"{found:.3e}", f"{difference:+.3e}"
    return shown, f"{found:.4f}", f"{difference:+.4f}"


def _columns(data: str, mesh: str, quantity: str, paper: str, found: str, difference: str) -> str:
    """Return the entries of a line in their columns."""
    return f"  {data:<14} {mesh:<15} {quantity:<27} {paper:>10} {found:>12} {difference:>11}"
