"""Find what an HDF5 file calls the axes of a dataset: NeXus' names, vigra's tags, labels of dimensions.

NeXus: NXdata's attribute `axes` names a dataset of places along each axis, with its `units`. vigra, and
ilastik with it, keeps names in the attribute `axistags`, a JSON text. NetCDF and others attach scales, such
datasets of places, to the dimensions, or label these.
"""

import json
from contextlib import suppress
from typing import Any

import numpy as np

from dmc_cli.array_types import AnyArray
from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.axes import UNNAMED, Image, nameless_image
from dmc_cli.volume_io.hdf5.links import followed, text_of
from dmc_cli.volume_io.hdf5.nexus import field_scale
from dmc_cli.volume_io.hdf_storage import Attributes, check_inside, check_stored
from dmc_cli.volume_io.loose_lengths import axis_names
from dmc_cli.volume_io.places import Along, cf_axis, named_image

ANGLES_BESIDE = ("theta", "rotation_angle")
"""Datasets beside a stack of projections, with an angle for each."""

VIGRA_NAMES = {"x": "x", "y": "y", "z": "z", "t": "time", "c": "channel"}


def named_axes(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> tuple[Image, list[Along]]:
    """Return a dataset's axes, unnamed where the file does not name them, and what it says of each.

    Raises:
        UnsupportedFormatError: They are not those of a volume: projections, times, energies.
    """
    told = _nexus(file, dataset, group, name, h5py) or _vigra(dataset) or _dimensions(dataset, h5py)
    if told is None:
        _check_no_angles(file, dataset, name, h5py)
        names = axis_names(Attributes(dataset), dataset.ndim)
        if not names:
            return nameless_image(dataset.shape), [Along("", int(size)) for size in dataset.shape]
        told = [(label, None) for label in names]
    along = [
        _along(file, group, label, places, int(size), name, h5py)
        for (label, places), size in zip(told, dataset.shape, strict=True)
    ]
    image = named_image(along)
    if image.grid is None:
        others = [each for each in along if each.kind not in (UNNAMED, "x", "y", "z")]
        other = others[0] if others else along[0]
        raise UnsupportedFormatError(
            f"{name}: the axis {other.label} in {other.unit or 'unknown units'} found among the last three; "
            "expected axes of space: projections are no slices; give the dataset of the reconstruction"
        )
    return image, along


def _along(file: Any, group: Any, label: str, places: Any, size: int, name: str, h5py: Any) -> Along:
    """Return what a file says of an axis by its name and its dataset of places, which may be none."""
    if not isinstance(places, h5py.Dataset) or places.shape != (size,):
        return Along(label, size)

    def read() -> AnyArray:
        check_inside(places, name)
        check_stored(places, places.file.id.get_filesize(), name, "copy it with h5repack")
        slope, intercept, _ = field_scale(file, group, label, name, h5py) or (1.0, 0.0, ())
        return slope * np.asarray(places[()], np.float64) + intercept

    unit = text_of(Attributes(places).get("units", ""))
    return Along(label, size, unit, cf_axis(Attributes(places), text_of), read)


def _nexus(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> list[tuple[str, Any]] | None:
    """Return names and places that NXdata has, or None."""
    named = Attributes(group).get("axes", Attributes(dataset).get("axes"))
    labels = [text_of(label) for label in np.atleast_1d(named)] if named is not None else []
    if len(labels) == 1 and len(labels) < dataset.ndim:
        labels = labels[0].replace(",", ":").split(":")
    if len(labels) != dataset.ndim:
        return None
    return [
        ("", None) if label == "." else (label, followed(file, f"{group.name}/{label}", name, h5py))
        for label in labels
    ]


def _vigra(dataset: Any) -> list[tuple[str, Any]] | None:
    """Return names by vigra's attribute, or None; it has no places."""
    text = text_of(Attributes(dataset).get("axistags", ""))
    if not text:
        return None
    keys = [str(axis["key"]) for axis in json.loads(text)["axes"]]
    if len(keys) != dataset.ndim:
        raise ValueError(f"{len(keys)} axistags for {dataset.ndim} axes")
    return [(VIGRA_NAMES.get(key, f"axis {key}"), None) for key in keys]


def unused_resolution(dataset: Any) -> tuple[Notice, ...]:
    """Return what is told of distances in vigra's attribute, which has no units; 0 is none."""
    with suppress(ValueError, TypeError, KeyError, AttributeError, RecursionError):
        axes = json.loads(text_of(Attributes(dataset).get("axistags", "")) or "{}").get("axes", ())
        told = [axis for axis in axes if axis["key"] in ("x", "y", "z") and axis.get("resolution", 0)]
        if told:
            sentence = "the resolution in axistags has no unit and is not used; --spacing gives lengths"
            return (Notice("W-UNIT-MISSING", sentence),)
    return ()


def _dimensions(dataset: Any, h5py: Any) -> list[tuple[str, Any]] | None:
    """Return labels of dimensions and the first scale attached to each, or None where none has either."""
    told: list[tuple[str, Any]] = []
    for dimension in dataset.dims:
        scale = dimension[0] if len(dimension) else None
        scale = scale if isinstance(scale, h5py.Dataset) else None
        label = str(dimension.label or "")
        told.append((label or (str(scale.name).rpartition("/")[2] if scale is not None else ""), scale))
    return told if any(label for label, _ in told) else None


def _check_no_angles(file: Any, dataset: Any, name: str, h5py: Any) -> None:
    """Raise UnsupportedFormatError for a dataset with an angle a slice beside it."""
    for label in ANGLES_BESIDE:
        beside = followed(file, f"{dataset.parent.name}/{label}", name, h5py)
        if isinstance(beside, h5py.Dataset) and beside.shape == dataset.shape[:1]:
            raise UnsupportedFormatError(
                f"{name}: {dataset.name} has an angle a slice in {label} beside it; expected axes of space: "
                "projections are no slices; give the dataset of the reconstruction"
            )
