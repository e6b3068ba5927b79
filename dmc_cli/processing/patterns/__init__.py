"""Simplify by patterns of valences (Grosso & Zint 2021, section 4).

masks            which quads have a pattern
simplify_3x3y    the pattern 3-X-3-Y
merged_vertices  where merged vertices go, and whether they may
removal_3x3y     its quads removed
simplify_3333    the pattern 3-3-3-3
simplification   the passes in order
kernels          the modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
