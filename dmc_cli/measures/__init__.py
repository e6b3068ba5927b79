"""Measure any mesh.

topology          Euler characteristic, boundaries, manifoldness
components        connected components
vertex_fans       the fans of faces round vertices
shape             areas, angles, how square
quality           the measures of the papers
locate            the cell that a point lies in
deviation         how far vertices are from the surface
rounding          what writing in float32 costs
measure_rounding  its kernels
plain_values      numbers as JSON has them
"""

from types import ModuleType


def kernel_modules() -> list[ModuleType]:
    """Return the modules whose kernels a report needs, for loading them ahead of time."""
    from dmc_cli.measures import components, deviation, measure_rounding, quality, vertex_fans
    from dmc_cli.mesh import connect, twins

    return [components, deviation, measure_rounding, quality, twins, connect, vertex_fans]
