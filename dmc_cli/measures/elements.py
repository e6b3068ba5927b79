"""Measure the faces of a mesh as finite elements: Verdict's measures, radius ratios, means and worst values.

Definitions are in `verdict.py`. Sums run in double precision over blocks of faces, then over the blocks in
their order: the same mesh gives the same figures, whatever the number of threads.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from dmc_cli.measures.quality import point_at
from dmc_cli.measures.verdict import INFINITE, NAMES, NUMBERS, FaceNumbers, quad_numbers, triangle_numbers
from dmc_cli.mesh import Mesh, require_mesh

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(256)
"""Faces that one thread sums over."""


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Shapes of the faces as finite elements.

    Those of quads are None without quads, those whose name begins with `triangle` without triangles, ratios
    without faces.

    Attributes:
        scaled_jacobian_mean: Mean of Verdict's scaled Jacobian over the quads, 1 on squares.
        aspect_ratio_mean: Mean of Verdict's aspect ratio over the quads, 1 on squares; infinite, as the
            largest one, if a quad has no area.
        aspect_ratio_max: The largest.
        skew_mean: Mean of Verdict's skew: the cosine between the middle lines of a quad, 0 on rectangles.
        skew_max: The largest.
        taper_mean: Mean of Verdict's taper: 0 on parallelograms.
        taper_max: The largest.
        stretch_mean: Mean of Verdict's stretch: the shortest side over the longest diagonal, 1 on squares.
        stretch_min: The least.
        warpage_mean: Mean of the larger angle between normals at opposite corners, degrees.
        mean_ratio_min: Least of equation 8 over the triangles, quads split by the MaxMin-angle criterion.
        radius_ratio_mean: Mean over the same triangles of twice the inscribed radius over the circumscribed
            one, 1 on equilateral ones.
        radius_ratio_min: The least.
        triangle_scaled_jacobian_mean: Mean of Verdict's scaled Jacobian over the triangles of the mesh.
        triangle_scaled_jacobian_min: The least.
        triangle_aspect_ratio_mean: Mean of Verdict's aspect ratio over the triangles of the mesh.
        triangle_aspect_ratio_max: The largest.
    """

    scaled_jacobian_mean: float | None
    aspect_ratio_mean: float | None
    aspect_ratio_max: float | None
    skew_mean: float | None
    skew_max: float | None
    taper_mean: float | None
    taper_max: float | None
    stretch_mean: float | None
    stretch_min: float | None
    warpage_mean: float | None
    mean_ratio_min: float | None
    radius_ratio_mean: float | None
    radius_ratio_min: float | None
    triangle_scaled_jacobian_mean: float | None
    triangle_scaled_jacobian_min: float | None
    triangle_aspect_ratio_mean: float | None
    triangle_aspect_ratio_max: float | None


@wp.func
def face_numbers(
    points: wp.array[wp.vec3f], corners: wp.array[wp.int32], face: wp.int32, origin: wp.vec3d
) -> FaceNumbers:
    """Measure a face of a mesh."""
    a = point_at(points, corners[4 * face], origin)
    b = point_at(points, corners[4 * face + 1], origin)
    c = point_at(points, corners[4 * face + 2], origin)
    if corners[4 * face + 3] < 0:
        return triangle_numbers(a, b, c)
    return quad_numbers(a, b, c, point_at(points, corners[4 * face + 3], origin))


@wp.kernel
def sum_elements_kernel(
    first: wp.int32,
    # In:
    points: wp.array[wp.vec3f],
    corners: wp.array[wp.int32],
    origin: wp.vec3d,
    # Out:
    sums_out: wp.array2d[wp.float64],
    lows_out: wp.array2d[wp.float64],
    highs_out: wp.array2d[wp.float64],
) -> None:
    """Sum the numbers of a block's faces, and find the least and largest. One thread per block.

    Rows are the block's quads, then its triangles; what these have not is NaN.
    """
    block = first + wp.tid()
    for n in range(2 * NUMBERS):
        row = 2 * block + n / NUMBERS
        sums_out[row, n % NUMBERS] = wp.float64(0.0)
        lows_out[row, n % NUMBERS] = INFINITE
        highs_out[row, n % NUMBERS] = -INFINITE
    for face in range(block * BLOCK, wp.min((block + 1) * BLOCK, corners.shape[0] / 4)):
        row = int(2 * block)
        if corners[4 * face + 3] < 0:
            row += 1
        found = face_numbers(points, corners, face, origin)
        for n in range(NUMBERS):
            sums_out[row, n] = sums_out[row, n] + found[n]
            lows_out[row, n] = wp.min(lows_out[row, n], found[n])
            highs_out[row, n] = wp.max(highs_out[row, n], found[n])


