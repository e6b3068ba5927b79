"""Reduce irregular vertices by local edge rotations, quad collapses and splits, by simulated annealing.

work        a mesh in regions, with a journal of changes
operations  rotate an edge, collapse a diagonal, open a quad
checks      what an operation must leave, and what it is worth
chains      rotations that follow an operation until there is a gain
moves       how the vertices that it touches move
tracked_points  their nearest quads in a patch
inheritance  values of what is new
regions     the parts of the mesh that threads work on in a round
sweep       operations tried at irregular vertices
mend        high quads made lower, the worst better
rounds      the rounds in order
"""
