"""A GPU places vertices one by one, a CPU sixteen at a time: the same vertices, bit for bit."""

import numpy as np
import pytest
import warp as wp

from dmc_cli.contouring import extract_surface
from dmc_cli.contouring.dual_marching_cubes.placement.exact_scalar import place_remaining_vertices_kernel
from dmc_cli.field import upload_volume
from dmc_cli.field.grid import kernel_matrix
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
def test_blocks_place_what_single_threads_place(border, dtype):
    noise = np.random.default_rng(2).standard_normal((17, 19, 45)) * 40 + 90
    values = np.clip(noise, 0, 250).astype(dtype)
    volume = Volume(values=values, affine=np.diag([0.7, 0.8, 2.0, 1.0]), space="LPS")
    device = select_device("cpu", 1)
    surface = extract_surface(upload_volume(volume, device), SurfaceSettings(isovalue=90.3, border=border))
    count = surface.mesh.vertex_count
    local = wp.full(count, wp.vec3(-1.0, -1.0, -1.0), dtype=wp.vec3, device="cpu")
    position = wp.empty_like(surface.mesh.positions)
    cells, polygons = surface.numbering.cells, surface.numbering.polygons
    inputs = [
        surface.placement.frame.grid.struct(),
        surface.placement.frame.field,
        kernel_matrix(surface.placement.frame.affine),
        1,
    ]
    inputs += [cells.ordinary_count, polygons.special, polygons.special_count, surface.placement.cell, 1]
    outputs = [local, position, wp.full(count, 1, dtype=wp.uint8, device="cpu")]
    device.launch(place_remaining_vertices_kernel, count, inputs, outputs)
    np.testing.assert_array_equal(local.numpy(), surface.placement.local.numpy())
    np.testing.assert_array_equal(position.numpy(), surface.mesh.positions.numpy())
