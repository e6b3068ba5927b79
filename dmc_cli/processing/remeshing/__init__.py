"""Reduce irregular vertices by local edge rotations, quad collapses and splits, by simulated annealing.

work        a mesh in regions, with a journal of changes
bench       what a sweep works on, set up
operations  rotate an edge, collapse a quad, split a vertex
patches     the quads that it changes, listed and measured side by side
checks      what an operation must leave, and what it is worth
chains      rotations that follow an operation until there is a gain
moves       how the vertices that it touches move
tracked_points  their nearest quads in a patch
inheritance  values of what is new
regions     the parts of the mesh that threads work on in a round
warp_accounts  what warp they may make more of
sweep       operations tried at irregular vertices
mend        high quads made lower, the worst better
rounds      the rounds in order
kernels     the modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
