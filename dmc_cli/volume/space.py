"""Choose the space of the output: where grid indices go, and what its axes are called."""

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import SettingsError
from dmc_cli.settings import OutputSpace, OutputUnit
from dmc_cli.volume.checks import FARTHEST_MM
from dmc_cli.volume.volume import Space, Volume

RAS_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
"""RAS to LPS and back: x and y change their sign, which keeps the handedness."""


UNIT_LENGTHS: dict[OutputUnit, float] = {"mm": 1.0, "um": 1e-3, "nm": 1e-6, "m": 1e3}
"""Length in millimetres of the units that coordinates can be written in."""


def is_turned(space: Space, other: Space) -> bool:
    """Return whether one space is RAS and the other LPS; one that is not known is taken for the same."""
    return "none" not in (space, other) and space != other


def output_affine(volume: Volume, space: OutputSpace, unit: OutputUnit = "mm") -> tuple[Float64Array, Space]:
    """Return the map from node indices to the output space in a unit, shape (4, 4), and that space's name.

    Raises:
        SettingsError: RAS or LPS is asked of a volume without a space, or float32 holds no such coordinates.
    """
    affine, name = _in_millimetres(volume, space)
    if unit == "mm":
        return affine, name
    scaled = affine.copy()
    scaled[:3] *= 1.0 / UNIT_LENGTHS[unit]
    farthest = float((np.abs(scaled[:3, :3]) @ volume.shape + np.abs(scaled[:3, 3])).max())
    if not farthest <= FARTHEST_MM:
        raise SettingsError(
            f"--unit {unit} was asked for, but coordinates would be as large as {farthest:.2g}; expected at"
            f" most {FARTHEST_MM:.2g}, which float32 holds; choose a larger unit"
        )
    return scaled, name


def _in_millimetres(volume: Volume, space: OutputSpace) -> tuple[Float64Array, Space]:
    """Return the map from node indices to millimetres in the output space, or to indices, and its name."""
    if space == "native":
        return volume.affine, volume.space
    if space == "voxel":
        return np.eye(4), "none"
    if volume.space == "none":
        raise SettingsError(
            f"--space {space} was asked for, but {volume.path or 'the volume'} does not say how its axes"
            " lie in the patient; use --space native or voxel"
        )
    target: Space = "LPS" if space == "lps" else "RAS"  # tkrRAS is told relative to RAS
    return (volume.affine if volume.space == target else RAS_LPS @ volume.affine), target
