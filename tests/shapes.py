"""Hand-made quad meshes with known answers.

Each function returns (points, quads): float64 of shape (V, 3) and int32 of shape (Q, 4), corners
counter-clockwise seen from outside, or from +z on a flat patch. A triangle has -1 as its fourth corner.
"""

import numpy as np


def cube():
    """The unit cube: 8 vertices of valence 3, 6 quads."""
    points = np.array([[c & 1, c >> 1 & 1, c >> 2] for c in range(8)], dtype=float)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return points, np.array(quads, dtype=np.int32)


def grid(nx, ny):
    """A flat open patch of nx times ny unit squares."""
    x, y = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(float)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny)))
    a = i + (nx + 1) * j
    return points, np.stack([a, a + 1, a + nx + 2, a + nx + 1], axis=1).astype(np.int32)


def open_strip(n=5):
    """A strip of n quads: one boundary loop."""
    return grid(n, 1)


def torus(n=8, m=8, big=2.0, small=1.0):
    """A torus of n quads round the big circle and m round the small one: all valences 4."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    s, t = 2 * np.pi * i / n, 2 * np.pi * j / m
    ring = big + small * np.cos(t)
    points = np.stack([ring * np.cos(s), ring * np.sin(s), small * np.sin(t)], axis=1)

    def vertex(a, b):
        return (a % n) * m + b % m

    quads = np.stack([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)], axis=1)
    return points, quads.astype(np.int32)


def sphere(n=8):
    """The surface of an n^3 grid of cubes, blown up to the unit sphere: eight vertices of valence 3."""
    table, points, quads = {}, [], []

    def vertex(p):
        if p not in table:
            table[p] = len(points)
            q = 2 * np.array(p) / n - 1
            points.append(q / np.linalg.norm(q))
        return table[p]

    for axis in range(3):
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    quad = [vertex(tuple(np.roll((side, *p), axis).tolist())) for p in ring]
                    quads.append(quad if side else quad[::-1])
    return np.array(points), np.array(quads, dtype=np.int32)


def pinched_vertex():
    """Two squares that share one vertex and no edge: that vertex has two fans."""
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0]], dtype=float
    )
    return points, np.array([[0, 1, 2, 3], [2, 4, 5, 6]], dtype=np.int32)


def moebius_strip(n=7):
    """A strip of n quads, closed with half a turn: quads 0 and n-1 run their common edge the same way."""
    s = 2 * np.pi * np.arange(n) / n
    rails = [(1 + w * np.cos(s / 2), w * np.sin(s / 2)) for w in (-0.3, 0.3)]
    points = [[r[k] * np.cos(s[k]), r[k] * np.sin(s[k]), z[k]] for k in range(n) for r, z in rails]
    quads = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(n - 1)]
    quads.append([2 * n - 2, 1, 0, 2 * n - 1])
    return np.array(points), np.array(quads, dtype=np.int32)


def two_components():
    """A cube, and a second one beside it."""
    return joined(cube(), moved(cube(), (3, 0, 0)))


def edge_to_edge_cubes():
    """Two cubes that share one edge: two closed components by the right twins, one edge with four quads."""
    points, quads = joined(cube(), moved(cube(), (1, 1, 0)))
    return welded(points, quads)


def corner_to_corner_cubes():
    """Two cubes that share one corner: a vertex with two rings."""
    points, quads = joined(cube(), moved(cube(), (1, 1, 1)))
    return welded(points, quads)


def patch_3x3y(x=5, y=5):
    """A quad with valences 3, x, 3, y, in the middle of a patch, on z = 0.

    The quad is number 0, its corners 0 to 3: vertices 0 and 2 have valence 3, 1 has x, 3 has y.
    """
    sides = [3, x, 3, y]
    corners = np.array([[0, -1], [1, 0], [0, 1], [-1, 0]], dtype=float)
    return _ring_patch(corners, sides)


def split_vertex(shape, v):
    """The shape with a quad of valences 3, X, 3, Y, the last, in place of an inner vertex of valence 4.

    Its corners are v, a neighbour of v, a new vertex at the place of v, and the neighbour opposite.
    """
    points, quads = shape
    ring = {}
    for q, quad in enumerate(quads.tolist()):
        if v in quad:
            c = quad.index(v)
            ring[quad[(c + 1) % 4]] = (quad[c - 1], q)
    x = min(ring)
    first, second = ring[x][0], ring[ring[x][0]][0]
    fresh, quads = len(points), quads.copy()
    for start in (x, first):
        q = ring[start][1]
        quads[q] = np.where(quads[q] == v, fresh, quads[q])
    quads = np.vstack([quads, [[v, x, fresh, second]]]).astype(np.int32)
    return np.vstack([points, points[v : v + 1]]), quads


def shared_tip():
    """A sphere whose quad 0 has valences 3, 5, 3, 5, and one vertex, 4, beyond both its vertices 0 and 2."""
    v1, x, v2, y, p, s1, s2, t1, t2 = range(9)
    quads = [[v1, x, v2, y], [x, v1, p, s1], [v1, y, t1, p], [v2, x, s2, p], [y, v2, p, t2]]
    for n, hole in enumerate(([x, s1, p, s2], [y, t2, p, t1])):
        inner = [9 + 4 * n + c for c in range(4)]
        quads.append(inner)
        quads += [[hole[c], hole[(c + 1) % 4], inner[(c + 1) % 4], inner[c]] for c in range(4)]
    turns = np.arange(17)
    points = np.stack([np.cos(turns), np.sin(turns), np.cos(2.1 * turns)], axis=1)
    return points, np.array(quads, dtype=np.int32)


def patch_3333():
    """A quad whose four corners all have valence 3, with its four neighbours: a square in a square."""
    inner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    return _ring_patch(inner, [3, 3, 3, 3])


def _ring_patch(corners, valences):
    """One quad and all quads round it, where inner corner c gets the valence valences[c]."""
    centre = [1, 2, 3, 0]
    points, quads = [*corners], [[0, 1, 2, 3]]
    spokes = []
    for c, corner in enumerate(corners):
        out = corner / np.linalg.norm(corner)
        side = np.array([-out[1], out[0]])
        count = valences[c] - 2
        turns = np.linspace(-0.9, 0.9, count) if count > 1 else [0.0]
        first = len(points)
        points.extend(corner + 2 * np.cos(t) * out + 2 * np.sin(t) * side for t in turns)
        spokes.append([first + k for k in range(count)])
    for c in range(4):
        quads.append([centre[c], c, spokes[c][-1], spokes[centre[c]][0]])
        for a, b in zip(spokes[c], spokes[c][1:], strict=False):
            far = len(points)
            points.append(0.5 * (points[a] + points[b]) + (0.5 * (points[a] + points[b]) - corners[c]))
            quads.append([c, a, far, b])
    points = np.array(points)
    return np.column_stack([points, np.zeros(len(points))]), np.array(quads, dtype=np.int32)


def tetrahedron():
    """Four triangles: rows with -1 as the fourth corner."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    return points, np.array([[0, 2, 1, -1], [0, 1, 3, -1], [1, 2, 3, -1], [0, 3, 2, -1]], dtype=np.int32)


