"""Find the images of a BigDataViewer file: a dataset for each time and setup, `t00000/s00/0/cells`.

A setup is a channel, an angle, a tile or a mixture, as the XML beside the file says. Level 0 is the finest.
Values of 16 bits are stored as signed ones and are none.
"""

import math
import re
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError
from dmc_cli.volume_io.axes import Axis, Image, stacked_image
from dmc_cli.volume_io.hdf5.links import followed
from dmc_cli.volume_io.hdf5.spim_data import Setup, SpimData
from dmc_cli.volume_io.hdf5.stored import HdfGeometry, Stored, Where
from dmc_cli.volume_io.hdf_storage import check_inside, check_stored
from dmc_cli.volume_io.layout import Triple, check_lengths
from dmc_cli.volume_io.units import scales_in_mm

DATASET = re.compile(r"/t(\d{5,9})/s(\d{2,9})/(\d{1,3})/cells")

MOST_VIEWS = 100_000
"""Times and setups that are looked at, at most."""


def is_big_data_viewer(file: Any) -> bool:
    """Return whether a file has the groups that BigDataViewer writes."""
    return bool(_numbered(file, "t", 5) and _numbered(file, "s", 2))


def views(file: Any, spim: SpimData | None, name: str, h5py: Any) -> list[Stored]:
    """Return the images of a file: one of all setups, or one a setup where their grids differ.

    Args:
        file: An open file of h5py.
        spim: What the XML says, or None where there is none.
        name: The input, for messages.
        h5py: The package.

    Raises:
        UnsupportedFormatError: A link leads out of the file.
        DamagedVolumeError: No image of a setup is there.
    """
    times, setups = _numbered(file, "t", 5), _numbered(file, "s", 2)
    if len(times) * len(setups) > MOST_VIEWS:
        raise ValueError(f"{len(times)} times of {len(setups)} setups")
    found = [_Views(file, spim, times, [setup], name, h5py) for setup in setups]
    if len({each.kind for each in found}) == 1:
        found = [_Views(file, spim, times, setups, name, h5py)]
    return [each.stored() for each in found]


def _numbered(file: Any, letter: str, least: int) -> list[tuple[int, str]]:
    """Return the groups that are called by a letter and a number, by their number."""
    return sorted((int(key[1:]), key) for key in file if re.fullmatch(rf"{letter}\d{{{least},9}}", key))


