"""Read the table of labels in an extension of a NIfTI header, as Caret and TotalSegmentator write it.

The extension is XML: `<Label Key="1" Red="0.5" ...><![CDATA[spleen]]></Label>` in a `<LabelTable>`. Only
these elements are looked for, by their text; nothing else of it is read.
"""

import re
from html import unescape
from pathlib import Path

from dmc_cli.volume import Color, Label
from dmc_cli.volume_io.content import first_bytes

MOST_BYTES = 1 << 22
"""The longest header with extensions that is looked at."""

_LABEL = re.compile(r"<Label\b([^>]*)>\s*(?:<!\[CDATA\[(.*?)\]\]>|([^<]*))\s*</Label>", re.DOTALL)
_ATTRIBUTE = re.compile(r"""(\w+)\s*=\s*["']([^"']*)["']""")


def extension_labels(path: Path, name: str, start: int, end: int) -> tuple[Label, ...]:
    """Return the labels that the extensions of a header name; none where there are none.

    Args:
        path: The file with the header.
        name: The input, for messages.
        start: Where the header proper ends.
        end: Where the extensions end.
    """
    if not start + 4 < end <= MOST_BYTES:
        return ()
    found = first_bytes(path, name, end)[start:]
    if not found or found[0] == 0 or b"<LabelTable" not in found:
        return ()
    text = found.decode("utf-8", "replace")
    labels = []
    for attributes, literal, plain in _LABEL.findall(text[text.index("<LabelTable") :]):
        told = dict(_ATTRIBUTE.findall(attributes))
        key = told.get("Key", "")
        if re.fullmatch(r"-?\d{1,10}", key) and int(key):
            title = literal.strip() or unescape(plain).strip()
            labels.append(Label(value=int(key), number=int(key), name=title, color=_color(told)))
    return tuple(labels)


def _color(told: dict[str, str]) -> Color | None:
    """Return the colour of attributes that are shares of 1."""
    try:
        red, green, blue = (round(255 * min(max(float(told[k]), 0.0), 1.0)) for k in ("Red", "Green", "Blue"))
    except (KeyError, ValueError):
        return None
    return red, green, blue
