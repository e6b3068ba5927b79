"""Read the distance of the nodes from a text that a scanner left beside its slices.

Texts of SkyScan and NRecon (`.log`), Zeiss and Scanco (`.txt`, `.log`), Nikon (`.xtekct`), Phoenix (`.pca`,
`.pcr`) and Volume Graphics (`.vgi`) are lines of a key and its value, such as `Pixel Size (um)=17.50`. A size
counts only with its unit; what was measured at the camera does not. Where the text tells of slices, they must
be those there. `log_fields.py` reads the lines.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.log_fields import LogFields, log_fields
from dmc_cli.volume_io.units import length_of

SUFFIXES = {".log": "", ".txt": "", ".ini": "", ".xtekct": "mm", ".pca": "mm", ".pcr": "mm", ".vgi": "mm"}
"""Suffixes of such texts, and the unit that lengths without one have by the format's own rule."""

MOST_TEXTS = 20
"""Texts in a folder that are looked at."""

WHOLE_KEYS = (
    *("voxel size rec", "reconstructed voxel size", "voxel size", "isotropic voxel size", "voxel spacing"),
    *("element size", "el size", "reconstructed pixel size", "pixel size", "pixel spacing"),
    *("effective voxel size", "effective pixel size", "nominal resolution"),
    *("scaled image pixel size", "image pixel size"),
)
"""Keys of a size of the nodes, along all axes or each, the surest first; the last two are those of the scan
before its reconstruction."""

SCAN_KEYS = WHOLE_KEYS[-2:]

ROUND_KEYS = ("nominal resolution", *SCAN_KEYS)
"""Keys of a size that another one may differ from."""

VGI_KEYS = ("resolution",)
"""Keys of a size of the nodes in `.vgi`; elsewhere a resolution may be anything."""

SLICE_KEYS = ("slice increment", "slice distance", "slice spacing", "slice thickness", "slice pitch")
"""Keys of the distance of slices, the surest first."""

WIDTH_KEYS = ("result image width", "image width", "number of columns", "width", "voxels x", "volume size x")
HEIGHT_KEYS = ("result image height", "image height", "number of rows", "height", "voxels y", "volume size y")
COUNT_KEYS = ("sections count", "number of slices", "slice count", "voxels z", "volume size z")
SIZE_KEYS = ("dim", "image size", "matrix size")
"""Keys of the pixels along x and y, and of the slices."""
PREFIX_KEY = "filename prefix"


@dataclass(frozen=True)
class ScannerLog:
    """What a text tells.

    Attributes:
        file: The text.
        spacing: Distances along x, y, z in mm; None where it tells none that can be used.
        is_whole: Whether the distance of slices is told, rather than one distance for all axes.
        step: Sections from one slice to the next.
        notices: What of it is not used, and why.
    """

    file: Path
    spacing: Triple | None
    is_whole: bool = False
    step: int = 1
    notices: tuple[Notice, ...] = ()


def log_texts(folder: Path, names: list[str]) -> list[Path]:
    """Return those of a folder's files that may be such a text, at most `MOST_TEXTS`."""
    return [folder / name for name in names if Path(name).suffix.lower() in SUFFIXES][:MOST_TEXTS]


def read_logs(texts: list[Path], columns: int, rows: int, slices: int, stem: str) -> ScannerLog | None:
    """Return what the text tells that is the surest, or None where none tells anything.

    Args:
        texts: Files that may be such a text.
        columns: Pixels along x of the slices.
        rows: Pixels along y.
        slices: How many there are.
        stem: What the slices' names begin with: of two texts the one that is called so counts.
    """
    found: list[tuple[tuple[bool, bool], ScannerLog]] = []
    for text in texts:
        fields = log_fields(text)
        key = fields.first(_whole_keys(text)) or _axis_key(text, fields)
        if key is None and "orig isq dim um" not in fields.values and "dim um" not in fields.values:
            continue
        is_of_scan = key in SCAN_KEYS
        is_named = stem.startswith(text.stem.lower()) or text.stem.lower().startswith(stem)
        notes = list(_mismatch(text, fields, (columns, rows, slices), stem, is_of_scan))
        log = _read(text, fields, notes)
        found.append(((is_of_scan, not is_named), log))
    found.sort(key=lambda each: (each[1].spacing is None, each[0]))
    if not found:
        return None
    rank, best = found[0]
    rivals = [log for other, log in found if other == rank and log.spacing not in (None, best.spacing)]
    if rivals and best.spacing is not None:
        files = f"{best.file.name} and {rivals[0].file.name}"
        sentence = f"{files} tell different sizes of the pixels; neither is used; --spacing gives them"
        return ScannerLog(best.file, None, notices=(Notice("W-GEOMETRY-CONTRADICTED", sentence),))
    return best


def _whole_keys(text: Path) -> tuple[str, ...]:
    return VGI_KEYS + WHOLE_KEYS if text.suffix.lower() == ".vgi" else WHOLE_KEYS


def _axis_key(text: Path, fields: LogFields) -> str | None:
    """Return the key of sizes that are told axis by axis, of x and y at least, without the axis, or None."""
    for key in _whole_keys(text):
        if all(f"{key} {axis}" in fields.values for axis in "xy"):
            return key
    return None


def _read(text: Path, fields: LogFields, notes: list[Notice]) -> ScannerLog:
    """Return what the lines of a text tell, with what of it is not used."""
    if any(note.code == "W-GEOMETRY-CONTRADICTED" for note in notes):
        return ScannerLog(text, None, notices=tuple(notes))
    lengths, is_whole = _lengths(text, fields, notes)
    if lengths is not None and not all(math.isfinite(n) and n > 0 for n in lengths):
        notes.append(_unused(text, f"a size of {lengths[0]:g} mm", "expected a positive length"))
        lengths = None
    notes += [] if lengths is None else _others(text, fields, lengths[0])
    step = fields.whole(("section to section step",)) or 1
    return ScannerLog(text, lengths, is_whole, max(step, 1), tuple(notes))


