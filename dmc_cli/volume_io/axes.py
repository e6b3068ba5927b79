"""Tell what the axes of an array are called, which three are the grid's, and which volume of it is wanted.

Axes are taken by their names, in any order. Those that are not of space (channels, times, positions, tiles,
angles) count volumes: one is chosen by `--channel` and `--time`, by `--volume-index`, or it is the only one.
Never is such an axis taken for a direction: an array without a z axis is no volume.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from dmc_cli.errors import DamagedVolumeError, SettingsError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import VolumeEntry
from dmc_cli.volume_io.layout import chosen_index

UNNAMED = ""
"""The name of an axis that the file does not name."""

SPELLINGS = {
    "x": ("x", "width", "column", "columns", "col"),
    "y": ("y", "height", "row", "rows"),
    "z": ("z", "depth", "slice", "slices", "plane", "planes"),
    "channel": ("c", "ch", "channel", "channels"),
    "time": ("t", "time", "times", "timepoint", "timepoints", "frame", "frames"),
}
"""What an axis is, to the names that files have for it, in lower case."""

NAMED = ("channel", "time")
"""Axes that have an option of their own, which is called like them."""

LEAST_PICTURE = 16
"""Rows and columns of a picture, at least."""

MOST_LISTED = 10_000
"""Volumes that are listed one by one, at most."""

MOST_TOLD = 20
"""Names of channels that a message holds, at most."""


@dataclass(frozen=True)
class Axis:
    """An axis of an array.

    Attributes:
        name: What the file calls it; `UNNAMED` where it does not.
        size: Nodes, or what else it counts.
        labels: The names of what it counts (of channels: the dyes), or none.
    """

    name: str
    size: int
    labels: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """Return x, y, z, channel or time where the name means one of these, else the name itself."""
        lower = self.name.strip().lower()
        return next((kind for kind, names in SPELLINGS.items() if lower in names), lower)

    def label(self, number: int) -> str:
        """Return how one of what it counts is told: `channel 1 (GFP)`."""
        named = self.labels[number] if number < len(self.labels) else ""
        return f"{self.kind or 'volume'} {number}" + (f" ({named})" if named else "")


@dataclass(frozen=True)
class Image:
    """An array of one or several volumes, with its axes in the order in which they are stored.

    Attributes:
        axes: The slowest first.
        title: What the file calls it, or "" where it holds no other one.
    """

    axes: tuple[Axis, ...]
    title: str = ""

    @property
    def grid(self) -> tuple[int, int, int] | None:
        """Return which axes are z, y and x; None where one of them is missing.

        Axes without a name stand for those that are missing, the last one for x if that is.
        """
        found = {axis.kind: number for number, axis in enumerate(self.axes) if axis.kind in ("x", "y", "z")}
        nameless = [number for number, axis in enumerate(self.axes) if axis.name == UNNAMED]
        for kind in "xyz":
            if kind not in found and nameless:
                found[kind] = nameless.pop()
        return (found["z"], found["y"], found["x"]) if len(found) == 3 else None

    @property
    def others(self) -> tuple[int, ...]:
        """Return which axes count volumes."""
        return tuple(number for number in range(len(self.axes)) if number not in (self.grid or ()))

    @property
    def nodes(self) -> tuple[int, int, int]:
        """Return the nodes along x, y, z."""
        assert self.grid is not None
        z, y, x = (self.axes[number].size for number in self.grid)
        return x, y, z

    def told(self) -> str:
        """Return the axes with their sizes, for a message: `the axes time 40, y 48, x 64`."""
        if not any(axis.name for axis in self.axes):
            return f"shape {tuple(axis.size for axis in self.axes)}"
        return "the axes " + ", ".join(f"{axis.kind or 'unnamed'} {axis.size}" for axis in self.axes)


def nameless_image(shape: Sequence[int], title: str = "") -> Image:
    """Return an array whose axes have no names: the last three that have more than one node are z, y, x."""
    several = sum(size != 1 for size in shape)
    return Image(
        tuple(Axis("single" if size == 1 and several >= 3 else UNNAMED, size) for size in shape), title
    )


def stacked_image(nodes: Sequence[int], *others: Axis, behind: Sequence[Axis] = ()) -> Image:
    """Return grids of nodes along x, y, z one after the other; the slowest of the other axes comes first.

    `behind` are axes that are faster than the grid's own.
    """
    x, y, z = nodes
    return Image((*others, Axis("z", z), Axis("y", y), Axis("x", x), *behind))


@dataclass(frozen=True)
class Choice:
    """A volume of several images.

    Attributes:
        image: The number of its image.
        where: Its place along each of the image's axes; None for those of the grid.
    """

    image: int
    where: tuple[int | None, ...]


def check_axes(images: Sequence[Image], name: str) -> None:
    """Refuse axes with one name twice.

    Raises:
        DamagedVolumeError: Two axes of an image are called the same.
    """
    for image in images:
        kinds = [axis.kind for axis in image.axes if axis.kind in SPELLINGS]
        if len(set(kinds)) < len(kinds):
            raise DamagedVolumeError(
                f"{name}: an array of {image.told()} found; expected each axis once; correct the metadata"
            )


def chosen_volume(
    images: Sequence[Image], settings: ReadSettings, name: str, what: str = "volumes"
) -> Choice:
    """Return the volume that is wanted, of images that may have several; `what` messages call them.

    Raises:
        UnsupportedFormatError: None of them has three axes of space.
        DamagedVolumeError: An axis is called like another one, or counts nothing.
        AmbiguousVolumeError: There are several volumes, and none was chosen.
        SettingsError: What was chosen does not exist.
    """
    check_axes(images, name)
    whole = [number for number, image in enumerate(images) if image.grid is not None]
    if not whole:
        raise UnsupportedFormatError(
            f"{name}: an array of {images[0].told()} found; expected axes z, y, x; where another axis is z "
            "in truth, correct the metadata"
        )
    ranges = {number: _ranges(images[number], settings, name) for number in whole}
    counts = [math.prod(len(each) for each in ranges[number].values()) for number in whole]
    told, options = _told_choices([images[number] for number in whole], settings, name)
    left = chosen_index(name, sum(counts), settings.volume_index, what, told, options)
    for number, count in zip(whole, counts, strict=True):
        if left < count:
            return Choice(number, _where(images[number], ranges[number], left))
        left -= count
    raise AssertionError("an index within the counts")


def unnamed_axes(image: Image) -> tuple[Notice, ...]:
    """Return a warning where axes without a name are taken to count volumes, or colours for places."""
    sizes = tuple(axis.size for axis in image.axes)
    if not any(image.axes[n].name == UNNAMED and image.axes[n].size > 1 for n in image.others):
        is_named = image.grid is None or any(image.axes[n].name != UNNAMED for n in image.grid)
        return () if is_named else maybe_colors(image.nodes, f"an array of shape {sizes}", "last")
    told = (
        f"an array of shape {sizes} has axes without names; the last ones are taken as z, y, x, the others "
        "count volumes"
    )
    return (Notice("W-AXES-MISSING", told),)


def maybe_colors(nodes: Sequence[int], what: str, axis: str) -> tuple[Notice, ...]:
    """Return a warning where nodes along x, y, z that nobody names are as many as a picture's colours.

    Args:
        nodes: Along x, y, z; x is the fastest of the stored axes.
        what: The array, for the message.
        axis: The message's word for its x.
    """
    x, y, z = nodes
    if x not in (3, 4) or min(y, z) < LEAST_PICTURE:
        return ()
    told = f"{what} may be a picture of {x} colours, as its axes have no names; the {axis} one is taken as x"
    return (Notice("W-AXES-MISSING", told),)


def flat_index(image: Image, choice: Choice) -> int:
    """Return the number of a volume among all of its image, the last axis fastest."""
    index = 0
    for axis in image.others:
        place = choice.where[axis]
        assert place is not None
        index = index * image.axes[axis].size + place
    return index


def images_entry(format_name: str, images: Sequence[Image], settings: ReadSettings, name: str) -> VolumeEntry:
    """Return what `dmc info` lists of a file, whose first volume must be one.

    Raises:
        VolumeError: As `chosen_volume`.
    """
    first = images[chosen_volume(images, replace(settings, volume_index=0), name).image]
    listed = listed_volumes(images, settings, name)
    return VolumeEntry(description=format_name, size=first.nodes, volumes=listed)


def listed_volumes(images: Sequence[Image], settings: ReadSettings, name: str) -> tuple[str, ...]:
    """Return how each volume is told, in the order of `--volume-index`; of very many the first ones.

    Raises:
        SettingsError: A channel or a time was chosen that does not exist.
    """
    labels: list[str] = []
    whole = [image for image in images if image.grid is not None]
    for image in whole:
        ranges = _ranges(image, settings, name)
        size = " x ".join(map(str, image.nodes))
        count = math.prod(len(each) for each in ranges.values())
        for number in range(min(count, MOST_LISTED - len(labels))):
            where = _where(image, ranges, number)
            parts = [
                image.axes[axis].label(place)
                for axis in ranges
                if image.axes[axis].size > 1 and (place := where[axis]) is not None
            ]
            title = [image.title] if image.title and len(whole) > 1 else []
            labels.append(f"{', '.join([*title, *parts]) or 'the volume'}, {size}")
    return tuple(labels)


def _ranges(image: Image, settings: ReadSettings, name: str) -> dict[int, range]:
    """Return, for each axis that counts volumes, which of them are left to choose from."""
    ranges = {number: range(image.axes[number].size) for number in image.others}
    for option in NAMED:
        wanted = getattr(settings, option)
        if wanted is None:
            continue
        axis = next((n for n in image.others if image.axes[n].kind == option), None)
        if axis is None:
            _check_only(option, wanted, name)
        else:
            number = _number(image.axes[axis], wanted, option, name)
            ranges[axis] = range(number, number + 1)
    return ranges


def _check_only(option: str, wanted: str, name: str) -> None:
    if wanted != "0":
        raise SettingsError(
            f"{option} is {wanted!r:.80}; {name} has no such axis; expected 0, or leave --{option} out"
        )


def _number(axis: Axis, wanted: str, option: str, name: str) -> int:
    """Return which of an axis is wanted: a number from 0, or else a name."""
    if re.fullmatch(r"[0-9]{1,12}", wanted) and int(wanted) < axis.size:
        return int(wanted)
    fitting = [n for n, label in enumerate(axis.labels[: axis.size]) if label == wanted]
    fitting = fitting or [n for n, a in enumerate(axis.labels[: axis.size]) if a.lower() == wanted.lower()]
    if len(fitting) == 1:
        return fitting[0]
    raise SettingsError(
        f"{option} is {wanted!r:.80}; {name} has {_told_axis(axis)}; expected one of these (--{option})"
    )


def _told_axis(axis: Axis) -> str:
    """Return what an axis counts: `channel 0 to 1 (DAPI, GFP)`."""
    named = [label[:60] for label in axis.labels[:MOST_TOLD] if label]
    return f"{axis.kind or 'volume'} 0 to {axis.size - 1}" + (f" ({', '.join(named)})" if named else "")


def _told_choices(images: Sequence[Image], settings: ReadSettings, name: str) -> tuple[str, str]:
    """Return what there is to choose from, and the options that choose it beside --volume-index."""
    if len(images) > 1:
        return f" ({_told_images(images, settings, name)})", ""
    axes = [images[0].axes[n] for n in images[0].others if images[0].axes[n].size > 1]
    given = [option for option in NAMED if getattr(settings, option) is not None]
    left = [axis for axis in axes if axis.kind not in given]
    told = f" ({'; '.join(map(_told_axis, left))})" if any(axis.kind for axis in left) else ""
    return told, " and ".join(f"--{axis.kind}" for axis in left if axis.kind in NAMED)


def _told_images(images: Sequence[Image], settings: ReadSettings, name: str) -> str:
    """Return the numbers of each image's volumes: `0 to 1: left, 2: right`."""
    told, first = [], 0
    for image in images[:MOST_TOLD]:
        count = math.prod(len(places) for places in _ranges(image, settings, name).values())
        numbers = f"{first}" if count == 1 else f"{first} to {first + count - 1}"
        told.append(f"{numbers}: {image.title[:60]}")
        first += count
    return ", ".join(told) + (", ..." if len(images) > MOST_TOLD else "")


def _where(image: Image, ranges: dict[int, range], index: int) -> tuple[int | None, ...]:
    """Return the place of a volume of an image: the axes in their order, the last one fastest."""
    where: list[int | None] = [None] * len(image.axes)
    for axis in reversed(ranges):
        index, place = divmod(index, len(ranges[axis]))
        where[axis] = ranges[axis][place]
    return tuple(where)
