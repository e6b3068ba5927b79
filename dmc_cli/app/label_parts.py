"""Take the part of a label map that is wanted, on its nodes before the surfaces are made.

box of nodes -> codes -> other distances -> each label opened, closed -> its components kept -> its cavities
filled
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmc_cli.app.label_choice import MOST_TOLD, Layer
from dmc_cli.app.memory_budget import held_bytes, reserve
from dmc_cli.array_types import Int64Array
from dmc_cli.errors import EmptySurfaceError
from dmc_cli.notices import Notice
from dmc_cli.runtime import Device
from dmc_cli.settings import LabelSettings
from dmc_cli.volume import Label, Volume, encode_labels

CODE_BYTES = 2
"""Bytes of a node's code."""

SHARE_BYTES = 4
"""Bytes of the part of a new node that has a label, while nodes are taken at other distances."""


@dataclass(frozen=True)
class LabelPart:
    """The layers of a label map of which a part was taken.

    Attributes:
        layers: The layers; the values of their volumes are codes, and labels without a node are left out.
        notices: Which labels have no node any more.
    """

    layers: list[Layer]
    notices: tuple[Notice, ...]


def take_part(settings: LabelSettings, layers: Sequence[Layer], device: Device) -> LabelPart:
    """Return the part of each layer that is wanted.

    Raises:
        SettingsError: A box lies outside, or a distance or a width fits no nodes.
        EmptySurfaceError: No label has a node any more.
        MemoryBudgetError: What that takes does not fit beside the volume.
    """
    taken = [_part_of_layer(settings, layer, device) for layer in layers]
    lost = [
        label
        for before, after in zip(layers, taken, strict=True)
        for label in before.labels
        if label not in after.labels
    ]
    if lost and not any(layer.labels for layer in taken) and not settings.output.allow_empty:
        raise EmptySurfaceError(
            f"no node is left of {_listed(lost)}; expected some; take a larger part, or allow an empty mesh"
            " with --allow-empty"
        )
    sentence = f"labels that the part which was taken has no node of: {_listed(lost)}"
    return LabelPart(taken, (Notice("W-LABELS-GONE", sentence),) if lost else ())


def _part_of_layer(settings: LabelSettings, layer: Layer, device: Device) -> Layer:
    """Return the part of a layer."""
    source, part, count = layer.volume, settings.part, len(layer.labels)
    volume = source

    def hold(more: int) -> None:
        held = held_bytes(source)
        taken = held + CODE_BYTES * math.prod(volume.shape)
        reserve({"prepare": taken + more}, held, settings, "the label map and what taking a part needs")

    if part.crop is not None:
        from dmc_cli.parts import crop_volume

        volume = crop_volume(source, part.crop)
    hold(CODE_BYTES * math.prod(n + 2 for n in volume.shape))
    codes = np.ascontiguousarray(encode_labels(volume, layer.stored)[1:-1, 1:-1, 1:-1])
    volume = replace(
        volume, values=codes, slope=1.0, intercept=0.0, padding=None, gradient=None, formula=None
    )
    if part.resample is not None:
        from dmc_cli.parts import resampled_labels, resampled_shape

        new = math.prod(resampled_shape(volume, part.resample))
        hold(3 * SHARE_BYTES * (new + max(new, math.prod(volume.shape))))
        volume = resampled_labels(volume, count, part.resample, device)
    done: Sequence[dict[str, Any]] = [{} for _ in range(count)]
    if part.selects:
        from dmc_cli.parts import select_labels

        volume, done = select_labels(volume, count, part, device, hold)
    return _left(layer, volume, done)


def _left(layer: Layer, volume: Volume, done: Sequence[dict[str, Any]]) -> Layer:
    """Return a layer with its codes as a volume, without labels that no node has."""
    counts = np.zeros(len(layer.labels) + 1, np.int64)
    for plane in volume.values:
        counts += np.bincount(plane.ravel(), minlength=len(counts))
    kept: Int64Array = np.flatnonzero(counts[1:])
    labels: list[Label] = [layer.labels[n] for n in kept]
    stored = (kept + 1).astype(np.uint16)
    return Layer(volume, labels, stored, counts[1:][kept], tuple(done[n] for n in kept))


def _listed(labels: Sequence[Label]) -> str:
    """Return labels in words."""
    told = ", ".join(f"{label.number} {label.name}".strip() for label in labels[:MOST_TOLD])
    return told + (f" and {len(labels) - MOST_TOLD} more" if len(labels) > MOST_TOLD else "")
