"""Name the files of a label map's surfaces: one a label by a template, or one for all."""

import re
from collections.abc import Sequence
from pathlib import Path

from dmc_cli.errors import SettingsError
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io import choose_format
from dmc_cli.settings import STREAM, OutputSettings
from dmc_cli.volume import Label

FIELD = re.compile(r"\{(\w*)(?::(0?\d{0,2}d?))?\}")
"""A field of a template, and the format of its number."""

_UNSAFE = re.compile(r"[^\w.+-]+")
"""What no name of a file has, on any system, and what terminals and scripts stumble over."""


def is_template(path: str) -> bool:
    """Return whether an output's name holds a field that tells labels apart."""
    return any(match[1] in ("label", "name") for match in FIELD.finditer(path))


def label_name(label: Label) -> str:
    """Return a label's name made safe for a file, or `label_5` where it has none."""
    safe = _UNSAFE.sub("_", label.name).strip("_.")
    return safe or f"label_{label.number}"


def label_paths(output: OutputSettings, source: str, labels: Sequence[Label]) -> list[str]:
    """Return the file of each label, one and the same where the output is no template.

    Raises:
        SettingsError: The template has an unknown field, is standard output, or names two labels alike; or
        one
            file cannot hold the shells of several labels.
    """
    if not is_template(output.path):
        if len(labels) > 1:
            _check_groups(output, len(labels))
        return [output.path] * len(labels)
    paths = [_filled(output.path, source, label) for label in labels]
    taken: dict[str, Label] = {}
    for path, label in zip(paths, labels, strict=True):
        other = taken.setdefault(path, label)
        if other is not label:
            raise SettingsError(
                f"{path} would be the file of label {other.number} and of label {label.number}; expected a"
                f" file for"
                " each; put {label} into the name of the output"
            )
    return paths


def group_names(labels: Sequence[Label]) -> list[str]:
    """Return a name for each label's part of a file, the number added where two are called alike."""
    names = [label_name(label) for label in labels]
    return [
        name if names.count(name) == 1 else f"{name}_{label.number}"
        for name, label in zip(names, labels, strict=True)
    ]


def _filled(template: str, source: str, label: Label) -> str:
    """Return a template with its fields filled in for a label."""
    fields: dict[str, str | int] = {
        "label": label.number,
        "name": label_name(label),
        "stem": _stem(source),
    }

    def fill(match: re.Match[str]) -> str:
        known = fields.get(match[1])
        if known is None or (match[2] and not isinstance(known, int)):
            raise SettingsError(
                f"the output is {template[:200]!r}, which cannot be filled in: found {match[0]}; expected"
                " {label}, also as in {label:03d}, {name} or {stem}"
            )
        return format(known, match[2] or "")

    return FIELD.sub(fill, template)


def _stem(source: str) -> str:
    """Return an input's name without its folder and its suffixes."""
    name = Path(source).name or Path(source).resolve().name
    return re.split(r"\.(?!\d)", name, maxsplit=1)[0].replace(":", "_") or "input"


def _check_groups(output: OutputSettings, count: int) -> None:
    """Raise SettingsError unless one file can hold the shells of several labels as groups."""
    if FORMATS[choose_format(output.path, output.output_format)].holds_groups:
        return
    known = ", ".join(name for name, known in FORMATS.items() if known.holds_groups)
    place = "standard output" if output.path == STREAM else output.path
    raise SettingsError(
        f"{place} is one file for the shells of {count} labels; expected a template with {{label}} or"
        f" {{name}} in it, as in 'shell_{{label}}.ply', or a format that has groups ({known}), or one mesh"
        " with --conforming; change its name"
    )