class _Views:
    """The views of some setups, all of one grid, at all times."""

    def __init__(
        self,
        file: Any,
        spim: SpimData | None,
        times: list[tuple[int, str]],
        setups: list[tuple[int, str]],
        name: str,
        h5py: Any,
    ) -> None:
        self.file, self.spim, self.name, self.h5py = file, spim, name, h5py
        self.times, self.setups = times, setups
        first = next((d for time, setup in product(times, setups) if (d := self._dataset(time, setup))), None)
        if first is None or first.ndim != 3:
            raise DamagedVolumeError(
                f"{name}: no image of three axes of the setup {setups[0][1]} found; expected "
                f"t00000/{setups[0][1]}/0/cells; the file is incomplete; get it again"
            )
        z, y, x = first.shape
        self.nodes = int(x), int(y), int(z)

    @property
    def kind(self) -> tuple[Any, ...]:
        """Return what setups of one image have in common."""
        setup = _setup(self.spim, self.setups[0][0])
        return self.nodes, setup.spacing, setup.unit

    def stored(self) -> Stored:
        """Return the views as one image: times, and an axis for each attribute in which setups differ."""
        axes, chosen = self._axes()
        labels = [f"t{number}" for number, _ in self.times]
        is_counted = [number for number, _ in self.times] == list(range(len(self.times)))
        time = Axis("time", len(self.times), () if is_counted else tuple(labels))
        image = replace(stacked_image(self.nodes, time, *axes), title=self._title(self.setups[0][0]))

        def find(where: Where) -> tuple[Any, Where, HdfGeometry]:
            moment, *picked = (each or 0 for each in where[: len(where) - 3])
            time, setup = self.times[moment], self.setups[chosen[tuple(picked)]]
            dataset = self._dataset(time, setup)
            if dataset is None or dataset.shape != self.nodes[::-1]:
                raise DamagedVolumeError(
                    f"{self.name}: no image {time[1]}/{setup[1]}/0/cells of {self.nodes} nodes found; the "
                    "view is missing; choose another one"
                )
            return (
                dataset,
                where[-3:],
                view_geometry(self.file, dataset, image, self.spim, self.name, self.h5py),
            )

        return Stored(image, find)

    def _axes(self) -> tuple[list[Axis], dict[tuple[int, ...], int]]:
        """Return the axes along which setups lie, and for each place the setup's number among them."""
        told = [_setup(self.spim, number).attributes for number, _ in self.setups]
        kinds = [kind for kind in told[0] if len({each.get(kind) for each in told}) > 1]
        values = {kind: sorted({each.get(kind, 0) for each in told}) for kind in kinds}
        places = [tuple(values[kind].index(each.get(kind, 0)) for kind in kinds) for each in told]
        if len({*places}) == len(told) == math.prod(len(each) for each in values.values()):
            axes = [Axis(kind, len(values[kind]), self._labels(kind, values[kind])) for kind in kinds]
            return axes, {place: number for number, place in enumerate(places)}
        names = tuple(_setup(self.spim, number).label for number, _ in self.setups)
        return [Axis("setup", len(told), names)], {(number,): number for number in range(len(told))}

    def _labels(self, kind: str, numbers: list[int]) -> tuple[str, ...]:
        named = self.spim.names.get(kind, {}) if self.spim else {}
        return tuple(named.get(number, "") for number in numbers)

    def _title(self, number: int) -> str:
        label = _setup(self.spim, number).label
        return f"setup {number}" + (f" ({label})" if label else "")

    def _dataset(self, time: tuple[int, str], setup: tuple[int, str]) -> Any:
        """Return the finest image of a view, None where it is not there."""
        found = followed(self.file, f"{time[1]}/{setup[1]}/0/cells", self.name, self.h5py)
        return found if isinstance(found, self.h5py.Dataset) else None


def _setup(spim: SpimData | None, number: int) -> Setup:
    return spim.setups.get(number, Setup()) if spim else Setup()


def view_geometry(
    file: Any, dataset: Any, image: Image, spim: SpimData | None, name: str, h5py: Any
) -> HdfGeometry:
    """Return what file and XML say of a view, whose dataset may be a smaller copy.

    Raises:
        UnsupportedFormatError: The voxel size is in a unit of time.
        DamagedVolumeError: The voxel size is none.
    """
    dtype = np.dtype("u2") if dataset.dtype == np.dtype("i2") else None
    found = DATASET.fullmatch(str(dataset.name))
    assert found is not None
    time, setup, level = (int(each) for each in found.groups())
    told = _setup(spim, setup)
    if told.spacing is None or spim is None:
        return HdfGeometry(image, dtype=dtype)
    scales, doubts = scales_in_mm([told.unit or None] * 3, name, "the XML")
    first, notices = spim.placed(time, setup)
    factors = _factors(file, f"s{found[2]}/resolutions", level, name, h5py)
    spacing = _triple(np.array(told.spacing) * scales * factors)
    check_lengths(name, spacing)
    if first is None:
        return HdfGeometry(image, spacing, notices=notices, doubts=doubts, dtype=dtype)
    shift = np.array(told.spacing) * (factors - 1) / 2
    origin = _triple((np.array(first) + shift) * scales)
    return HdfGeometry(image, spacing, origin, notices=notices, doubts=doubts, dtype=dtype)


def _factors(file: Any, place: str, level: int, name: str, h5py: Any) -> Float64Array:
    """Return how many nodes of the finest level a node of another one stands for, along x, y, z."""
    resolutions = followed(file, place, name, h5py)
    if not isinstance(resolutions, h5py.Dataset):
        raise ValueError(f"no {place}")
    check_inside(resolutions, name)
    check_stored(resolutions, file.id.get_filesize(), name, "copy it with h5repack")
    return np.asarray(resolutions[level], np.float64)


def _triple(lengths: Any) -> Triple:
    x, y, z = lengths.tolist()
    return x, y, z
