"""Find where one image of a DICOM file lies: its position, directions and spacing.

Single-frame images tell this in their own elements, enhanced ones in functional groups, shared by all
frames or one a frame.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.notices import Notice
from dmc_cli.volume import FARTHEST_MM
from dmc_cli.volume_io.dicom import elements

Triple = tuple[float, float, float]

WORST_COSINES = 0.01
"""Squared lengths of directions, and their product, may be off by so much; beyond it the file is damaged."""

NO_POSITION = "no position or orientation"

ROUNDING_TOLD = 1e-4
COSINES_TOLD = (
    "rounded direction cosines found, which are not of length 1 and perpendicular; the nearest that are "
    "are taken"
)

OUTSIDE_PATIENT = (
    "positions in an ultrasound volume's own frame of reference found; how it lies in the patient is not told"
)

OTHER_SPACINGS = {
    0x00181164: ("ImagerPixelSpacing", "of the detector"),
    0x00182010: ("NominalScannedPixelSpacing", "of a scanned film"),
}

ROUNDING = 1e-9
"""Cosines that are off by less are taken as they are told."""


class NoSlice(Exception):  # noqa: N818 -- not an error: most folders hold files that are no slices
    """A DICOM file that is no slice of a volume; the text tells why."""


def _check_spacing(spacing: list[float]) -> None:
    if not all(0 < length <= FARTHEST_MM for length in spacing):
        raise DamagedVolumeError(
            f"pixel spacing {spacing} found; expected positive lengths up to {FARTHEST_MM:.2g} mm"
        )


def _check_place(millimetres: list[float]) -> None:
    if not max(map(abs, millimetres)) <= FARTHEST_MM:
        told = ", ".join(f"{number:g}" for number in millimetres)
        raise DamagedVolumeError(
            f"a slice at {told} mm found; expected coordinates that float32 holds, up to {FARTHEST_MM:.2g}; "
            "get the file again"
        )


@lru_cache(maxsize=256)
def unit_directions(cosines: tuple[float, ...]) -> tuple[tuple[float, ...], float]:
    """Return the directions of x and y with length 1 and perpendicular, and how far the file's were off.

    Files round their cosines, some to two digits.

    Raises:
        DamagedVolumeError: They are neither, by far.
    """
    x, y = np.array(cosines[:3]), np.array(cosines[3:])
    if abs(x @ x - 1) > WORST_COSINES or abs(y @ y - 1) > WORST_COSINES or abs(x @ y) > WORST_COSINES:
        raise DamagedVolumeError(
            f"orientation {list(cosines)} found; expected two perpendicular directions of length 1"
        )
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    # sum and difference of two unit vectors are perpendicular; halfway between them lie the nearest such two
    along, across = (x + y) / np.linalg.norm(x + y), (x - y) / np.linalg.norm(x - y)
    unit = np.concatenate([along + across, along - across]) / np.sqrt(2)
    off = float(np.abs(unit - cosines).max())
    return (tuple(unit.tolist()), off) if off > ROUNDING else (cosines, 0.0)


@dataclass(frozen=True)
class Place:
    """Where to look up a frame's elements: its own group, the shared one, the data set, its detector."""

    dataset: Any
    shared: Any
    own: Any
    detector: Any = None

    def find(self, sequence: int, tag: int) -> Any:
        """Return the data set that holds an element."""
        for group in (self.own, self.shared):
            for item in elements.items(group, sequence)[:1]:
                if tag in item:
                    return item
        if tag in self.dataset:
            return self.dataset
        return self.detector if self.detector is not None and tag in self.detector else None

    def spacing(self) -> list[float] | None:
        """Return the distance of rows, then of columns, in millimetres; None where the file tells none."""
        return elements.numbers(self.find(0x00289110, 0x00280030), 0x00280030, 2)

    def step(self) -> float | None:
        """Return the distance of planes that is stated, in millimetres, or None."""
        between = elements.numbers(self.find(0x00289110, 0x00180088), 0x00180088, 1)
        return abs(between[0]) if between else None

    def thickness(self) -> float | None:
        """Return how thick a slice is, in millimetres, or None."""
        found = elements.numbers(self.find(0x00289110, 0x00180050), 0x00180050, 1)
        return abs(found[0]) if found else None

    def geometry(
        self, offset: float, told: Triple | None = None
    ) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:
        """Return the frame's position, `offset` millimetres along the normal, orientation and spacing.

        Args:
            offset: Of a file whose frames are told by their distances from the first one.
            told: Distances along x, y, z that the user gave, for a file that tells none of its pixels.

        Raises:
            NoSlice: There is none of one of them.
            DamagedVolumeError: They cannot be.
        """
        position, orientation, _ = self._position()
        spacing = self.spacing()
        if position is None or orientation is None:
            raise NoSlice(NO_POSITION)
        if spacing is None and told is not None:
            spacing = [told[1], told[0]]
        if spacing is None:
            raise NoSlice(self._spacing_missing())
        _check_spacing(spacing)
        _check_place([*position, offset] if offset else position)
        directions, _ = unit_directions(tuple(orientation))
        if offset:
            normal = np.cross(directions[:3], directions[3:])
            position = [float(p) for p in np.array(position) + offset * normal]
        return tuple(position), directions, (spacing[1], spacing[0])

    def _position(self) -> tuple[list[float] | None, list[float] | None, bool]:
        """Return position, directions, and whether they are those in the patient.

        An ultrasound volume may tell those in a frame of reference of its own alone (PS3.3, C.8.24.2.1).
        """
        position = elements.numbers(self.find(0x00209113, 0x00200032), 0x00200032, 3)
        orientation = elements.numbers(self.find(0x00209116, 0x00200037), 0x00200037, 6)
        if position is not None or orientation is not None:
            return position, orientation, True
        position = elements.numbers(self.find(0x0020930E, 0x00209301), 0x00209301, 3)
        orientation = elements.numbers(self.find(0x0020930F, 0x00209302), 0x00209302, 6)
        return position, orientation, False

    def is_in_patient(self) -> bool:
        """Return whether the place of a frame is that in the patient, as far as it is told."""
        return self._position()[2]

    def remarks(self) -> list[Notice]:
        """Return what is to be told of the frame's place."""
        _, cosines, is_in_patient = self._position()
        told = [] if is_in_patient else [Notice("W-ORIENTATION-MISSING", OUTSIDE_PATIENT)]
        if cosines is not None and unit_directions(tuple(cosines))[1] > ROUNDING_TOLD:
            told.append(Notice("W-ORIENTATION-ROUNDED", COSINES_TOLD))
        return told

    def _spacing_missing(self) -> str:
        """Return why a slice without pixel spacing is none, and what else the file has of the kind."""
        told = other_spacings(self.dataset)
        return f"no pixel spacing{f', only {told}' if told else ''} (--spacing X,Y,Z gives it)"