def _mismatch(
    text: Path, fields: LogFields, size: tuple[int, int, int], stem: str, is_of_scan: bool
) -> Iterator[Notice]:
    """Yield what the text says of the slices that they are not.

    Of a text of the scan only the width counts: rows of the camera are slices.
    """
    columns, rows, slices = size
    sizes = fields.numbers(fields.first(("size",) if text.suffix.lower() == ".vgi" else SIZE_KEYS) or "")
    if len(sizes) == 3:
        told: tuple[int | None, int | None] = int(sizes[0]), int(sizes[1])
        count: int | None = int(sizes[2])
    else:
        told = fields.whole(WIDTH_KEYS), None if is_of_scan else fields.whole(HEIGHT_KEYS)
        count = fields.whole(COUNT_KEYS)
    if any(size not in (None, 0, n) for size, n in zip(told, (columns, rows), strict=True)):
        found = f"{columns} x {rows}" if told[1] is not None else f"{columns}"
        across = f"{told[0]} x {told[1]}" if told[1] is not None else f"{told[0]}"
        sentence = (
            f"{text.name} tells of slices of {across} pixels, those found have {found}; the size of its "
            "pixels is not used; --spacing gives it"
        )
        yield Notice("W-GEOMETRY-CONTRADICTED", sentence)
    prefix = fields.texts.get(PREFIX_KEY, "").lower()
    if prefix and not stem.startswith(prefix) and not stem.startswith(text.stem.lower()):
        told_name = f"slices called {fields.texts[PREFIX_KEY][:60]}..."
        yield _unused(text, f"of {told_name}", "those found are called otherwise")
    if count not in (None, 0, slices):
        yield Notice("W-SLICES-COUNT", f"{text.name} tells of {count} slices, {slices} were found")


def _others(text: Path, fields: LogFields, across: float) -> Iterator[Notice]:
    """Yield what else the text tells of the size of the nodes along x in mm, where that differs."""
    for key in _whole_keys(text):
        name = key if key in fields.values else f"{key} x"
        if key in ROUND_KEYS or name not in fields.values:
            continue
        other = _length(text, fields, name, SUFFIXES[text.suffix.lower()], [])
        if other and abs(other[0] - across) > 0.01 * across:
            sentence = (
                f"{text.name} tells {name} {fields.values[name].told}, too, not {across:g} mm as is taken"
            )
            yield Notice("W-GEOMETRY-CONTRADICTED", f"{sentence}; --spacing tells better")


def _lengths(text: Path, fields: LogFields, notes: list[Notice]) -> tuple[Triple | None, bool]:
    """Return the distances in mm, and whether that of slices is told; adds what is not used to `notes`."""
    default = SUFFIXES[text.suffix.lower()]
    axis_key = _axis_key(text, fields)
    if axis_key is not None:
        keys = [f"{axis_key} {axis}" for axis in "xyz" if f"{axis_key} {axis}" in fields.values]
        ends = [found[0] for key in keys if (found := _length(text, fields, key, default, notes))]
        if len(ends) < len(keys):
            return None, False
        return (
            ((ends[0], ends[1], ends[2]), True) if len(ends) == 3 else _with_slices(text, fields, ends, notes)
        )
    for micrometres, nodes in (("orig isq dim um", "orig isq dim p"), ("dim um", "dim p")):
        sizes, counts = fields.numbers(micrometres), fields.numbers(nodes)
        if len(sizes) == len(counts) == 3 and all(counts):
            x, y, z = (1e-3 * size / count for size, count in zip(sizes, counts, strict=True))
            return (x, y, z), True
    key = fields.first(_whole_keys(text))
    lengths = _length(text, fields, key, default, notes) if key else []
    if not lengths:
        return None, False
    if len(lengths) == 3:
        return (lengths[0], lengths[1], lengths[2]), True
    return _with_slices(text, fields, [lengths[0], lengths[-1]], notes)


def _with_slices(
    text: Path, fields: LogFields, across: list[float], notes: list[Notice]
) -> tuple[Triple, bool]:
    """Return the distances along x and y with that of slices, and whether the text tells it."""
    default, key = SUFFIXES[text.suffix.lower()], fields.first(SLICE_KEYS)
    between = _length(text, fields, key, default, notes) if key else []
    return (across[0], across[1], between[0] if between else across[0]), bool(between)


def _length(text: Path, fields: LogFields, key: str, default: str, notes: list[Notice]) -> list[float]:
    """Return the numbers of a key in mm; none, and a note more, where they or their unit are not sure."""
    field = fields.values[key]
    told = f"{key} {field.told}"
    if field.doubt:
        notes.append(_unused(text, told, field.doubt))
        return []
    unit = field.unit or fields.texts.get("unit", "") if key in VGI_KEYS else field.unit
    scale = length_of(unit or default)
    if scale is not None:
        return [scale * number for number in field.numbers]
    if unit:
        notes.append(_unused(text, f"{told} {unit[:20]}", "the unit is not known", "W-UNIT-UNKNOWN"))
    else:
        notes.append(_unused(text, told, "it has no unit", "W-UNIT-MISSING"))
    return []


def _unused(text: Path, told: str, why: str, code: str = "W-GEOMETRY-CONTRADICTED") -> Notice:
    return Notice(code, f"{text.name} tells {told}, which is not used: {why}; --spacing gives the distances")
