"""Name what may tell apart images that lie in one place: echo times, phases, directions, times."""

from typing import Any

from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.makers import CREATORS, GE, GE_COMPONENTS, GE_MOST, PRIVATE
from dmc_cli.volume_io.dicom.place import Place

DISCRIMINATORS = {
    "image type": 0x00080008,
    "complex component": 0x00089208,
    "acquisition": 0x00200012,
    "temporal position": 0x00200100,
    "echo time": 0x00180081,
    "echo number": 0x00180086,
    "inversion time": 0x00180082,
    "cardiac phase": 0x00209241,
    "trigger delay": 0x00209153,
    "trigger time": 0x00181060,
    "b-value": 0x00189087,
    "gradient direction": 0x00189089,
    "respiratory phase": 0x00209245,
    "RR interval": 0x00181062,
    "flip angle": 0x00181314,
    "repetition time": 0x00180080,
    "coil": 0x00181250,
    "phase encoding": 0x00181312,
    "sequence": 0x00180024,
    "averages": 0x00180083,
    "kernel": 0x00181210,
    "filter": 0x00181160,
    "tube voltage": 0x00180060,
    "contrast agent": 0x00180010,
    "dose type": 0x30040004,
    "dose summation": 0x3004000A,
    "sequence variant": 0x00180021,
    "scan options": 0x00180022,
    "frame reference time": 0x00541300,
    "acquisition date": 0x00080022,
    "acquisition date and time": 0x0008002A,
    "acquisition time": 0x00080032,
    "content time": 0x00080033,
    "content date": 0x00080023,
    "SOP class": 0x00080016,
    "frame of reference": 0x00200052,
    "protocol": 0x00181030,
    "series number": 0x00200011,
    "series description": 0x0008103E,
    "comments": 0x00204000,
}
"""What may tell apart images at the same place, in the order in which it is tried."""

VALUE_TYPE = "value type"
"""What is tried last: slices of one volume may differ in it."""

SEGMENT = "segment"
"""The segment of a segmentation object; whatever lies where, it is a volume of its own."""

FRAME_DISCRIMINATORS = {
    "stack": (0x00209111, 0x00209056),
    "temporal position": (0x00209111, 0x00209128),
    "acquisition": (0x00209111, 0x00209156),
    "echo time": (0x00189114, 0x00189082),
    "inversion time": (0x00189115, 0x00189079),
    "cardiac phase": (0x00189118, 0x00209241),
    "trigger delay": (0x00189118, 0x00209153),
    "respiratory phase": (0x00209253, 0x00209245),
    "respiratory delay": (0x00209253, 0x00209255),
    "RR interval": (0x00189118, 0x00209251),
    "temporal offset": (0x00209310, 0x0020930D),
    "velocity direction": (0x00189197, 0x00189090),
    "spin labelling": (0x00189251, 0x00189257),
    "data type": (0x00189807, 0x00189808),
    "metabolite": (0x00189152, 0x00189080),
    "magnetization transfer": (0x00189006, 0x00189020),
    "contrast phase": (0x00189341, 0x00189344),
    "contrast agent given": (0x00189341, 0x00189342),
    "b-value": (0x00189117, 0x00189087),
    "diffusion": (0x00189117, 0x00189075),
    "complex component": (0x00189226, 0x00089208),
    "frame type": (0x00189226, 0x00089007),
    "CT frame type": (0x00189329, 0x00089007),
    "PET frame type": (0x00189751, 0x00089007),
    "contrast": (0x00189226, 0x00089209),
    "flip angle": (0x00189112, 0x00181314),
    "repetition time": (0x00189112, 0x00180080),
    "coil": (0x00189042, 0x00181250),
    "averages": (0x00189119, 0x00180083),
    "kernel": (0x00189314, 0x00181210),
    "tube voltage": (0x00189325, 0x00180060),
    "second tube voltage": (0x00189360, 0x00180060),
    "reference date and time": (0x00209111, 0x00189151),
    "acquisition time": (0x00209111, 0x00189074),
}
"""The same in enhanced images: sequence and element."""

CONVERTED = 0x00209171
"""The elements that single images had before they were put into an enhanced one."""

OBJECT = "object"
"""What is tried last of all: one of several objects with many frames, by its InstanceNumber."""

DIRECTION = "gradient direction"

TIMES = (
    "temporal position",
    "trigger time",
    "trigger delay",
    "frame reference time",
    "reference date and time",
    "acquisition",
    "acquisition time",
    "content time",
)
"""What differs a little from slice to slice where slices are repeated one after the other."""

UNITS = {
    "echo time": "ms",
    "inversion time": "ms",
    "trigger time": "ms",
    "trigger delay": "ms",
    "RR interval": "ms",
    "temporal offset": "s",
    "respiratory delay": "ms",
    "repetition time": "ms",
    "frame reference time": "ms",
    "cardiac phase": "%",
    "respiratory phase": "%",
    "b-value": "s/mm2",
    "tube voltage": "kV",
    "second tube voltage": "kV",
    "flip angle": "degrees",
}

TOLD_BESIDE = (*UNITS, DIRECTION)
"""What volumes are described by, too, where something else tells them apart and they differ in it."""

