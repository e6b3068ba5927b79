"""Name a batch's outputs by templates: known fields in braces, and nothing that climbs out of a folder.

A template is the user's own path with fields such as `{stem}`; what is filled in comes from the names of
inputs, which anybody may have chosen. So a field is one part of a name and never `.`, `..` or a separator,
but for `{parent}`, which is a folder.
"""

import os
import re
from pathlib import Path
from string import Formatter
from typing import Any

from dmc_cli.errors import SettingsError
from dmc_cli.isovalue_choices import isovalue_text
from dmc_cli.settings import STREAM

_FORMATS = {"isovalue": r"0?\d{0,2}(\.\d{1,2})?[efg]?", "index": r"0?\d{0,2}d?"}
"""The forms of a number that may follow a field's name, as in `{index:03d}`: none that takes much memory."""


def fill_template(option: str, template: str, fields: dict[str, Any], base: Path) -> str:
    """Fill in an option's template for one item; return the path, below the folder `base`.

    `{parent}/` at the beginning is the input's folder itself, wherever it is. Further on it is that folder
    without what would lead out of the path before it, and without a `/` behind it the folder's name.

    Raises:
        SettingsError: The template is standard output or no file, or holds something else than the fields.
    """
    if template == STREAM:
        raise SettingsError(
            f"{option} is -, but standard output is one file, or has a batch's outcomes; give a template of"
            " file names"
        )
    try:
        pieces = list(Formatter().parse(template))
    except ValueError as error:
        raise _not_filled(option, template, fields, str(error)) from error
    text = ""
    for position, (literal, field, form, conversion) in enumerate(pieces):
        text += literal
        if field is None:
            continue
        if field not in fields or conversion or not _takes(field, fields[field], form or ""):
            shown = f"{field}!{conversion}" if conversion else f"{field}:{form}" if form else field
            raise _not_filled(option, template, fields, f"found {{{shown[:60]}}}")
        if field == "parent":
            follows = next((after for after, *_ in pieces[position + 1 :]), "")
            text += _folder(fields["parent"], base, leads=not text, is_path=follows.startswith("/"))
        else:
            text += _filled(field, fields[field], form or "")
    if Path(text).name in ("", os.pardir):
        raise SettingsError(
            f"{option} is {template[:200]!r}, which names no file; give a template of file names"
        )
    return str(base / text)


def _takes(field: str, value: Any, form: str) -> bool:
    """Return whether a field can be filled in so: words that choose an isovalue have no form of a number."""
    is_word = field == "isovalue" and not isinstance(value, float | int)
    return not form if is_word else bool(re.fullmatch(_FORMATS.get(field, ""), form))


def _filled(field: str, value: Any, form: str) -> str:
    """Return the text of a field."""
    if field == "isovalue" and not isinstance(value, float | int):
        return name_part(isovalue_text(value).replace(":", "-"))
    return format(value, form or ("g" if field == "isovalue" else ""))


def name_part(text: str) -> str:
    """Return a text as one part of a path: without a separator, neither empty nor a folder above."""
    text = re.sub(r"[/\\\0]", "_", text)
    return text if text.strip(".") else "_" * max(len(text), 1)


def _folder(parent: Path, base: Path, *, leads: bool, is_path: bool) -> str:
    """Return an input's folder as it is filled in at one place of a template."""
    if not is_path:
        return name_part((base / parent).resolve().name)
    if leads:
        return str(parent)
    return "/".join(part for part in parent.parts if part not in (os.pardir, parent.anchor)) or os.curdir


def _not_filled(option: str, template: str, fields: dict[str, Any], found: str) -> SettingsError:
    """Say why a template cannot be filled in, and what it may hold."""
    known = ", ".join(f"{{{field}}}" for field in fields)
    return SettingsError(
        f"{option} is {template[:200]!r}, which cannot be filled in: {found}; expected {known}, of numbers"
        " also the format, as in {index:03d} and {isovalue:.1f}"
    )
