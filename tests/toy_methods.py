"""Two methods of contouring beside those of the package: surface nets in NumPy, and these cut to triangles.

    python -m tests.toy_methods convert synth:sphere:12 ball.ply -i 0 --method toy

Registered by a line each, as methods of the package are; whatever else they need they declare.
"""

import sys

import numpy as np
import warp as wp

from dmc_cli import methods
from dmc_cli.methods import Cost, Memory, Method, later

LINES = {"toy": f"{__name__}:NETS", "cut": f"{__name__}:TRIANGLES"}


def nets(volume, settings, affine, even_slices, reserve):
    """A vertex in each active cell, in its middle or lower; a quad round each crossed edge."""
    return _surface(volume, settings, affine, reserve, is_cut=False)


def triangles(volume, settings, affine, even_slices, reserve):
    return _surface(volume, settings, affine, reserve, is_cut=True)


def _surface(volume, settings, affine, reserve, *, is_cut):
    from dmc_cli.contouring import Surface, SurfaceCounts
    from dmc_cli.field import grid_affine, grid_of, make_field, slice_depths
    from dmc_cli.mesh import Mesh, Placement, SurfaceFrame

    values, device = volume.volume.values.transpose(2, 1, 0), volume.device
    inside = values >= settings.isovalue
    corners = np.stack([_shifted(inside, (c & 1, c >> 1 & 1, c >> 2)) for c in range(8)])
    is_active = corners.any(axis=0) & ~corners.all(axis=0)
    node = np.argwhere(is_active)
    faces = _quads(inside, np.cumsum(is_active).reshape(is_active.shape) - 1)
    if is_cut:
        faces = np.concatenate([faces[:, [0, 1, 2, 2]], faces[:, [0, 2, 3, 3]]])
        faces[:, 3] = -1
    if reserve is not None:
        reserve(len(node), len(faces), cells=0)
    grid = grid_of(volume.volume.shape, border=0)
    target = grid_affine(volume.volume.affine if affine is None else affine, grid)
    frame = SurfaceFrame(
        make_field(volume, settings), grid, target, slice_depths(None, grid, device), -1.0, device
    )
    mean = 0.25 if settings.placement == "low" else 0.5
    placement = Placement(
        wp.array(node @ [1, grid.nx, grid.nx * grid.ny], dtype=wp.int64, device=device.name),
        wp.array(np.full((len(node), 3), mean), dtype=wp.vec3f, device=device.name),
        frame,
    )
    mesh = Mesh(
        placement.positions(),
        wp.array(faces.astype(np.int32), dtype=wp.vec4i, device=device.name),
        device,
        triangle_count=len(faces) if is_cut else 0,
    )
    return Surface(mesh, placement, SurfaceCounts(active_cells=len(node), no_data_nodes=0), settings.method)


def _shifted(inside, step):
    """Return what is a step further along x, y and z, at the lowest nodes of cells."""
    return inside[tuple(slice(s, n - 1 + s) for s, n in zip(step, inside.shape, strict=True))]


def _quads(inside, number):
    """Return the vertices of the quads, anticlockwise from outside, (F, 4)."""
    found = []
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        low, high = np.delete(inside, -1, axis), np.delete(inside, 0, axis)
        for start, end, order in ((low, high, (0, 1, 2, 3)), (high, low, (3, 2, 1, 0))):
            edges = np.argwhere(start & ~end)
            least, most = edges[:, across].min(axis=1), np.array(inside.shape)[across] - 1
            edges = edges[(least > 0) & (edges[:, across] < most).all(axis=1)]
            quad = []
            for b, c in ((1, 1), (0, 1), (0, 0), (1, 0)):
                cell = edges.copy()
                cell[:, across] -= (b, c)
                quad.append(number[tuple(cell.T)])
            found.append(np.stack(quad, axis=1)[:, order])
    return np.concatenate(found)


def no_kernels(settings):
    return []


NETS = Method(
    title="toy surface nets",
    faces="quads",
    options={"placement": ("middle", "low")},
    on_surface=frozenset(),
    extract=later(f"{__name__}:nets"),
    kernels=no_kernels,
    memory=Memory(extracting=Cost(vertex=100)),
)
TRIANGLES = Method(
    title="toy triangles",
    faces="triangles",
    options={},
    on_surface=frozenset(),
    extract=later(f"{__name__}:triangles"),
    kernels=no_kernels,
)

if __name__ == "__main__":
    methods.METHODS.update(
        {name: f"tests.toy_methods:{place.split(':')[1]}" for name, place in LINES.items()}
    )
    from dmc_cli.cli import main

    sys.argv[0] = "dmc"
    main()
