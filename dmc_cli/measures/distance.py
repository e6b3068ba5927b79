"""Measure how far two meshes are from each other, both ways, by samples of their surfaces.

Samples are spread over one mesh by its area, and the nearest point of the other is found for each (Cignoni et
al. 1998, *Metro*). The largest distance looks at the vertices, too; it is what is known of the Hausdorff
distance, which is no smaller.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import CallError, SettingsError
from dmc_cli.measures.nearest import NearestFaces
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.sampling import sample_surface
from dmc_cli.mesh import Mesh, require_mesh

SAMPLES = 250_000
"""Samples on the larger mesh, where no density is given."""


@dataclass(frozen=True, kw_only=True)
class OneWayDistance:
    """Distances from one mesh to another, in the unit of the coordinates; None without samples.

    Attributes:
        samples: Points that were measured.
        mean: Mean distance of the samples.
        rms: Root of the mean square.
        percentile_95: What 95 % of the samples do not exceed.
        max: Largest distance of a sample or of a vertex.
    """

    samples: int
    mean: float | None
    rms: float | None
    percentile_95: float | None
    max: float | None


@dataclass(frozen=True, kw_only=True)
class MeshDistance:
    """Distances between two meshes.

    Attributes:
        density: Samples on a unit of area.
        to_other: From the first mesh to the second.
        from_other: From the second to the first.
        both: Of all samples together; the largest is the Hausdorff distance, as far as samples know it.
    """

    density: float | None
    to_other: OneWayDistance
    from_other: OneWayDistance
    both: OneWayDistance


def measure_distance(mesh: Mesh, other: Mesh, density: float | None = None) -> MeshDistance:
    """Measure the distance between two meshes in the same coordinates, both ways.

    Args:
        mesh: The first.
        other: The second, on the same device.
        density: Samples on a unit of area; without it, a quarter of a million on the larger area.

    Raises:
        CallError: One is no mesh, names vertices that it does not have, or has no face; or they are on two
            devices.
        SettingsError: The density is no positive number, or makes too many samples.
    """
    for one in (mesh, other):
        if not require_mesh(one).face_count:
            raise CallError("a mesh without faces was found; expected two surfaces")
    if mesh.device.name != other.device.name:
        raise CallError(
            f"meshes on {mesh.device.name} and {other.device.name} were found; expected one device"
        )
    if density is None:
        area = max(measure_quality(one).area for one in (mesh, other))
        density = SAMPLES / area if area > 0 else None
    elif not 0 < density < np.inf:
        raise SettingsError(f"density is {density}; expected a positive number of samples on a unit of area")
    there, there_corners = _distances(mesh, other, density)
    back, back_corners = _distances(other, mesh, density)
    return MeshDistance(
        density=density,
        to_other=_summed(there, there_corners),
        from_other=_summed(back, back_corners),
        both=_summed(np.concatenate([there, back]), np.concatenate([there_corners, back_corners])),
    )


def _distances(mesh: Mesh, other: Mesh, density: float | None) -> tuple[Float64Array, Float64Array]:
    """Return the distances of a mesh's samples and of its vertices from another one."""
    used = np.zeros(mesh.vertex_count, bool)
    corners = mesh.corners.numpy()
    used[corners[corners >= 0]] = True
    vertices = mesh.positions.numpy()[used].astype(np.float64)
    nearest = NearestFaces(other)
    at_vertices = nearest.distances(wp.array(vertices, dtype=wp.vec3d, device=mesh.device.name))
    if density is None:
        return np.empty(0), at_vertices
    return nearest.distances(sample_surface(mesh, density)), at_vertices


def _summed(samples: Float64Array, vertices: Float64Array) -> OneWayDistance:
    """Return what is told of distances."""
    largest = max(samples.max(initial=0.0), vertices.max(initial=0.0))
    if not len(samples):
        return OneWayDistance(samples=0, mean=None, rms=None, percentile_95=None, max=float(largest))
    return OneWayDistance(
        samples=len(samples),
        mean=float(samples.mean()),
        rms=float(np.sqrt(np.square(samples).mean())),
        percentile_95=float(np.percentile(samples, 95)),
        max=float(largest),
    )
