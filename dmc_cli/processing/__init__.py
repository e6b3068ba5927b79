"""Algorithms on a mesh, a folder each.

patterns/         quads removed where valences have a pattern: 3-X-3-Y, 3-3-3-3 (Grosso & Zint 2021)
relaxation/       vertices smoothed on the surface
remeshing/        irregular vertices removed by local operations
quad_square       how far a quad is from a square
tangent_step      a vertex's step along the surface
surface_distance  how far points are from the surface
color_repair      different colours for quads that have become neighbours
distance_guard    points of the mesh before that the new one must not leave behind
"""

from types import ModuleType


def kernel_modules(*, simplify: bool = False, relax: bool = False, remesh: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels the stages need, for loading them ahead of time."""
    modules: list[ModuleType] = []
    if simplify:
        from dmc_cli.bits import selection
        from dmc_cli.mesh import compaction, valences
        from dmc_cli.processing import color_repair
        from dmc_cli.processing.patterns import masks, removal_3x3y, simplify_3x3y, simplify_3333

        modules += [selection, color_repair, masks, simplify_3x3y, removal_3x3y, simplify_3333]
        modules += [compaction, valences]
    if remesh:
        from dmc_cli.processing import distance_guard
        from dmc_cli.processing.remeshing import blocks, inheritance, mend, sweep

        modules += [distance_guard, blocks, sweep, mend, inheritance]
    if relax or remesh:
        from dmc_cli.processing.relaxation import relax as relaxation
        from dmc_cli.processing.relaxation import relax_checks

        modules += [relaxation, relax_checks]
    return modules