def other_spacings(dataset: Any) -> str:
    """Return in words what a file tells of distances on a detector or a film, which are none in the body."""
    told = []
    for tag, what in OTHER_SPACINGS.items():
        found = elements.numbers(dataset, tag)
        if found:
            told.append(f"{what[0]} {found[0]:g} mm, that {what[1]}")
    factor = elements.numbers(dataset, 0x00181114)
    if told and factor:
        told.append(f"EstimatedRadiographicMagnificationFactor {factor[0]:g}")
    return " and ".join(told)


def unplaced(
    place: Place, index: int, told: Triple | None, height: float | None = None
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:
    """Return position, orientation and spacing of a frame along the grid's own axes: the file tells no place.

    Args:
        place: Where its elements are.
        index: Its number along z, from 0.
        told: Distances along x, y, z that the user gave; else those of the file, 1 mm where it has none.
        height: How far it lies from the first, where the file tells that.
    """
    dataset = place.dataset
    between = elements.numbers(dataset, 0x00180088) or elements.numbers(dataset, 0x00180050) or [1.0]
    spacing = place.spacing() or [pixel_shape(dataset), 1.0]
    if height is None:
        height = index * (abs(between[0]) or 1.0)
    if told is not None:
        spacing, height = [told[1], told[0]], told[2] * index
    _check_spacing(spacing)
    _check_place([height])
    return (0.0, 0.0, height), (1.0, 0, 0, 0, 1, 0), (spacing[1], spacing[0])


def pixel_shape(dataset: Any) -> float:
    """Return how high a pixel is for one as wide as 1 (PixelAspectRatio)."""
    ratio = elements.numbers(dataset, 0x00280034) or []
    return ratio[0] / ratio[1] if len(ratio) == 2 and min(ratio) > 0 else 1.0
