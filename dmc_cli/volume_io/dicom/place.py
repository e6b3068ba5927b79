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
    """Where to look up a frame's elements: its own group, the shared one, the data set."""

    dataset: Any
    shared: Any
    own: Any

    def find(self, sequence: int, tag: int) -> Any:
        """Return the data set that holds an element."""
        for group in (self.own, self.shared):
            for item in elements.items(group, sequence)[:1]:
                if tag in item:
                    return item
        if tag in self.dataset:
            return self.dataset
        for detector in elements.items(self.dataset, 0x00540022)[:1]:
            if tag in detector:
                return detector
        return None

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
        position = elements.numbers(self.find(0x00209113, 0x00200032), 0x00200032, 3)
        orientation = elements.numbers(self.find(0x00209116, 0x00200037), 0x00200037, 6)
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

    def remarks(self) -> list[Notice]:
        """Return what is to be told of the frame's place."""
        cosines = elements.numbers(self.find(0x00209116, 0x00200037), 0x00200037, 6)
        if cosines is None or unit_directions(tuple(cosines))[1] <= ROUNDING_TOLD:
            return []
        return [Notice("W-ORIENTATION-ROUNDED", COSINES_TOLD)]

    def _spacing_missing(self) -> str:
        """Return why a slice without pixel spacing is none, and what its detector had."""
        detector = elements.numbers(self.dataset, 0x00181164)
        told = f", only ImagerPixelSpacing {detector[0]:g} mm, that of the detector" if detector else ""
        return f"no pixel spacing{told} (--spacing X,Y,Z gives it)"


def unplaced(
    place: Place, index: int, told: Triple | None
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:
    """Return position, orientation and spacing of a frame along the grid's own axes: the file tells no place.

    Args:
        place: Where its elements are.
        index: Its number along z, from 0.
        told: Distances along x, y, z that the user gave; else those of the file, 1 mm where it has none.
    """
    dataset = place.dataset
    between = elements.numbers(dataset, 0x00180088) or elements.numbers(dataset, 0x00180050) or [1.0]
    spacing = place.spacing() or [1.0, 1.0]
    step = abs(between[0]) or 1.0
    if told is not None:
        spacing, step = [told[1], told[0]], told[2]
    _check_spacing(spacing)
    _check_place([step * index])
    return (0.0, 0.0, index * step), (1.0, 0, 0, 0, 1, 0), (spacing[1], spacing[0])
