"""Read the layers of a label map, name their labels, and choose those that are wanted.

Labels that overlap lie in several volumes of a file, its layers, and each layer is a label map of its own.
Names and colours come from the table that is given, else from the file, else from the table beside it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray, IntArray
from dmc_cli.errors import AmbiguousVolumeError, SettingsError
from dmc_cli.notices import Notice
from dmc_cli.progress import Progress
from dmc_cli.settings import LabelSettings
from dmc_cli.volume import Label, LabelValues, Volume, find_labels
from dmc_cli.volume_io import read_label_names, read_volume, table_beside

MOST_TOLD = 40
"""Labels that a message lists."""


@dataclass(frozen=True)
class Layer:
    """A label map with the labels that are wanted of it.

    Attributes:
        volume: Its nodes.
        labels: Those that are wanted, ascending by their values.
        stored: The stored value of each.
        counts: Its nodes, int64 (n,).
        parts: What was done to each to have a part of it, for the report; none where the whole was wanted.
    """

    volume: Volume
    labels: list[Label]
    stored: AnyArray
    counts: IntArray
    parts: tuple[dict[str, Any], ...] = ()


def read_layers(settings: LabelSettings, progress: Progress) -> list[Volume]:
    """Return the label maps of an input: one, or a layer each where the file says that labels lie in several.

    Raises:
        DmcError: As `read_volume`.
    """
    try:
        return [read_volume(settings.input, settings.read, progress)]
    except AmbiguousVolumeError:
        if settings.read.volume_index is not None:
            raise
        first = _layer(settings, 0, progress)
        layers = sorted({label.layer for label in first.labels}) if first is not None else []
        if not layers:
            raise
    return [read_volume(settings.input, replace(settings.read, volume_index=n), progress) for n in layers]


def choose_labels(
    settings: LabelSettings, volumes: Sequence[Volume]
) -> tuple[list[Layer], tuple[Notice, ...]]:
    """Return each layer with the labels that are wanted of it, and what is told of those that no node has.

    Raises:
        VolumeError: A value is no whole number, or the table of names cannot be read.
        SettingsError: A label is wanted that is not there; the message lists those that are.
    """
    own = volumes[0].labels
    table = _names(settings, own)
    layers = sorted({label.layer for label in own})
    if len(volumes) == 1:
        layers = [settings.read.volume_index or 0 if len(layers) > 1 else 0 if not layers else layers[0]]
    found = [find_labels(volume) for volume in volumes]
    named = [
        _named(values, [label for label in table if label.layer == layer or not own], layer)
        for values, layer in zip(found, layers, strict=True)
    ]
    present = [label for labels in named for label in labels]
    wanted = _wanted(settings, present)
    chosen = []
    for volume, values, labels in zip(volumes, found, named, strict=True):
        places = np.array([n for n, label in enumerate(labels) if label in wanted], np.int64)
        kept = [labels[n] for n in places]
        chosen.append(Layer(volume, kept, values.stored[places], values.counts[places]))
    return chosen, _absent(settings, [label for label in own if label.layer in layers], present)


def _layer(settings: LabelSettings, number: int, progress: Progress) -> Volume | None:
    """Return a volume of an input with several, None where that does not choose one."""
    try:
        return read_volume(settings.input, replace(settings.read, volume_index=number), progress)
    except AmbiguousVolumeError:
        return None


def _names(settings: LabelSettings, own: tuple[Label, ...]) -> tuple[Label, ...]:
    """Return what labels are called, by the first source that says something; `own` is the file's."""
    if settings.label_names is not None:
        table = {label.number: label for label in read_label_names(settings.label_names)}
        kept = [_renamed(label, table.get(label.number)) for label in own]
        return tuple(kept) if own else tuple(table.values())
    if own:
        return own
    beside = table_beside(settings.input)
    return () if beside is None else read_label_names(beside)


def _renamed(label: Label, told: Label | None) -> Label:
    """Return a label with the name and colour of another one, if there is one."""
    return label if told is None else replace(label, name=told.name, color=told.color)


def _named(values: LabelValues, table: Sequence[Label], layer: int) -> list[Label]:
    """Return a label for each value of a layer, as the table has it where it has one."""
    known = {label.value: label for label in table}
    return [
        known.get(value, Label(value=value, number=value, layer=layer)) for value in values.labels.tolist()
    ]


def _wanted(settings: LabelSettings, present: Sequence[Label]) -> set[Label]:
    """Return the labels that are wanted, by number or by name in any case."""
    if not settings.labels or "all" in settings.labels:
        return set(present)
    wanted, missing = set(), []
    for word in settings.labels:
        fitting = [label for label in present if str(label.number) == word]
        fitting = fitting or [label for label in present if label.name.casefold() == word.casefold()]
        wanted.update(fitting)
        if not fitting:
            missing.append(word)
    if missing:
        told = [f"{label.number} {label.name}".strip() for label in present[:MOST_TOLD]]
        told += ["..."] if len(present) > MOST_TOLD else []
        raise SettingsError(
            f"no node of {settings.input} has the label {', '.join(missing)}; expected all, or one of"
            f" {', '.join(told) or 'none: every node is background'}; change --labels"
        )
    return wanted


def _absent(settings: LabelSettings, own: Sequence[Label], present: Sequence[Label]) -> tuple[Notice, ...]:
    """Return a warning of labels that the file itself names, but that no node has."""
    numbers = {label.number for label in present}
    absent = [label for label in own if label.number and label.number not in numbers]
    if not absent:
        return ()
    told = ", ".join(f"{label.number} {label.name}".strip() for label in absent[:MOST_TOLD])
    more = f" and {len(absent) - MOST_TOLD} more" if len(absent) > MOST_TOLD else ""
    sentence = f"{settings.input} names labels that no node has: {told}{more}"
    return (Notice("W-LABELS-ABSENT", sentence),)
