"""Tell what the pages of a TIFF are beside slices: previews, other images, how they are to be shown."""

from collections.abc import Iterator
from typing import Any

from dmc_cli.notices import Notice, notices
from dmc_cli.volume_io.image_kinds import turned
from dmc_cli.volume_io.left_out import left_out

MIN_IS_WHITE, MIN_IS_BLACK, RGB, PALETTE = range(4)
"""Photometric interpretations; values of the first and the last are no brightness."""

GREY = (MIN_IS_WHITE, MIN_IS_BLACK)

SEQUENCES = {
    **{"scanimage": "ScanImage", "stk": "MetaMorph", "metaseries": "MetaSeries", "andor": "Andor"},
    **{"epics": "EPICS", "nuvu": "Nuvu", "tvips": "TVIPS", "eer": "EER", "streak": "a streak camera"},
    **{"pilatus": "Pilatus", "micromanager": "Micro-Manager"},
}
"""tifffile's flags of programs whose pages are as often times or channels as slices, and their names."""

ORIENTATION = 274
"""The tag that says how a page is to be turned."""


def pages_told(tiff: Any, number: int) -> tuple[Notice, ...]:
    """Return what is told of a file's pages, of which those of the image `number` are taken."""
    series = tiff.series[number]
    notes = []
    program = next((title for flag, title in SEQUENCES.items() if getattr(tiff, f"is_{flag}", False)), None)
    if program is not None and any(letter in "IQ" for letter in series.axes):
        told = f"the TIFF of {program} does not say what its pages count; they are taken as slices"
        notes.append(Notice("W-AXES-MISSING", told))
    for named, kind in ((tiff.is_ome, "ome"), (tiff.is_imagej, "imagej")):
        if named and series.kind != kind:
            told = f"the TIFF's metadata of {kind} cannot be read; its pages are taken as slices"
            notes.append(Notice("W-AXES-MISSING", told))
    return (*notes, *_left_out(tiff, number))


def _left_out(tiff: Any, number: int) -> Iterator[Notice]:
    """Yield what is told of pages that are in no stack, and of those that lie between the slices.

    Previews, masks and images in colours are expected beside a stack; where they lie says nothing of it.
    """
    series = tiff.series[number]
    count = sum(len(each) for each in tiff.series)
    if series.kind in ("ome", "imagej") and len(tiff.series) == 1 < count < len(tiff.pages):
        sentence = f"the TIFF's metadata tell of {count} pages, it has {len(tiff.pages)}; the first are taken"
        yield Notice("W-GEOMETRY-CONTRADICTED", sentence)
    if series.kind != "generic":
        return
    places = _places(series)
    others = [
        (other.shape, _places(other))
        for other in tiff.series
        if other is not series and not is_aside(other) and "S" not in other.axes
    ]
    for shape, found in others:
        if any(min(places) < place < max(places) for place in found):
            sentence = (
                f"pages of {shape[-1]} x {shape[-2]} pixels lie between the slices, of another size or type"
            )
            yield Notice("W-GEOMETRY-CONTRADICTED", f"{sentence}; the slices are taken as neighbours")
    beside = [f"page {found[0]}" for _, found in others if len(found) == 1]
    yield from notices("W-FILES-LEFT-OUT", left_out(beside, "image", "images"))


def _places(series: Any) -> list[int]:
    """Return the numbers of a series' pages in their file."""
    return [page.index for page in series.pages if page is not None and isinstance(page.index, int)] or [0]


def is_colored(series: Any) -> bool:
    """Return whether an image has colours or transparency, not channels beside each other in its pages."""
    page = series.keyframe
    is_plain = int(page.photometric) in GREY
    return "S" in series.axes and not (is_plain and not {1, 2} & {*map(int, page.extrasamples)})


def is_aside(series: Any) -> bool:
    """Return whether an image is a smaller copy of another one, or a mask."""
    return bool(series.keyframe.is_reduced or series.keyframe.is_mask)


def shown(page: Any) -> tuple[Notice, ...]:
    """Return how a page is to be shown, where that is not as it is stored: no brightness, or turned."""
    photometric = int(page.photometric)
    notes = []
    if photometric == MIN_IS_WHITE:
        told = "the TIFF's lowest value is white (WhiteIsZero); values are taken as they are stored"
        notes.append(Notice("W-PHOTOMETRIC", told))
    if photometric == PALETTE:
        told = "the TIFF's values are places in a colour table; they are taken as they are stored"
        notes.append(Notice("W-PHOTOMETRIC", told))
    notes += turned(page.tags.valueof(ORIENTATION), "TIFF")
    return tuple(notes)
