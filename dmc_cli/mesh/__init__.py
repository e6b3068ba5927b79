"""The quad mesh after its surface: connectivity, colours, simplification, in the order of the papers.

quad_ranks       numbers of the quads round grid edges, as ranks
plain_twins      twins through faces that are not ambiguous
grid_twins       twins of halfedges, from the cell faces' segments
plain_rings      a halfedge and the valence of ordinary cells' vertices
vertex_rings     a halfedge and the valence of each vertex
halfedges        the halfedge structure
color_words      colours of the quads of whole rows
coloring         colours of vertices and quads
working_mesh     a mesh while quads are being removed
selection        sets of quads or vertices
fetch            memory asked for ahead
patterns         which quads have a pattern of valences
simplify_3x3y    the pattern 3-X-3-Y
project          the nearest point of the surface
merged_vertices  where merged vertices go, and whether they may
removal_3x3y     their quads removed
simplify_3333    the pattern 3-3-3-3
compaction       renumbering without gaps
simplify         the passes in order
quad_square      how far a quad is from a square
glide            a vertex's step along the surface
heights          how far points are from the surface
guests           points that the mesh must not leave behind
relax_checks     whether a step of smoothing may be taken
relax            smoothing on the surface
more_work        a mesh in blocks, with a journal of changes
more_operations  rotate an edge, collapse a diagonal, open a quad
more_checks      what an operation must leave, and what it is worth
more_chains      rotations that follow an operation until there is a gain
more_moves       how the vertices that it touches move
more_guests      how it finds hosts for guests
more_mesh        the mesh between rounds
more_blocks      who works where in a round
more_sweep       operations tried at irregular vertices
more_mend        high quads made lower, the worst better
more             the rounds in order
near_frame       the frame in which a mesh is changed
check            invariants of a finished mesh
check_halfedges  invariants of a halfedge structure
"""

from types import ModuleType


def kernel_modules(
    *, simplify: bool = False, colors: bool = False, relax: bool = False, more: bool = False
) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time."""
    from dmc_cli.mesh import coloring, grid_twins, quad_ranks, selection, vertex_rings

    modules = [quad_ranks, grid_twins, vertex_rings]
    if colors or simplify:
        modules += [coloring, selection]
    if simplify:
        from dmc_cli.mesh import compaction, patterns, removal_3x3y, simplify_3x3y, simplify_3333, valences

        modules += [patterns, simplify_3x3y, removal_3x3y, simplify_3333, compaction, valences]
    if more:
        from dmc_cli.mesh import guests, more_blocks, more_mend, more_mesh, more_sweep

        modules += [guests, more_mesh, more_blocks, more_sweep, more_mend]
    if relax or more:
        from dmc_cli.mesh import relax as relaxation
        from dmc_cli.mesh import relax_checks

        modules += [relaxation, relax_checks]
    return modules
