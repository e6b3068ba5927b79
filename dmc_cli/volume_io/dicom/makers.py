"""List what makers keep in elements of their own: b-values, directions, parts of complex images.

A block of private elements belongs to whoever is named at its beginning (PS3.5, 7.8.1); the numbers here are
those within a block.
"""

BLOCKS = range(0x10, 0x18)
"""Blocks of a group that are looked at; makers have one or two."""

SIEMENS_GROUP, SIEMENS = 0x0019, "SIEMENS MR HEADER"
PHILIPS, PHILIPS_FRAMES = "Philips MR Imaging DD 001", "Philips MR Imaging DD 005"
PHILIPS_GROUP = 0x2005
PHILIPS_SCALE = (0x0E, 0x0D)
"""Slope and intercept of a scale of values, in a block of `PHILIPS`."""

PRIVATE: dict[tuple[int, str], dict[int, tuple[str, str]]] = {
    (SIEMENS_GROUP, SIEMENS): {0x0C: ("b-value", "IS"), 0x0E: ("gradient direction", "FD")},
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
    (PHILIPS_GROUP, PHILIPS): {
        0xB0: ("gradient x", "FL"),
        0xB1: ("gradient y", "FL"),
        0xB2: ("gradient z", "FL"),
    },
    (PHILIPS_GROUP, PHILIPS_FRAMES): {
        0x12: ("b-value number", "IS"),
        0x13: ("gradient number", "IS"),
        0x29: ("spin labelling", "CS"),
    },
}
"""Group and name of a block; number of an element in it; what it tells apart, and its type."""

GE = "GEMS_PARM_01"
GE_COMPONENTS = {"0": "MAGNITUDE", "1": "PHASE", "2": "REAL", "3": "IMAGINARY"}
GE_MOST = 100_000
"""b-values of GE have flags in the digits from here on."""

CSA_GROUP, CSA = 0x0029, "SIEMENS CSA HEADER"
"""Group and owner of the header that Siemens keeps beside the standard's elements; `csa.py` reads it."""

_GROUPS = dict.fromkeys([*(group for group, _ in PRIVATE), CSA_GROUP])

CREATORS = tuple(group << 16 | block for group in _GROUPS for block in BLOCKS)
"""Elements that name the owner of a block."""

KINDS = {
    group << 16 | block << 8 | number: kind
    for (group, _), members in PRIVATE.items()
    for number, (_, kind) in members.items()
    for block in BLOCKS
} | {PHILIPS_GROUP << 16 | block << 8 | number: "FL" for number in PHILIPS_SCALE for block in BLOCKS}
"""All elements of the makers, in any block, and their types."""
