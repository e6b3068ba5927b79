"""Hold the frames of one series with the same size and orientation, sorted along their normal."""

from dataclasses import dataclass, field, replace

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.volume import VolumeEntry
from dmc_cli.volume_io.dicom.distances import same_place
from dmc_cli.volume_io.dicom.frames import Frame


@dataclass(eq=False)
class Stack:
    """Frames of one series with the same size and orientation.

    Attributes:
        uid: SeriesInstanceUID.
        series_number: The scanner's own number, for the order only.
        description: SeriesDescription, and what tells this stack from others of the series.
        modality: CT, MR, ...
        frames: Its frames, in the order of their positions along the normal once sorted.
        all_places: Those of all volumes that it was parted from, along the normal; none where it is alone.
        same_place: Slices closer than this, in millimetres, lie in one place; known once sorted.
        places: The position of each frame along the normal in millimetres; known once sorted.
    """

    uid: str
    series_number: int
    description: str
    modality: str
    frames: list[Frame] = field(default_factory=list)
    all_places: tuple[float, ...] = ()
    same_place: float = 0.0
    places: Float64Array = field(default_factory=lambda: np.empty(0))

    def plane(self) -> str:
        """Return how its slices lie in a patient, by the axis that their normal is nearest to."""
        orientation = np.array(self.frames[0].orientation)
        normal = np.cross(orientation[:3], orientation[3:])
        return ("sagittal", "coronal", "axial")[int(np.abs(normal).argmax())]

    def sort(self) -> None:
        """Order the frames by place, then by name and number."""
        orientation = np.array(self.frames[0].orientation)
        normal = np.cross(orientation[:3], orientation[3:])
        places = [float(normal @ np.array(frame.position)) for frame in self.frames]
        keys = [
            (place, frame.header.file.name, frame.index)
            for place, frame in zip(places, self.frames, strict=True)
        ]
        order = sorted(range(len(keys)), key=keys.__getitem__)
        self._take(order, np.array(places))
        self.same_place = same_place(self.places, min(self.frames[0].spacing))

    def part(self, numbers: list[int], all_places: tuple[float, ...]) -> "Stack":
        """Return a stack of the frames of these numbers, which ascend, and the places of all parts."""
        part = replace(self, all_places=all_places)
        part._take(numbers, self.places)
        return part

    def _take(self, numbers: list[int], places: Float64Array) -> None:
        """Keep the frames of these numbers, in their order; `places` are those of all."""
        self.frames = [self.frames[n] for n in numbers]
        self.places = places[numbers]

    def by_place(self) -> list[list[Frame]]:
        """Return the frames of each place, once sorted."""
        starts = np.diff(self.places, prepend=-np.inf) >= self.same_place
        found: list[list[Frame]] = []
        for frame, is_new in zip(self.frames, starts, strict=True):
            if is_new:
                found.append([])
            found[-1].append(frame)
        return found

    def different_places(self) -> tuple[float, ...]:
        """Return each place once, once sorted."""
        starts = np.diff(self.places, prepend=-np.inf) >= self.same_place
        return tuple(self.places[starts].tolist())

    def place_count(self) -> int:
        """Return the number of different places, once sorted."""
        return 1 + int((np.diff(self.places) >= self.same_place).sum())

    def entry(self, number: int) -> VolumeEntry:
        """Return the stack as `dmc info` lists it."""
        columns, rows = self.frames[0].pixels.shape
        return VolumeEntry(
            number=number,
            description=self.description,
            modality=self.modality,
            size=(columns, rows, len(self.frames)),
            uid=self.uid,
        )
