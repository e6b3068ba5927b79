"""Tell the elements of Abaqus that are faces by their names."""

import re

FAMILIES = "S|DS|M3D|SFM3D|R3D|F3D|CPS|CPE|CPEG|CAX|DC2D|DCAX|AC2D|ACAX"
"""What names of elements with faces begin with: shells, membranes, surfaces, rigid ones, plane ones."""

NAME = re.compile(rf"(?:(?:{FAMILIES})([3-9])|STRI([36]))(?:\D.*|5)?")
"""A family, the number of nodes, and letters of what else it is; STRI65 has six nodes, of five freedoms."""

KINDS = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8", "9": "quad9"}


def kind_of(name: str) -> str:
    """Return the kind of an element: triangle, quad, triangle6, quad8, quad9, or its own name."""
    found = NAME.fullmatch(name)
    return name if found is None else KINDS.get(found[1] or found[2], name)
