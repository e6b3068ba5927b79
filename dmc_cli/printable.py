"""Make text from outside harmless: what no terminal prints becomes a visible escape.

Names of files, entries of a zip, DICOM's texts and messages of libraries may hold anything: sequences that
move a terminal's cursor or set its title, letters that turn the order of the others round, halves of
characters where a name is no UTF-8.
"""

import unicodedata
from typing import Any


def printable(text: str, keep: str = "\n\t") -> str:
    """Return a text with all that is not printed escaped as Python does it, but for the characters `keep`.

    Control and format characters, lone surrogates, private and unassigned ones are not printed.
    """
    if text.isprintable():
        return text
    return "".join(
        letter if letter in keep or _is_printed(letter) else letter.encode("unicode_escape").decode()
        for letter in text
    )


def short_number(value: float) -> str:
    """Return the shortest text of a number that reads back as it."""
    text = f"{value:g}"
    return text if float(text) == value else repr(value)


def json_text(value: Any, indent: int | None = None) -> str:
    """Return a value as JSON that reads well and can be printed and encoded, whatever its texts hold."""
    import json

    text = json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False)
    if text.replace("\n", "").isprintable():
        return text
    return "".join(
        letter if letter == "\n" or _is_printed(letter) else json.dumps(letter)[1:-1] for letter in text
    )


def _is_printed(letter: str) -> bool:
    """Return whether a character is seen as it is: a letter, a sign, or a space of any width."""
    return letter.isprintable() or unicodedata.category(letter) == "Zs"
