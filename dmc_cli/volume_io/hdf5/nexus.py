"""Read what NeXus keeps beside a field of NXdata: its scale, and where the world is.

Source: the base class NXdata: corrected values are (field + FIELD_offset) * FIELD_scaling_factor; before 2018
the factors of the signal were called `scaling_factor` and `offset`. `depends_on` names transformations
(NXtransformations) that turn and move the field; they are not applied.
"""

from typing import Any

import numpy as np

from dmc_cli.notices import Notice
from dmc_cli.volume_io.hdf5.links import followed, text_of
from dmc_cli.volume_io.hdf_storage import Attributes, check_inside

Scale = tuple[float, float, tuple[Notice, ...]]


def signal_scale(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> Scale | None:
    """Return slope and intercept of a dataset and what is told, by what it is called in a group.

    Raises:
        UnsupportedFormatError: A link leads out of the file.
    """
    signal = text_of(Attributes(group).get("signal", ""))
    is_signal = bool(signal) and followed(file, f"{group.name}/{signal}", name, h5py) == dataset
    label = signal if is_signal else str(dataset.name).rpartition("/")[2]
    is_signal = is_signal or "signal" in Attributes(dataset)
    return field_scale(file, group, label, name, h5py, is_signal)


def field_scale(
    file: Any, group: Any, label: str, name: str, h5py: Any, is_signal: bool = False
) -> Scale | None:
    """Return slope and intercept of a field of a group and what is told, None where nothing tells them.

    Args:
        file: An open file of h5py.
        group: The group.
        label: The field's name in it.
        name: The input, for messages.
        h5py: The package.
        is_signal: Whether the old names mean it.

    Raises:
        UnsupportedFormatError: A link leads out of the file.
    """
    found = []
    for key, neutral in (("scaling_factor", 1.0), ("offset", 0.0)):
        places = [f"{group.name}/{label}_{key}"]
        if is_signal and text_of(Attributes(group).get("NX_class", "")) == "NXdata":
            places.append(f"{group.name}/{key}")
        datasets = [followed(file, place, name, h5py) for place in places]
        told = next((each for each in datasets if isinstance(each, h5py.Dataset)), None)
        found.append(neutral if told is None else _number(told, name))
        if told is not None and found[-1] is None:
            return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", f"{told.name} is no number; values are as stored"),)
    factor, offset = found
    if factor == 1.0 and offset == 0.0:
        return None
    if factor is None or offset is None or factor == 0 or not np.isfinite([factor, offset]).all():
        sentence = f"{label}_scaling_factor {factor} and offset {offset} are none; values are as stored"
        return 1.0, 0.0, (Notice("W-RESCALE-UNKNOWN", sentence),)
    return factor, factor * offset, ()


def _number(dataset: Any, name: str) -> float | None:
    """Return the only number of a dataset, None where it has none or several."""
    if dataset.size != 1 or dataset.dtype.kind not in "iuf":
        return None
    check_inside(dataset, name)
    return float(np.asarray(dataset[()]).item())


def moved(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> tuple[Notice, ...]:
    """Return what is told of transformations on which a dataset depends.

    Raises:
        UnsupportedFormatError: A link leads out of the file.
    """
    told = [text_of(Attributes(owner).get("depends_on", "")) for owner in (dataset, group)]
    for owner in (group, dataset.parent):
        field = followed(file, f"{owner.name}/depends_on", name, h5py)
        if isinstance(field, h5py.Dataset) and field.size == 1 and field.dtype.kind in "OS":
            check_inside(field, name)
            told.append(text_of(np.asarray(field[()]).reshape(-1)[0]))
    named = next((each for each in told if each not in ("", ".")), None)
    if named is None:
        return ()
    sentence = f"{dataset.name} depends on the transformations {named[:60]!r}, which are not applied"
    return (Notice("W-ORIENTATION-MISSING", f"{sentence}; axes and origin are the grid's own"),)
