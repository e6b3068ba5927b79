"""Choose the space of the output: where grid indices go, and what its axes are called."""

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.settings import OutputSpace
from dmc_cli.volume.volume import Space, Volume

RAS_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
"""RAS to LPS and back: x and y change their sign, which keeps the handedness."""


def output_affine(volume: Volume, space: OutputSpace) -> tuple[Float64Array, Space]:
    """Return the map from node indices to the output space, shape (4, 4), and that space's name.

    Raises:
        SettingsError: RAS or LPS is asked of a volume without a space.
    """
    if space == "native":
        return volume.affine, volume.space
    if space == "voxel":
        return np.eye(4), "none"
    if volume.space == "none":
        raise SettingsError(
            f"--space {space} was asked for, but {volume.path or 'the volume'} does not say how its axes"
            " lie in the patient; use --space native or voxel"
        )
    target: Space = "RAS" if space == "ras" else "LPS"
    return (volume.affine if volume.space == target else RAS_LPS @ volume.affine), target
