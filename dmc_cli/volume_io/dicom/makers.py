"""List what makers keep in elements of their own: b-values, directions, parts of complex images.

A block of private elements belongs to whoever is named at its beginning (PS3.5, 7.8.1); the numbers here are
those within a block.
"""

BLOCKS = range(0x10, 0x18)
"""Blocks of a group that are looked at; makers have one or two."""

PRIVATE: dict[tuple[int, str], dict[int, tuple[str, str]]] = {
    (0x0019, "SIEMENS MR HEADER"): {0x0C: ("b-value", "IS"), 0x0E: ("gradient direction", "FD")},
    (0x0019, "GEMS_ACQU_01"): {
        0xBB: ("gradient x", "DS"),
        0xBC: ("gradient y", "DS"),
        0xBD: ("gradient z", "DS"),
    },
    (0x0043, "GEMS_PARM_01"): {0x39: ("b-value", "IS"), 0x2F: ("complex component", "SS")},
    (0x0065, "Image Private Header"): {0x09: ("b-value", "FD"), 0x37: ("gradient direction", "FD")},
    (0x2001, "Philips Imaging DD 001"): {
        0x03: ("b-value", "FL"),
        0x04: ("diffusion", "CS"),
        0x08: ("phase number", "IS"),
    },
    (0x2005, "Philips MR Imaging DD 001"): {
        0xB0: ("gradient x", "FL"),
        0xB1: ("gradient y", "FL"),
        0xB2: ("gradient z", "FL"),
    },
}
"""Group and name of a block; number of an element in it; what it tells apart, and its type."""

GE = "GEMS_PARM_01"
GE_COMPONENTS = {"0": "MAGNITUDE", "1": "PHASE", "2": "REAL", "3": "IMAGINARY"}
GE_MOST = 100_000
"""b-values of GE have flags in the digits from here on."""

CREATORS = tuple(dict.fromkeys(group << 16 | block for group, _ in PRIVATE for block in BLOCKS))
"""Elements that name the owner of a block."""

KINDS = {
    group << 16 | block << 8 | number: kind
    for (group, _), members in PRIVATE.items()
    for number, (_, kind) in members.items()
    for block in BLOCKS
}
"""All elements of the makers, in any block, and their types."""
