"""Find the affine of a stack's slices: their true positions, tilt and all, with nothing resampled.

The third axis runs from the first slice to the last, so a tilted gantry becomes a shear. Slices at
uneven distances keep them in a table of positions. What looks like a missing slice or like two slices
in one place is a question to the user, not to a tolerance.
"""

from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import AmbiguousVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice, notices
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom.distances import is_even
from dmc_cli.volume_io.dicom.doubts import contradictions_told
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.missing import between, length_text, missing_told
from dmc_cli.volume_io.dicom.pixels import is_same_image
from dmc_cli.volume_io.dicom.stack import Stack
from dmc_cli.volume_io.left_out import left_out

DRIFT_TOLD = 0.05
DRIFT_REFUSED = 0.5
"""Sideways distance of a slice from the line through the first and the last, in pixels."""


@dataclass(frozen=True, eq=False)
class SliceGeometry:
    """Where the slices of a volume lie.

    Attributes:
        frames: One frame a slice, in order.
        affine: Node index to LPS millimetres, shape (4, 4).
        slice_positions: As `Volume.slice_positions`.
        warnings: What the user is told.
    """

    frames: list[Frame]
    affine: Float64Array
    slice_positions: Float64Array | None
    warnings: tuple[Notice, ...]


def slice_geometry(stack: Stack, settings: ReadSettings, name: str) -> SliceGeometry:
    """Order a stack's slices, and return them with their distances and their affine.

    Raises:
        AmbiguousVolumeError: Duplicates or missing slices, unless the settings say what to do.
        UnsupportedFormatError: The slices do not lie along one line.
    """
    frames, places, notes = _without_duplicates(stack, settings, name)
    distances = np.diff(places)
    notes += missing_told(frames, places, stack, settings, name)
    first, last = np.array(frames[0].position), np.array(frames[-1].position)
    axis = (last - first) / (places[-1] - places[0])
    positions = np.array([frame.position for frame in frames])
    drift = positions - (first + np.outer(places - places[0], axis))
    notes += _drift(frames, np.linalg.norm(drift, axis=1), name)
    notes += contradictions_told(frames, places, float(np.linalg.norm(axis)))
    orientation = np.array(frames[0].orientation)
    affine = np.eye(4)
    affine[:3, 0] = orientation[:3] * frames[0].spacing[0]
    affine[:3, 1] = orientation[3:] * frames[0].spacing[1]
    affine[:3, 2] = (last - first) / (len(frames) - 1)
    affine[:3, 3] = first
    uneven = not is_even(places)
    table = (places - places[0]) * np.linalg.norm(axis) if uneven else None
    if uneven:
        least, most = (between(frames, distances, int(n)) for n in (distances.argmin(), distances.argmax()))
        told = f"slice distances vary from {least} to {most}; every slice is kept where it is"
        notes.append(Notice("W-SLICES-UNEVEN", told))
    return SliceGeometry(frames, affine, table, tuple(notes))


def _without_duplicates(
    stack: Stack, settings: ReadSettings, name: str
) -> tuple[list[Frame], Float64Array, list[Notice]]:
    """Return the frames and their places, one frame a place, and warnings of those dropped."""
    frames, places = stack.frames, stack.places
    closest = stack.same_place
    kept = [0]
    copies: dict[int, int] = {}
    for n in range(1, len(frames)):
        if places[n] - places[kept[-1]] >= closest:
            kept.append(n)
        else:
            copies[n] = kept[-1]
    dropped = list(copies)
    if dropped and settings.duplicates == "refuse":
        first = dropped[0]
        other = copies[first]
        raise AmbiguousVolumeError(
            f"{name}: {len(dropped)} of {len(frames)} slices lie where another one lies (closer than "
            f"{closest:.2g} mm), first {frames[other].name} and {frames[first].name}, "
            f"{length_text(places[first] - places[other])} mm apart; expected one slice a position; "
            "--duplicates first takes the first of true copies"
        )
    for n, other in copies.items():
        if not is_same_image(frames[other], frames[n], name):
            raise AmbiguousVolumeError(
                f"{name}: {frames[other].name} and {frames[n].name} lie in one place with other values, and "
                "nothing that is known tells them apart; expected copies, of which --duplicates first drops "
                "one; give the slices of one volume alone"
            )
    kinds = (f"{kind} in the place of another one" for kind in ("slice", "slices"))
    notes = notices("W-DUPLICATES-DROPPED", left_out([frames[n].name for n in dropped], *kinds))
    return [frames[n] for n in kept], places[kept], notes


def _drift(frames: list[Frame], sideways: Float64Array, name: str) -> list[Notice]:
    """Refuse slices far beside the line through the first and the last; return warnings of nearer ones."""
    pixel = min(frames[0].spacing)
    worst = int(sideways.argmax())
    told = f"{frames[worst].name} lies {sideways[worst]:.3f} mm beside the line from first to last slice"
    if sideways[worst] > DRIFT_REFUSED * pixel:
        raise UnsupportedFormatError(
            f"{name}: {told}; expected slices along one line; choose a series whose slices are not shifted"
        )
    return [Notice("W-SLICES-SHIFTED", told)] if sideways[worst] > DRIFT_TOLD * pixel else []
