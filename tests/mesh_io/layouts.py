"""Every way to write a mesh: formats, and text beside binary where a format has both."""

from dmc_cli.mesh_formats import FORMATS

LAYOUTS = [
    (name, ascii)
    for name, known in FORMATS.items()
    for ascii in {"text": (True,), "binary": (False,), "either": (False, True)}[known.encoding]
]
"""Names, each with whether it is asked for as text."""

REORDERED = ("msh", "inp", "nas", "k", "medit")
"""Formats of solvers, where triangles and quads stand apart."""

EXACT = [
    (name, ascii)
    for name, ascii in LAYOUTS
    if FORMATS[name].holds_quads and name != "glb" and name not in REORDERED
]
"""Those that give each face back in its place and from its first corner on; GLB may begin at another."""


def rings(faces):
    """The corners of each face, three or four."""
    return [tuple(v for v in face if v >= 0) for face in faces.tolist()]


def turned(ring):
    """The corners from the least on: the same for every corner that a ring begins at."""
    first = ring.index(min(ring))
    return (*ring[first:], *ring[:first])
