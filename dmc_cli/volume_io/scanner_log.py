"""Read the distance of the nodes from a text that a scanner left beside its slices.

Texts of SkyScan and NRecon (`.log`), Zeiss and Scanco (`.txt`, `.log`), Nikon (`.xtekct`) and Phoenix
(`.pca`, `.pcr`) are lines of a key and its value, such as `Pixel Size (um)=17.50`. A size counts only with
its unit; what was measured at the camera does not. Where the text tells of slices, they must be those there.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from dmc_cli.notices import Notice
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.units import length_of

SUFFIXES = {".log": "", ".txt": "", ".ini": "", ".xtekct": "mm", ".pca": "mm", ".pcr": "mm"}
"""Suffixes of such texts, and the unit that lengths without one have by the format's own rule."""

LARGEST_TEXT = 1 << 18
MOST_TEXTS = 20
LONGEST_LINE = 200
"""Bytes of a text, texts in a folder and characters of a line that are looked at."""

WHOLE_KEYS = (
    *("pixel size", "voxel size", "element size", "el size", "voxel spacing", "pixel spacing"),
    *("reconstructed pixel size", "reconstructed voxel size", "effective pixel size", "effective voxel size"),
    *("isotropic voxel size", "nominal resolution", "scaled image pixel size", "image pixel size"),
)
"""Keys of a size of the nodes, along all axes or each, the surest first; the last two are those of the scan
before its reconstruction."""

SCAN_KEYS = WHOLE_KEYS[-2:]

SLICE_KEYS = ("slice increment", "slice distance", "slice spacing", "slice thickness", "slice pitch")
"""Keys of the distance of slices, the surest first."""

WIDTH_KEYS = ("result image width", "image width", "number of columns", "width")
HEIGHT_KEYS = ("result image height", "image height", "number of rows", "height")
COUNT_KEYS = ("sections count", "number of slices", "slice count")

_LINE = re.compile(r"([A-Za-z][^=:\t]*?)\s*(?:=|:|\t|  )\s*(\S.*?)\s*$")
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]+?)\s*[\])]|[_ ](um|µm|μm|mm|nm|cm)$")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBERS = re.compile(rf"({_NUMBER}(?:(?:\s*[,;x×]\s*|\s+){_NUMBER}){{0,2}})\s*[\[(]?\s*([^\d\s\])]*)")


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


@dataclass
class _Fields:
    """The lines of a text: values and units by key, spelled alike."""

    values: dict[str, tuple[list[float], str]] = field(default_factory=dict)

    def first(self, keys: tuple[str, ...]) -> str | None:
        """Return the first of the keys that there is."""
        return next((key for key in keys if key in self.values), None)

    def whole(self, keys: tuple[str, ...]) -> int | None:
        """Return the whole number of the first of the keys that there is."""
        key = self.first(keys)
        numbers = self.values[key][0] if key else []
        return int(numbers[0]) if numbers and abs(numbers[0]) < 1 << 31 else None


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
        fields = _fields(text)
        key = fields.first(WHOLE_KEYS) or _axis_key(fields)
        if key is None and "orig isq dim um" not in fields.values and "dim um" not in fields.values:
            continue
        is_of_scan = key in SCAN_KEYS
        is_named = stem.startswith(text.stem.lower()) or text.stem.lower().startswith(stem)
        log = _read(text, fields, columns, rows, slices)
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


def _fields(text: Path) -> _Fields:
    """Return the lines of a text that have a key and numbers; the first of a key counts."""
    with text.open("rb") as file:
        content = file.read(LARGEST_TEXT)
    fields = _Fields()
    for line in _decoded(content).splitlines():
        matched = _LINE.match(line.strip(" \t#;!")[:LONGEST_LINE])
        if matched is None:
            continue
        key, value = matched.groups()
        unit = ""
        told = _UNIT.search(key)
        if told is not None:
            unit = told.group(1) or told.group(2)
            key = key[: told.start()]
        numbers = _NUMBERS.match(value)
        if numbers is None:
            continue
        found = [float(number) for number in re.findall(_NUMBER, numbers.group(1))]
        fields.values.setdefault(_spelled(key), (found, unit or numbers.group(2)))
    return fields


