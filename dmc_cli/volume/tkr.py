"""Give places as FreeSurfer's surfaces have them: tkrRAS, relative to the centre and the axes of a volume.

In tkrRAS the centre of a volume's nodes is 0, and its grid's axes point to left, down and front whatever they
are in the patient: the axes of FreeSurfer's own volumes. It is the mirror image of RAS where the grid is of
the other handedness.
"""

from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.volume.space import RAS_LPS
from dmc_cli.volume.volume import Volume

TKR_AXES = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Where the axes of a grid point to in tkrRAS, one a row."""

MOST_SKEWED = 1e-3
"""The largest cosine between two axes that are at right angles but for rounding."""


@dataclass(frozen=True, eq=False)
class VolumeGeometry:
    """Where the nodes of a volume lie, as FreeSurfer tells it beside a surface.

    Attributes:
        shape: Nodes along the grid's axes.
        spacing: Their distances in mm.
        axes: Directions of the grid's axes in RAS, one a row, (3, 3), at right angles.
        centre: The place in RAS of the grid's centre, which is node shape / 2.
    """

    shape: tuple[int, int, int]
    spacing: tuple[float, float, float]
    axes: Float64Array
    centre: Float64Array

    @property
    def to_ras(self) -> Float64Array:
        """Return the map from tkrRAS to RAS, shape (4, 4)."""
        found = np.eye(4)
        found[:3, :3] = self.axes.T @ TKR_AXES
        found[:3, 3] = self.centre
        return found

    @property
    def is_mirrored(self) -> bool:
        """Return whether tkrRAS is the mirror image of RAS."""
        return bool(np.linalg.det(self.to_ras) < 0)


def volume_geometry(volume: Volume) -> VolumeGeometry:
    """Return where the nodes of a volume lie.

    Raises:
        SettingsError: The volume has no space, or axes that are not at right angles.
    """
    if volume.space == "none":
        raise SettingsError(
            f"--space tkr was asked for, but {volume.path or 'the volume'} does not say how its axes lie in"
            " the patient; use --space native or voxel"
        )
    affine = volume.affine if volume.space == "RAS" else RAS_LPS @ volume.affine
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    axes = (affine[:3, :3] / spacing).T
    skew = float(np.abs(axes @ axes.T - np.eye(3)).max())
    if skew > MOST_SKEWED:
        raise SettingsError(
            f"--space tkr was asked for, but the axes of {volume.path or 'the volume'} are not at right"
            f" angles (cosine {skew:.3g}), which FreeSurfer cannot tell; use --space ras"
        )
    centre = affine[:3, :3] @ (np.array(volume.shape) / 2) + affine[:3, 3]
    shape, distances = (int(n) for n in volume.shape), (float(mm) for mm in spacing)
    return VolumeGeometry((*shape,), (*distances,), axes, centre)  # type: ignore[arg-type]
