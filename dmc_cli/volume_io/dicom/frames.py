"""Split a DICOM file into its frames: where each image lies in space, and what its values mean.

Single-frame images tell this in their own elements, enhanced ones in functional groups, shared by all
frames or one a frame; dose grids and nuclear medicine have offsets from the first frame.
"""

from dataclasses import dataclass, replace
from typing import Any

from dmc_cli.errors import DamagedVolumeError
from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.elements import Header
from dmc_cli.volume_io.dicom.increments import (
    Increments,
    detectors_of,
    frame_increments,
    placed_alone,
    refuse_tiles,
)
from dmc_cli.volume_io.dicom.labels import (
    OBJECT,
    SEGMENT,
    VALUE_TYPE,
    dimension_names,
    frame_labels,
    image_labels,
    segment_names,
)
from dmc_cli.volume_io.dicom.mosaic import corner_of_tile, is_mosaic, read_mosaic
from dmc_cli.volume_io.dicom.place import Place, Triple, unplaced
from dmc_cli.volume_io.dicom.scale import Lookup, kind_of_values, lookup, mapping_told, rescale, values_told
from dmc_cli.volume_io.dicom.storage import Pixels, read_pixels


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a file.

    Attributes:
        header: The file's header.
        pixels: How the file's frames are stored.
        index: Number of the frame in its file, from 0.
        position: Centre of the first node, LPS, in millimetres.
        orientation: Direction of x, then of y.
        spacing: Distance of nodes along x and y in millimetres.
        slope: Physical value a stored unit.
        intercept: Physical value of stored 0.
        padding: Closed range of stored values that mean no data, or None.
        labels: What may tell apart frames at the same place.
        lookup: Its Modality LUT, in whose place slope and intercept are 1 and 0, or None.
        kind_of_values: What its values are measured in: HU, US (unspecified), OD, ...
        lacks_scale: Whether the file tells a slope of 0, which cannot be meant and is read as 1.
        is_placed: Whether the file tells where the frame lies; if not, frames follow each other along z.
        is_in_patient: Whether it tells that in the patient, not in a scanner's own frame of reference.
        stated_spacing: The distance of rows, then of columns, that the file states in millimetres, or None.
        remarks: What the user is to be told of it.
        stated_step: The distance of slices that the file states, in millimetres, or None.
        thickness: How thick a slice is in millimetres, or None.
        is_blank: Whether it is a plane that a segmentation object leaves out: zeros.
        group: Its own functional group, or None.
    """

    header: Header
    pixels: Pixels
    index: int
    position: tuple[float, ...]
    orientation: tuple[float, ...]
    spacing: tuple[float, float]
    slope: float
    intercept: float
    padding: tuple[float, float] | None
    labels: dict[str, str]
    lookup: Lookup | None = None
    kind_of_values: str = "US"
    lacks_scale: bool = False
    is_placed: bool = True
    is_in_patient: bool = True
    stated_spacing: tuple[float, ...] | None = None
    remarks: tuple[Notice, ...] = ()
    stated_step: float | None = None
    thickness: float | None = None
    is_blank: bool = False
    group: Any = None

    @property
    def name(self) -> str:
        """Return the file's name, with the frame's number where it has several."""
        name = self.header.file.name
        return name if self.pixels.frames == 1 else f"{name} frame {self.index + 1}"


def read_frames(header: Header, settings: ReadSettings) -> list[Frame]:
    """Return the frames of a file, in its order; without a place where `settings` asks for another order.

    Raises:
        NoSlice: The file holds no greyscale images with a place in space.
        DamagedVolumeError: An element cannot be what it is.
    """
    pixels = read_pixels(header)
    dataset = header.dataset
    refuse_tiles(dataset)
    shared = (elements.items(dataset, 0x52009229) or [None])[0]
    each = elements.items(dataset, 0x52009230, pixels.frames + 1)
    if each and len(each) != pixels.frames:
        raise DamagedVolumeError(
            f"{header.file.name}: {len(each)} functional groups found for {pixels.frames} frames; get the "
            "file again"
        )
    if is_mosaic(dataset):
        pixels, steps = read_mosaic(header, pixels)
    else:
        steps = placed_alone(pixels.frames) if each else frame_increments(dataset, pixels.frames)
    if settings.slice_order != "position":
        steps = replace(steps, offsets=None)
    dimensions = dimension_names(dataset) if each else []
    common = {**image_labels(dataset), VALUE_TYPE: pixels.dtype.name}
    if pixels.frames > 1:
        common[OBJECT] = elements.text(dataset, 0x00200013)
    names = segment_names(dataset)
    detectors = detectors_of(dataset)
    if pixels.is_label_map:
        common[SEGMENT] = "all"
    told = (*pixels.contradictions, *values_told(dataset))
    file = _File(header, pixels, steps, settings.spacing, told, {})
    frames = []
    for index in range(pixels.frames):
        own = steps.labels[index]
        detector = detectors[min(int(own.get("detector", 1)), len(detectors)) - 1] if detectors else None
        place = Place(dataset, shared, each[index] if each else None, detector)
        labels = common | (frame_labels(place, dimensions) if each else own)
        if labels.get(SEGMENT) in names:
            labels[SEGMENT] += f" {names[labels[SEGMENT]]}"
        frames.append(_frame(file, place, index, labels))
    return frames


@dataclass(frozen=True, eq=False)
class _File:
    """What the frames of a file share.

    Attributes:
        header: Its header.
        pixels: How its frames are stored.
        steps: How they follow each other.
        given: Distances along x, y, z for a file that tells none.
        told: What the user is to be told of all of them.
        tables: Its lookup tables that are known.
    """

    header: Header
    pixels: Pixels
    steps: Increments
    given: Triple | None
    told: tuple[Notice, ...]
    tables: dict[int, Lookup]


def _frame(file: _File, place: Place, index: int, labels: dict[str, str]) -> Frame:
    """Return a frame, by its number in the file, with its labels; `place` is where its elements are."""
    steps, pixels = file.steps, file.pixels
    is_placed = steps.offsets is not None
    if steps.offsets is None:
        height = steps.heights[index] if steps.heights else None
        position, orientation, spacing = unplaced(place, steps.order[index], file.given, height)
    else:
        position, orientation, spacing = place.geometry(steps.offsets[index], file.given)
        if pixels.whole:
            position = corner_of_tile(position, orientation, spacing, pixels)
    stated = place.spacing()
    table = lookup(place, pixels.dtype.kind == "i", file.tables)
    slope, intercept = (1.0, 0.0) if table else rescale(place)
    return Frame(
        header=file.header,
        pixels=pixels,
        index=index,
        position=position,
        orientation=orientation,
        spacing=spacing,
        slope=slope or 1.0,
        intercept=intercept,
        padding=pixels.padding,
        labels=labels,
        lookup=table,
        kind_of_values=kind_of_values(place),
        lacks_scale=slope == 0,
        is_placed=is_placed,
        is_in_patient=place.is_in_patient(),
        stated_spacing=tuple(stated) if stated else None,
        stated_step=place.step(),
        thickness=place.thickness(),
        group=place.own,
        remarks=(
            *file.told,
            *(place.remarks() if is_placed else ()),
            *mapping_told(place, (slope or 1.0, intercept)),
        ),
    )