COMPONENTS = {"M": "magnitude", "P": "phase", "R": "real", "I": "imaginary"}
"""The third value of an MR image's type."""

MOST_DIMENSIONS = 64
MOST_SEGMENTS = 1 << 16

IN_PLACE = (0x00200032, 0x00209057, 0x00209056, 0x00201041, 0x00200037, 0x00209301, 0x00209302)
"""Dimensions of an enhanced image that tell where a frame lies."""


def image_labels(dataset: Any) -> dict[str, str]:
    """Return what the elements of a file tell of all its frames; the standard's before a maker's own."""
    found = {key: _text(dataset, key, tag) for key, tag in DISCRIMINATORS.items() if tag in dataset}
    return {**_private_labels(dataset), **_time_slice(dataset), **found}


def _text(dataset: Any, key: str, tag: int) -> str:
    """Return the value of a label; of a number always in the same spelling."""
    value = elements.label(dataset, tag)
    return _plain(value) if key in UNITS else value


def _time_slice(dataset: Any) -> dict[str, str]:
    """Return which time an image of PET is of: its index counts the slices of one time after the other."""
    index, slices = (elements.integer(dataset, tag) for tag in (0x00541330, 0x00540081))
    return {"time slice": f"{(index - 1) // slices + 1}"} if index and slices else {}


def _private_labels(dataset: Any) -> dict[str, str]:
    """Return what the makers' own elements tell, in the words of the standard's."""
    found = {}
    for creator in CREATORS:
        if creator not in dataset:
            continue
        group, owner = creator >> 16, elements.text(dataset, creator)
        for number, (key, _) in PRIVATE.get((group, owner), {}).items():
            tag = group << 16 | (creator & 0xFF) << 8 | number
            value = elements.label(dataset, tag) if tag in dataset else ""
            if value:
                found[key] = _of_ge(key, value) if owner == GE else value
    return found


def _of_ge(key: str, value: str) -> str:
    """Return a value of GE's as others write it: a part of a complex image in words, a b-value alone."""
    first = value.split("/", maxsplit=1)[0]
    if key == "b-value" and first.isdecimal():
        return str(int(first) % GE_MOST)
    return GE_COMPONENTS.get(first, first)


def _plain(text: str) -> str:
    """Return a decimal number as `elements.label` writes a binary one, other texts as they are."""
    try:
        return f"{float(text):.10g}"
    except ValueError:
        return text


def frame_labels(place: Place, dimensions: list[str]) -> dict[str, str]:
    """Return what the functional groups of a frame tell of it.

    Args:
        place: Where its elements are.
        dimensions: The names of the file's dimensions; empty ones tell where a frame lies.
    """
    found = {}
    for key, (sequence, tag) in FRAME_DISCRIMINATORS.items():
        holder = place.find(sequence, tag)
        if holder is not None:
            found[key] = _text(holder, key, tag)
    for converted in elements.items(place.own, CONVERTED):
        found.update(image_labels(converted))
    for diffusion in elements.items(place.own, 0x00189117):
        for direction in elements.items(diffusion, 0x00189076):
            found[DIRECTION] = elements.label(direction, 0x00189089)
    segment = place.find(0x0062000A, 0x0062000B)
    if segment is not None:
        found[SEGMENT] = elements.label(segment, 0x0062000B)
    content = place.find(0x00209111, 0x00209157)
    if content is not None:
        indices = elements.numbers(content, 0x00209157) or []
        names = dimensions or [f"dimension {n + 1}" for n in range(len(indices))]
        found.update({name: f"{index:g}" for name, index in zip(names, indices, strict=False) if name})
    return found


def dimension_names(dataset: Any) -> list[str]:
    """Return a name for each dimension of an enhanced image, empty for those that tell where a frame lies."""
    names = []
    for number, item in enumerate(elements.items(dataset, 0x00209222, MOST_DIMENSIONS), 1):
        (pointer, *_) = (*elements.tags(item, 0x00209165), 0)
        told = elements.text(item, 0x00209421)
        names.append("" if pointer in IN_PLACE else f"dimension {number}" + (f", {told}" if told else ""))
    return names


def segment_names(dataset: Any) -> dict[str, str]:
    """Return the label of each segment of a segmentation object by its number."""
    items = elements.items(dataset, 0x00620002, MOST_SEGMENTS)
    return {elements.label(item, 0x00620004): elements.text(item, 0x00620005) for item in items}


def described(name: str, value: str) -> str:
    """Return a factor and its value in words; empty where there is no value."""
    if not value:
        return ""
    kinds = value.split("/")
    component = COMPONENTS.get(kinds[2]) if name in ("image type", "frame type") and len(kinds) > 2 else None
    unit = f" {UNITS[name]}" if name in UNITS else ""
    return f"{name} {value}{unit}" + (f" ({component})" if component else "")


def sort_key(value: str) -> tuple[int, list[float], str]:
    """Return a key that sorts nothing first, then numbers as numbers, then texts."""
    if not value:
        return 0, [], ""
    numbers: list[float] = []
    for part in value.split():
        try:
            numbers.append(float(part))
        except ValueError:
            break
    return 1 if numbers else 2, numbers, value
