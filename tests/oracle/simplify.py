"""The papers' bare simplification (section 4), with every rule that their texts leave out.

Order: coloured 3-X-3-Y pass, counter 3-X-3-Y pass, 3-3-3-3 once; valences, vertex pairs and
skipped quads are taken anew before each. Colours stay those of the mesh before simplification.

Rules. Leaving any of them out changes a row of the reference counts, synthetic or real, unless it is
marked (*): the table leaves it open.

- Valence: one per outgoing halfedge, and one at the head of every halfedge without a twin.
- A quad has a defect if one of its sides has no twin, or joins a pair of vertices that more than two
  quads join (at once, over the whole mesh, whatever their twins). It is skipped if it has a defect or a
  neighbour of its has one. Neighbours are the quads across its twins.
- 3-X-3-Y: opposite vertices of valence 3, the other two of valence 5 or more.
- Coloured pass: such a quad goes if it is not skipped and no neighbour with the pattern has a colour
  at or below its own. A skipped neighbour with the pattern still blocks.
- Counter pass: such a quad goes if it is not skipped and each of its two vertices of valence 3 is
  one of no other quad with the pattern; skipped quads with the pattern count.
- Removal: the two vertices of valence 3 become one, at the midpoint of the other two (which never
  move in the same pass); (*) it keeps the lower of the two numbers, its normal is the average of
  theirs. The twins of the two halfedges at either of the other vertices become twins.
- 3-3-3-3: all four vertices of valence 3, the quad not skipped, no outer vertex of valence 3, and not
  all four outer vertices of valence 4. The outer vertices are those of the four neighbours that
  are not the quad's own. The quad takes them, the neighbours go; nothing moves. All removals
  are decided on the mesh before any of them.
- (*) What stays keeps its order: vertices and quads are renumbered without gaps. Vertices that no quad
  uses any more go.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tests.oracle.edges import vertex_pairs
from tests.oracle.halfedges import NO_TWIN, next_halfedge, valences


@dataclass(frozen=True)
class ColoredMesh:
    """Vertex `positions` (V, 3), `quads` (Q, 4), `twins` (4Q,) and one of five `colors` a quad (Q,)."""

    positions: np.ndarray
    quads: np.ndarray
    twins: np.ndarray
    colors: np.ndarray

    @property
    def vertex_count(self) -> int:
        return len(self.positions)

    def valences(self) -> np.ndarray:
        return valences(self.quads, self.twins, self.vertex_count)

    def neighbors(self, q: int) -> list[int]:
        """The quads across the twins of a quad's four halfedges, as many as there are twins."""
        across = (int(self.twins[4 * q + c]) for c in range(4))
        return [twin // 4 for twin in across if twin != NO_TWIN]


def simplify(mesh: ColoredMesh) -> tuple[ColoredMesh, tuple[int, int, int]]:
    """The mesh after all three passes, and how many quads each of them removed."""
    coloured = remove_3x3y(mesh, chosen_by_color(mesh))
    counted = remove_3x3y(coloured, chosen_by_counter(coloured))
    cleared = remove_3333(counted, pattern_3333(counted))
    counts = [len(m.quads) for m in (mesh, coloured, counted, cleared)]
    return cleared, tuple(before - after for before, after in pairwise(counts))


def skipped_quads(mesh: ColoredMesh) -> np.ndarray:
    """Quads with a side without a twin or on a non-manifold edge, and their neighbours."""
    _, pair, use = np.unique(vertex_pairs(mesh.quads), return_inverse=True, return_counts=True)
    nonmanifold = use[pair] > 2
    defect = (nonmanifold | (mesh.twins == NO_TWIN)).reshape(-1, 4).any(axis=1)
    near = [any(defect[n] for n in mesh.neighbors(q)) for q in range(len(mesh.quads))]
    return defect | np.array(near, dtype=bool)


def pattern_3x3y(mesh: ColoredMesh) -> np.ndarray:
    """The first corner (0 or 1) of valence 3 of each 3-X-3-Y quad, -1 for other quads."""
    v = mesh.valences()[mesh.quads]
    even = (v[:, 0] == 3) & (v[:, 2] == 3) & (v[:, 1] >= 5) & (v[:, 3] >= 5)
    odd = (v[:, 1] == 3) & (v[:, 3] == 3) & (v[:, 0] >= 5) & (v[:, 2] >= 5)
    return np.where(even, 0, np.where(odd, 1, -1))


def chosen_by_color(mesh: ColoredMesh) -> list[int]:
    """The quads that the coloured pass removes."""
    corner, skipped = pattern_3x3y(mesh), skipped_quads(mesh)
    chosen = []
    for q in np.flatnonzero((corner >= 0) & ~skipped).tolist():
        rivals = [n for n in mesh.neighbors(q) if corner[n] >= 0]
        if all(mesh.colors[n] > mesh.colors[q] for n in rivals):
            chosen.append(q)
    return chosen


def chosen_by_counter(mesh: ColoredMesh) -> list[int]:
    """The quads that the counter pass removes."""
    corner, skipped = pattern_3x3y(mesh), skipped_quads(mesh)
    candidates = np.flatnonzero(corner >= 0).tolist()
    threes = {q: mesh.quads[q, [corner[q], corner[q] + 2]] for q in candidates}
    counter = np.zeros(mesh.vertex_count, dtype=np.int64)
    for q in candidates:
        counter[threes[q]] += 1
    return [q for q in candidates if not skipped[q] and (counter[threes[q]] == 1).all()]


def remove_3x3y(mesh: ColoredMesh, chosen: list[int]) -> ColoredMesh:
    """The mesh with each chosen quad's two vertices of valence 3 merged into one."""
    corner = pattern_3x3y(mesh)
    twins, positions = mesh.twins.copy(), mesh.positions.copy()
    merged = np.arange(mesh.vertex_count)
    for q in chosen:
        kept, gone = sorted(mesh.quads[q, [corner[q], corner[q] + 2]].tolist())
        merged[gone] = kept
        others = mesh.quads[q, [1 - corner[q], 3 - corner[q]]]
        positions[kept] = mesh.positions[others].mean(axis=0)
        for c in (corner[q], corner[q] + 2):
            towards = 4 * q + int(c)
            pair_twins(twins, int(twins[towards]), int(twins[next_halfedge(towards)]))
    return without_quads(mesh, positions, merged[mesh.quads], twins, set(chosen))


def pattern_3333(mesh: ColoredMesh) -> list[int]:
    """The quads with the 3-3-3-3 pattern that can be removed."""
    valence, skipped = mesh.valences(), skipped_quads(mesh)
    chosen = []
    for q in np.flatnonzero((valence[mesh.quads] == 3).all(axis=1) & ~skipped).tolist():
        outer = valence[[mesh.quads.flat[h] for h in outer_sides(mesh, q)]]
        if (outer != 3).all() and not (outer == 4).all():
            chosen.append(q)
    return chosen


def outer_sides(mesh: ColoredMesh, q: int) -> list[int]:
    """For each corner c of a quad the neighbour's halfedge opposite to halfedge 4q + c.

    Both run the same way, so its origin is the outer vertex at the quad's corner c.
    """
    return [next_halfedge(next_halfedge(int(mesh.twins[4 * q + c]))) for c in range(4)]


def remove_3333(mesh: ColoredMesh, chosen: list[int]) -> ColoredMesh:
    """The mesh with each chosen quad stretched over its four neighbours."""
    quads, twins = mesh.quads.copy(), mesh.twins.copy()
    taken_over = {side: 4 * q + c for q in chosen for c, side in enumerate(outer_sides(mesh, q))}
    for side, h in taken_over.items():
        quads.flat[h] = mesh.quads.flat[side]
        beyond = int(mesh.twins[side])
        pair_twins(twins, h, taken_over.get(beyond, beyond))
    return without_quads(mesh, mesh.positions, quads, twins, {side // 4 for side in taken_over})


def pair_twins(twins: np.ndarray, h: int, other: int) -> None:
    """Make two halfedges twins, or leave one without if the other is absent."""
    if h != NO_TWIN:
        twins[h] = other
    if other != NO_TWIN:
        twins[other] = h


def without_quads(
    mesh: ColoredMesh, positions: np.ndarray, quads: np.ndarray, twins: np.ndarray, gone: set[int]
) -> ColoredMesh:
    """The mesh of the quads that stay and the vertices that they use, renumbered in order."""
    stays = np.array([q not in gone for q in range(len(quads))], dtype=bool)
    new_quad = np.cumsum(stays) - 1
    twins = twins.reshape(-1, 4)[stays].ravel()
    twins = np.where(twins == NO_TWIN, NO_TWIN, 4 * new_quad[twins // 4] + twins % 4)
    used, renumbered = np.unique(quads[stays], return_inverse=True)
    return ColoredMesh(positions[used], renumbered.reshape(-1, 4), twins, mesh.colors[stays])