def measure_elements(mesh: Mesh) -> Elements:
    """Measure the faces of a mesh as finite elements.

    Raises:
        CallError: It is no mesh, or its faces name vertices that it does not have.
    """
    require_mesh(mesh)
    blocks = -(-mesh.face_count // int(BLOCK))
    tables = [mesh.device.empty((2 * blocks, NUMBERS), wp.float64) for _ in range(3)]
    inputs = [mesh.positions, mesh.corners, mesh_origin(mesh)]
    mesh.device.launch(sum_elements_kernel, blocks, inputs, tables)
    sums, lows, highs = (table.numpy().reshape(-1, 2, NUMBERS) for table in tables)
    kinds = ("quads", "triangles")
    total = dict(zip(kinds, sums.sum(axis=0), strict=True))
    least = dict(zip(kinds, lows.min(axis=0, initial=np.inf), strict=True))
    most = dict(zip(kinds, highs.max(axis=0, initial=-np.inf), strict=True))
    counts = {"quads": mesh.face_count - mesh.triangle_count, "triangles": mesh.triangle_count}

    def mean(name: str, kind: str = "quads") -> float | None:
        return float(total[kind][NAMES.index(name)]) / counts[kind] if counts[kind] else None

    def end(ends: dict[str, Any], name: str, kind: str = "quads") -> float | None:
        return float(ends[kind][NAMES.index(name)]) if counts[kind] else None

    def ratios(name: str) -> tuple[float | None, float | None]:
        """Return mean and least of a ratio over all triangles, those of quads included."""
        first, second, pieces = (
            NAMES.index(name),
            NAMES.index(name) + 1,
            2 * counts["quads"] + counts["triangles"],
        )
        if not pieces:
            return None, None
        parts = [total["quads"][first], total["quads"][second]] * (counts["quads"] > 0)
        parts += [total["triangles"][first]] * (counts["triangles"] > 0)
        low = min(*least["quads"][first : second + 1], least["triangles"][first])
        return float(sum(parts)) / pieces, float(low)

    return Elements(
        scaled_jacobian_mean=mean("scaled_jacobian"),
        aspect_ratio_mean=mean("aspect_ratio"),
        aspect_ratio_max=end(most, "aspect_ratio"),
        skew_mean=mean("skew"),
        skew_max=end(most, "skew"),
        taper_mean=mean("taper"),
        taper_max=end(most, "taper"),
        stretch_mean=mean("stretch"),
        stretch_min=end(least, "stretch"),
        warpage_mean=mean("warpage"),
        mean_ratio_min=ratios("mean_ratio")[1],
        radius_ratio_mean=ratios("radius_ratio")[0],
        radius_ratio_min=ratios("radius_ratio")[1],
        triangle_scaled_jacobian_mean=mean("scaled_jacobian", "triangles"),
        triangle_scaled_jacobian_min=end(least, "scaled_jacobian", "triangles"),
        triangle_aspect_ratio_mean=mean("aspect_ratio", "triangles"),
        triangle_aspect_ratio_max=end(most, "aspect_ratio", "triangles"),
    )


def mesh_origin(mesh: Mesh) -> Any:
    """Return a point of the mesh, which coordinates are taken from to keep their digits."""
    if not mesh.vertex_count:
        return wp.vec3d()
    return wp.vec3d(*np.asarray(mesh.positions[:1].numpy()[0], np.float64).tolist())
