"""Meshes on a device, and plain NumPy versions of the measures to hold ours against."""

import math
from collections import defaultdict

import numpy as np

from dmc_cli.measures.topology import measure_topology
from dmc_cli.runtime.device import Device
from tests.mesh.meshes import on_device


def topology_of(shape, device="cpu", twins=None, threads=2):
    """Measure a shape of `shapes`, its twins paired by vertices unless given."""
    return measure_topology(on_device(shape, Device(device, threads), twins))


def face_rings(faces):
    """The corners of each face as a tuple of three or four."""
    return [tuple(int(v) for v in face if v >= 0) for face in faces]


def face_edges(faces):
    """(face, tail, head, halfedge) of every halfedge."""
    for f, ring in enumerate(face_rings(faces)):
        for c, tail in enumerate(ring):
            yield f, tail, ring[(c + 1) % len(ring)], 4 * f + c


def plain_valences(faces, vertex_count):
    """Distinct neighbours of each vertex."""
    near = [set() for _ in range(vertex_count)]
    for _, a, b, _ in face_edges(faces):
        if a != b:
            near[a].add(b)
            near[b].add(a)
    return np.array([len(s) for s in near])


def plain_crowded_edges(faces):
    """Vertex pairs with more than two faces."""
    counts = defaultdict(int)
    for _, a, b, _ in face_edges(faces):
        counts[min(a, b), max(a, b)] += 1
    return sum(n > 2 for (a, b), n in counts.items() if a != b)


def plain_classes(items, pairs):
    """Number of connected classes of `items` under `pairs`, by search."""
    near = defaultdict(list)
    for a, b in pairs:
        near[a].append(b)
        near[b].append(a)
    seen, classes = set(), 0
    for item in items:
        if item not in seen:
            classes += 1
            stack = [item]
            seen.add(item)
            while stack:
                for other in near[stack.pop()]:
                    if other not in seen:
                        seen.add(other)
                        stack.append(other)
    return classes


def plain_split_vertices(faces, twins, vertex_count):
    """Vertices whose faces hang together in several groups, through twins at that vertex."""
    at_vertex, links = defaultdict(list), defaultdict(list)
    for f, a, b, h in face_edges(faces):
        at_vertex[a].append(f)
        if twins[h] >= 0:
            links[a].append((f, twins[h] // 4))
            links[b].append((f, twins[h] // 4))
    return sum(plain_classes(at_vertex[v], links[v]) > 1 for v in range(vertex_count))


def plain_loops(faces, twins):
    """Loops of boundary halfedges: walk from each one along its boundary."""
    follow = {}
    rings = face_rings(faces)
    for f, _, _, h in face_edges(faces):
        if twins[h] < 0:
            g = 4 * f + (h % 4 + 1) % len(rings[f])
            while twins[g] >= 0:
                g = twins[g]
                g = g // 4 * 4 + (g % 4 + 1) % len(rings[g // 4])
            follow[h] = g
    return plain_classes(follow, follow.items())


def corner_angles(points, ring):
    """Angles in degrees between the edges at each corner, between 0 and 180."""
    found = []
    for c, v in enumerate(ring):
        a = points[ring[c - 1]] - points[v]
        b = points[ring[(c + 1) % len(ring)]] - points[v]
        cosine = np.dot(a, b) / (np.linalg.norm(a) * np.linalg.norm(b))
        found.append(math.degrees(math.acos(min(1.0, max(-1.0, cosine)))))
    return found
