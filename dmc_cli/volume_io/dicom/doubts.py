"""Tell what else a file says of the geometry that contradicts its positions, which are taken."""

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.notices import Notice, notices
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.distances import ALIKE, shared_distance
from dmc_cli.volume_io.dicom.frames import Frame

TURN_TOLD = 0.05
"""Largest distance of a slice's last node, in pixels, that is not told."""

SAME = 0.01
"""Largest relative difference of lengths that are the same."""

STEEPEST = 1.5
"""Length along the slices' line for one along their normal; a gantry tilted by 45 degrees has 1.41."""


def contradictions_told(frames: list[Frame], places: Float64Array, stretch: float) -> list[Notice]:
    """Return notices on what contradicts the positions of slices.

    Args:
        frames: The slices, in order.
        places: Their positions along the normal in millimetres.
        stretch: Length along the line from the first to the last for one along the normal.
    """
    told = [*_ratio_told(frames[0]), *_magnified_told(frames[0])]
    if not frames[0].is_placed:
        return notices("W-GEOMETRY-CONTRADICTED", told)
    stated = frames[0].stated_step
    usual = shared_distance(places, copies=False)
    # some state the distance along the line, some along the normal, some the space that slices leave
    lengths = (usual, usual * stretch, usual - (frames[0].thickness or 0.0))
    if stated and not any(abs(stated - length) <= ALIKE * usual for length in lengths):
        told.append(
            f"SpacingBetweenSlices {stated:g} mm found, but positions {usual:.4g} mm apart; the "
            "positions are taken"
        )
    if stretch > STEEPEST:
        angle = np.degrees(np.arccos(1 / stretch))
        told.append(
            f"slices that follow each other {angle:.0f} degrees beside their normal found, farther than any "
            "gantry is tilted; positions and directions are taken as they are"
        )
    told += _turns_told(frames)
    found = {frame.labels.get("frame of reference", "") for frame in frames} - {""}
    if len(found) > 1:
        told.append(
            f"slices of {len(found)} frames of reference (0020,0052) found, whose positions need not be "
            "comparable; they are taken as if they were"
        )
    return notices("W-GEOMETRY-CONTRADICTED", told)


def _ratio_told(frame: Frame) -> list[str]:
    """Return a sentence on pixels whose stated shape is not that of their distances."""
    dataset = frame.header.dataset
    ratio, pixel = (elements.numbers(dataset, tag) or [] for tag in (0x00280034, 0x00280030))
    if len(ratio) != 2 or len(pixel) != 2 or min(*ratio, *pixel) <= 0:
        return []
    wanted = ratio[0] / ratio[1]
    if abs(wanted - pixel[0] / pixel[1]) <= ALIKE * wanted:
        return []
    return [
        f"PixelAspectRatio {ratio[0]:g}:{ratio[1]:g} found beside PixelSpacing {pixel[0]:g}, {pixel[1]:g} "
        "mm; the spacing is taken"
    ]


def _magnified_told(frame: Frame) -> list[str]:
    """Return a sentence on pixels whose distance is that on a detector farther away than the body."""
    dataset = frame.header.dataset
    pixel, imager, factor = (elements.numbers(dataset, tag) for tag in (0x00280030, 0x00181164, 0x00181114))
    if not pixel or not imager or not factor or abs(factor[0] - 1) <= SAME or factor[0] <= 0:
        return []
    if abs(pixel[0] - imager[0]) > SAME * imager[0]:
        return []
    return [
        f"PixelSpacing {pixel[0]:g} mm found, that at the detector (ImagerPixelSpacing), beside "
        f"EstimatedRadiographicMagnificationFactor {factor[0]:g}, by which lengths in the body are smaller; "
        "the spacing is taken"
    ]


def _turns_told(frames: list[Frame]) -> list[str]:
    """Return a sentence on slices whose last node is not where the first slice's directions put it."""
    columns, rows = frames[0].pixels.shape
    directions = np.array([frame.orientation for frame in frames])
    lengths = np.array([frame.spacing for frame in frames]) * (columns - 1, rows - 1)
    corners = directions[:, :3] * lengths[:, :1] + directions[:, 3:] * lengths[:, 1:]
    off = np.linalg.norm(corners - corners[0], axis=1)
    worst = int(off.argmax())
    if off[worst] <= TURN_TOLD * min(frames[0].spacing):
        return []
    return [
        f"directions or pixel spacings that vary found: the last node of {frames[worst].name} is "
        f"{off[worst]:.3g} mm beside the others'; those of the first slice are taken"
    ]
