"""Find what an HDF5 file calls the axes of a dataset: NeXus' names, vigra's tags, labels of dimensions.

NeXus: NXdata's attribute `axes` names a dataset of places along each axis, with its `units`. vigra, and
ilastik with it, keeps names in the attribute `axistags`, a JSON text. NetCDF and others attach scales, such
datasets of places, to the dimensions, or label these.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmc_cli.errors import UnsupportedFormatError
from dmc_cli.volume_io.axes import SPELLINGS, UNNAMED, Axis, Image, nameless_image
from dmc_cli.volume_io.hdf5.dataset import followed, text_of
from dmc_cli.volume_io.units import is_time, length_of

NO_LENGTHS = frozenset(
    (
        *("deg", "degree", "degrees", "rad", "radian", "radians", "mrad", "ev", "kev", "mev", "j", "joule"),
        *("k", "kelvin", "degc", "celsius", "pa", "kpa", "mpa", "bar", "t", "tesla", "v", "volt", "mv"),
        *("1/angstrom", "angstrom^-1", "angstrom-1", "1/a", "a^-1", "1/nm", "nm^-1", "1/m", "m^-1", "%"),
    )
)
"""Units, in lower case, of axes that are none of space."""

NO_SPACE = frozenset(
    (
        *("theta", "phi", "omega", "chi", "angle", "angles", "rotation", "tilt", "projection", "projections"),
        *(
            "energy",
            "wavelength",
            "frequency",
            "temperature",
            "pressure",
            "tof",
            "time_of_flight",
            "frame_number",
        ),
        *("q", "qx", "qy", "qz", "q_x", "q_y", "q_z", "image", "images", "scan", "polarization", "echo"),
        *("position", "positions", "tile", "tiles", "view", "views", "sample", "samples", "component"),
    )
)
"""Names of axes, in lower case, that count something else than places."""

ANGLES_BESIDE = ("theta", "rotation_angle")
"""Datasets beside a stack of projections, with an angle for each."""

VIGRA_NAMES = {"x": "x", "y": "y", "z": "z", "t": "time", "c": "channel"}


@dataclass(frozen=True)
class NamedAxes:
    """A dataset's axes.

    Attributes:
        image: Their names and sizes.
        places: For each axis the dataset of places along it, or None.
        labels: For each axis what the file calls it.
    """

    image: Image
    places: tuple[Any, ...]
    labels: tuple[str, ...]


def named_axes(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> NamedAxes:
    """Return a dataset's axes, unnamed where the file does not name them.

    Raises:
        UnsupportedFormatError: They are not those of a volume: projections, times, energies.
    """
    told = _nexus(file, dataset, group, name, h5py) or _vigra(dataset) or _dimensions(dataset, h5py)
    if told is None:
        _check_no_angles(file, dataset, name, h5py)
        image = nameless_image(dataset.shape)
        return NamedAxes(image, (None,) * dataset.ndim, ("",) * dataset.ndim)
    labels = tuple(label for label, _ in told)
    places = tuple(
        places if isinstance(places, h5py.Dataset) and places.shape == (size,) else None
        for (_, places), size in zip(told, dataset.shape, strict=True)
    )
    axes = tuple(
        Axis(_kind(label, unit_of(along)), int(size))
        for label, along, size in zip(labels, places, dataset.shape, strict=True)
    )
    image = Image(axes)
    if image.grid is None:
        others = [k for k, axis in enumerate(axes) if axis.kind not in ("x", "y", "z")]
        label, unit = labels[others[0]], unit_of(places[others[0]])
        raise UnsupportedFormatError(
            f"{name}: the axis {label} in {unit or 'unknown units'} found among the last three; expected "
            "axes of space: projections are no slices; give the dataset of the reconstruction"
        )
    return NamedAxes(image, places, labels)


def unit_of(places: Any) -> str:
    """Return the unit of a dataset of places, or nothing."""
    return "" if places is None else text_of(places.attrs.get("units", ""))


def _kind(label: str, unit: str) -> str:
    """Return an axis' name as `Axis` has it, `UNNAMED` where it may be one of space."""
    plain = label.lower().removeprefix("tomo_").removesuffix("_pixel").strip()
    kind = Axis(plain, 1).kind
    if is_time(unit):
        return "time"
    if kind in SPELLINGS:
        return kind
    is_other = length_of(unit) is None and unit.strip().lower() in NO_LENGTHS
    return label if is_other or plain in NO_SPACE or "angle" in plain else UNNAMED


def _nexus(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> list[tuple[str, Any]] | None:
    """Return names and places that NXdata has, or None."""
    named = group.attrs.get("axes", dataset.attrs.get("axes"))
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
    text = text_of(dataset.attrs.get("axistags", ""))
    if not text:
        return None
    keys = [str(axis["key"]) for axis in json.loads(text)["axes"]]
    if len(keys) != dataset.ndim:
        raise ValueError(f"{len(keys)} axistags for {dataset.ndim} axes")
    return [(VIGRA_NAMES.get(key, f"axis {key}"), None) for key in keys]


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
