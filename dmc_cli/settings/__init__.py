"""Define every choice that a user can make, with its default: here and nowhere else.

The command line builds these dataclasses from its options (a test keeps both sides equal); the
Python API takes them as they are. Settings are immutable and hold plain values only.

types          what a setting may be, as its annotation says
checks         what settings of several kinds may be
choices        words that settings are chosen from
reading, synthesis  volumes read from files, and made
part, surface  which part of a volume is wanted, and which surface of it
mesh           what becomes of the quads
output         what is written, and what must hold
conversion, labels  commands: a surface at an isovalue, surfaces of labels
measurement, rework  commands: a mesh file measured, and made into another one
comparison, reproduction  commands: methods beside each other, the papers' tables
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