def house():
    """A closed mixed mesh: a cube whose upper quad is a pyramid of four triangles."""
    points, quads = cube()
    points = np.vstack([points, [[0.5, 0.5, 1.5]]])
    roof = [[4, 5, 8, -1], [5, 7, 8, -1], [7, 6, 8, -1], [6, 4, 8, -1]]
    return points, np.vstack([np.delete(quads, 1, axis=0), np.array(roof, dtype=np.int32)])


def moved(shape, offset):
    """The shape, moved by offset."""
    points, quads = shape
    return points + np.asarray(offset, dtype=float), quads


def joined(first, second):
    """Both shapes in one mesh."""
    shift = np.where(second[1] >= 0, len(first[0]), 0)
    quads = np.vstack([first[1], second[1] + shift]).astype(np.int32)
    return np.vstack([first[0], second[0]]), quads


def welded(points, quads):
    """The mesh with coinciding points made one vertex."""
    unique, index = np.unique(points, axis=0, return_inverse=True)
    corners = np.where(quads >= 0, index.ravel()[quads], -1)
    return unique, corners.astype(np.int32)


def halved(shape, every=1):
    """The shape with each of its quads, or every so many of them, cut into two triangles."""
    points, quads = shape
    cut = np.arange(len(quads)) % every == 0
    first, second = quads[cut].copy(), quads[cut][:, [0, 2, 3, 3]].copy()
    first[:, 3] = second[:, 3] = -1
    return points, np.concatenate([quads[~cut], first, second])
