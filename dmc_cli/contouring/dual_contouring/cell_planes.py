"""Place vertices by the planes that touch the surface at the crossings of their cells.

A plane is a crossing and its unit normal: the gradients at the ends of the edge, interpolated. What is summed
gives the point of the least sum of squared distances from the planes (Ju et al. 2002; equation 1 of Schmitz
et al. 2009), and the force that draws a particle there (their equation 2). In C++: on CPU sixteen cells side
by side, on a GPU one, by the same text.
"""

import warp as wp

from dmc_cli.bits import LANES
from dmc_cli.contouring.dual_contouring.corner_gradients import CornerGradients
from dmc_cli.field import CornerValues
from dmc_cli.runtime import native

CellLanes = wp.types.vector(length=32 * LANES, dtype=wp.float32)
"""F and its derivatives along x, y and z at the corners of sixteen cells: of each, corner after corner."""

X, Y, Z = wp.constant(8 * LANES), wp.constant(16 * LANES), wp.constant(24 * LANES)
"""Where the derivatives along x, y and z begin in `CellLanes`."""

PlacedLanes = wp.types.vector(length=4 * LANES, dtype=wp.float32)
"""Local coordinates of sixteen vertices, coordinate after coordinate, and what became of them."""

OUTSIDE, LEFT = wp.constant(1), wp.constant(2)
"""What became of a vertex: it lay outside its cell and was drawn in, it needs more than single precision."""

LEAST_ERROR = -1
"""What stands for `qef` where a kernel takes a number of steps."""


@wp.func_native(native(__file__, "place_gathered"))
def place_gathered(corners: CellLanes, steps: wp.int32, step_size: wp.float32) -> PlacedLanes:
    """Place the vertices of sixteen cells."""
    ...


@wp.func_native(native(__file__, "place_one"))
def place_one(f: CornerValues, slopes: CornerGradients, steps: wp.int32, step_size: wp.float32) -> wp.vec4:
    """Place the vertex of a cell by what is at its corners; the fourth number says what became of it."""
    ...
