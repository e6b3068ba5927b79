"""Make a volume of each segment of a segmentation object, planes that it leaves out filled with zeros.

A binary or fractional object has frames for the planes only in which a segment is (PS3.3, C.8.20). Planes of
other segments, and those that the stated distance of slices puts between, are empty.
"""

from dataclasses import replace

import numpy as np

from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.distances import ALIKE
from dmc_cli.volume_io.dicom.frames import Frame
from dmc_cli.volume_io.dicom.labels import OBJECT, SEGMENT, sort_key
from dmc_cli.volume_io.dicom.stack import Stack
from dmc_cli.volume_io.dicom.storage import MAX_FRAMES


def split_segments(stack: Stack) -> list[Stack]:
    """Return the stack, or of segmentation objects one stack a segment, in the order of their numbers."""
    if not all(SEGMENT in frame.labels for frame in stack.frames):
        return [stack]
    numbers: dict[str, list[int]] = {}
    for number, frame in enumerate(stack.frames):
        numbers.setdefault(_object(frame), []).append(number)
    objects = [stack.part(own, stack.all_places) for own in numbers.values()]
    ordered = sorted(objects, key=lambda one: sort_key(one.frames[0].labels.get(OBJECT, "")))
    found = []
    for number, one in enumerate(ordered, 1):
        parts = _segments(one)
        for part in parts if len(objects) > 1 else ():
            part.description += f" (object {number} of {len(objects)})"
        found += parts
    return found


def _object(frame: Frame) -> str:
    """Return what is the same for the frames of one object, which several files may hold."""
    dataset = frame.header.dataset
    return elements.text(dataset, 0x00209161) or elements.text(dataset, 0x00080018)


def _segments(one: Stack) -> list[Stack]:
    """Return a stack for each segment of an object."""
    planes = _with_planes_between([frames[0] for frames in one.by_place()])
    parts: dict[str, Stack] = {}
    for frame in one.frames:
        parts.setdefault(frame.labels[SEGMENT], replace(one, frames=[])).frames.append(frame)
    for value, part in parts.items():
        part.frames += _absent(part, planes)
        part.sort()
        part.same_place = one.same_place
        if len(parts) > 1:
            part.description = f"{one.description} (segment {value})"
    return [parts[value] for value in sorted(parts, key=sort_key)]


def _with_planes_between(planes: list[Frame]) -> list[Frame]:
    """Return empty frames for planes in their order, and for those that the stated distance puts between."""
    found: list[Frame] = []
    for one, other in zip(planes, [*planes[1:], None], strict=True):
        found.append(replace(one, is_blank=True))
        step = one.stated_step
        if other is None or not step:
            continue
        start, way = np.array(one.position), np.array(other.position) - np.array(one.position)
        times = float(np.linalg.norm(way)) / step
        count = round(times)
        if 2 <= count <= MAX_FRAMES and abs(times - count) <= ALIKE:
            places = (start + way * n / count for n in range(1, count))
            found += [replace(one, is_blank=True, position=tuple(place.tolist())) for place in places]
    return found


def _absent(part: Stack, planes: list[Frame]) -> list[Frame]:
    """Return the empty frames of planes in which a segment has none."""
    orientation = np.array(planes[0].orientation)
    normal = np.cross(orientation[:3], orientation[3:])
    own = np.sort([float(normal @ np.array(frame.position)) for frame in part.frames])
    absent = []
    for plane in planes:
        place = float(normal @ np.array(plane.position))
        near = np.searchsorted(own, place - part.same_place)
        if near == len(own) or own[near] - place >= part.same_place:
            absent.append(replace(plane, labels=part.frames[0].labels))
    return absent
