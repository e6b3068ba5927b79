"""Read what an Imaris file (.ims) says of one of its datasets: its true size, distances and place.

A dataset is padded to whole chunks; its group has the true size. The file's extent goes from the outer side
of the first node to that of the last one, at every level of resolution. Source: the Imaris 5.5 file format.
"""

import re
from typing import Any

from dmc_cli.notices import Notice
from dmc_cli.volume_io.hdf5.links import followed
from dmc_cli.volume_io.hdf_storage import Attributes
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import scales_in_mm

FINEST = "/DataSet/ResolutionLevel 0"

DATASET = re.compile(r"/DataSet/ResolutionLevel (\d+)/TimePoint \d+/Channel \d+/Data")

INFORMATION = "/DataSetInfo/Image"


def is_imaris(file: Any, dataset: Any) -> bool:
    """Return whether a dataset is one of an Imaris file's."""
    return DATASET.fullmatch(str(dataset.name)) is not None and INFORMATION in file


def is_coarse(dataset: Any) -> bool:
    """Return whether a dataset is a smaller copy of another one of an Imaris file."""
    found = DATASET.fullmatch(str(dataset.name))
    return found is not None and int(found[1]) > 0


def imaris_axes(file: Any, name: str, h5py: Any) -> tuple[list[int], list[int], tuple[str, ...]]:
    """Return the numbers of the times and channels at the finest level, and what the channels are called."""

    def counted(place: str, label: str) -> list[int]:
        group = followed(file, place, name, h5py)
        keys = group.keys() if isinstance(group, h5py.Group) else ()
        return sorted(int(found[1]) for key in keys if (found := re.fullmatch(rf"{label} (\d{{1,6}})", key)))

    times = counted(FINEST, "TimePoint")
    channels = sorted({n for time in times for n in counted(f"{FINEST}/TimePoint {time}", "Channel")})
    told = [followed(file, f"/DataSetInfo/Channel {channel}", name, h5py) for channel in channels]
    return (
        times,
        channels,
        tuple("" if each is None else _text(Attributes(each).get("Name", "")) for each in told),
    )


def imaris_grid(
    file: Any, dataset: Any, name: str
) -> tuple[tuple[int, int, int], Triple, Triple, tuple[Notice, ...]]:
    """Return the nodes along x, y, z, their distances and the first one's place in mm, and what is told.

    Raises:
        UnsupportedFormatError: Its unit is one of time.
        ValueError, KeyError: It is not what the format has.
    """
    group, told = Attributes(dataset.parent), Attributes(file[INFORMATION])
    x, y, z = (int(_text(group[f"ImageSize{axis}"])) for axis in "XYZ")
    if not all(0 < n <= stored for n, stored in zip((z, y, x), dataset.shape, strict=True)):
        raise ValueError(f"a size of {x} x {y} x {z} of a dataset of shape {dataset.shape}")
    (scale, *_), doubts = scales_in_mm([_text(told.get("Unit", ""))] * 3, name)
    ends = [[scale * float(_text(told[f"Ext{end}{n}"])) for n in range(3)] for end in ("Min", "Max")]
    dx, dy, dz = ((last - first) / n for first, last, n in zip(*ends, (x, y, z), strict=True))
    i, j, k = (first + step / 2 for first, step in zip(ends[0], (dx, dy, dz), strict=True))
    return (x, y, z), (dx, dy, dz), (i, j, k), doubts


def _text(value: Any) -> str:
    """Return an attribute, which Imaris writes as an array of single characters."""
    if isinstance(value, str):
        return value
    return (value if isinstance(value, bytes) else b"".join(value.tolist())).decode("latin-1").strip("\0 ")