def _decoded(content: bytes) -> str:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _spelled(key: str) -> str:
    """Return a key in small letters, its words apart: `VoxelSizeX` is `voxel size x`."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", key)
    spelled = " ".join(re.split(r"[\s_.-]+", apart)).strip().lower()
    return {"pixelsize": "pixel size", "voxelsize": "voxel size"}.get(spelled, spelled)


def _axis_key(fields: _Fields) -> str | None:
    """Return the key of sizes that are told axis by axis, without the axis, or None."""
    for key in WHOLE_KEYS:
        if all(f"{key} {axis}" in fields.values for axis in "xyz"):
            return key
    return None


def _read(text: Path, fields: _Fields, columns: int, rows: int, slices: int) -> ScannerLog:
    """Return what the lines of a text tell, with what of it is not used."""
    notes = list(_mismatch(text, fields, columns, rows, slices))
    if any(note.code == "W-GEOMETRY-CONTRADICTED" for note in notes):
        return ScannerLog(text, None, notices=tuple(notes))
    lengths, is_whole = _lengths(text, fields, notes)
    if lengths is not None and not all(math.isfinite(n) and n > 0 for n in lengths):
        notes.append(_unused(text, f"a size of {lengths[0]:g} mm", "expected a positive length"))
        lengths = None
    step = fields.whole(("section to section step",)) or 1
    return ScannerLog(text, lengths, is_whole, max(step, 1), tuple(notes))


def _mismatch(text: Path, fields: _Fields, columns: int, rows: int, slices: int) -> Iterator[Notice]:
    """Yield what the text says of the slices that they are not."""
    told = fields.whole(WIDTH_KEYS), fields.whole(HEIGHT_KEYS)
    if any(size not in (None, 0, n) for size, n in zip(told, (columns, rows), strict=True)):
        sentence = (
            f"{text.name} tells of slices of {told[0]} x {told[1]} pixels, those found have {columns} x "
            f"{rows}; the size of its pixels is not used; --spacing gives it"
        )
        yield Notice("W-GEOMETRY-CONTRADICTED", sentence)
    count = fields.whole(COUNT_KEYS)
    if count not in (None, 0, slices):
        yield Notice("W-SLICES-COUNT", f"{text.name} tells of {count} slices, {slices} were found")


def _lengths(text: Path, fields: _Fields, notes: list[Notice]) -> tuple[Triple | None, bool]:
    """Return the distances in mm, and whether that of slices is told; adds what is not used to `notes`."""
    default = SUFFIXES[text.suffix.lower()]
    axis_key = _axis_key(fields)
    if axis_key is not None:
        each = [_length(text, fields, f"{axis_key} {axis}", default, notes) for axis in "xyz"]
        ends = [lengths[0] for lengths in each if lengths]
        return ((ends[0], ends[1], ends[2]), True) if len(ends) == 3 else (None, False)
    for micrometres, nodes in (("orig isq dim um", "orig isq dim p"), ("dim um", "dim p")):
        sizes, counts = fields.values.get(micrometres, ([], ""))[0], fields.values.get(nodes, ([], ""))[0]
        if len(sizes) == len(counts) == 3 and all(counts):
            x, y, z = (1e-3 * size / count for size, count in zip(sizes, counts, strict=True))
            return (x, y, z), True
    key = fields.first(WHOLE_KEYS)
    lengths = _length(text, fields, key, default, notes) if key else []
    if not lengths:
        return None, False
    if len(lengths) == 3:
        return (lengths[0], lengths[1], lengths[2]), True
    across = (lengths[0], lengths[-1])
    slice_key = fields.first(SLICE_KEYS)
    between = _length(text, fields, slice_key, default, notes) if slice_key else []
    return ((*across, between[0]), True) if between else ((*across, lengths[0]), False)


def _length(text: Path, fields: _Fields, key: str, default: str, notes: list[Notice]) -> list[float]:
    """Return the numbers of a key in mm; none, and a note more, where the unit is missing or not known."""
    numbers, unit = fields.values[key]
    scale = length_of(unit or default)
    if scale is not None:
        return [scale * number for number in numbers]
    told = f"{key} {numbers[0]:g}"
    if unit:
        notes.append(_unused(text, f"{told} {unit[:20]}", "the unit is not known", "W-UNIT-UNKNOWN"))
    else:
        notes.append(_unused(text, told, "it has no unit", "W-UNIT-MISSING"))
    return []


def _unused(text: Path, told: str, why: str, code: str = "W-GEOMETRY-CONTRADICTED") -> Notice:
    return Notice(code, f"{text.name} tells {told}, which is not used: {why}; --spacing gives the distances")
