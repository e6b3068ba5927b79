"""Read the XML beside a BigDataViewer file: what its setups are, their voxels, where each view lies.

Source: the `SpimData` of BigDataViewer. `voxelSize` has the distances of the nodes and their unit; a view's
registration, the product of its affine maps, leads from its nodes to the world, in voxels of some setup.
"""

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.notices import Notice
from dmc_cli.volume_io.data_files import named_file
from dmc_cli.volume_io.layout import Triple, exists
from dmc_cli.volume_io.within import Bounds

MOST_BYTES = 1 << 24
"""Longest XML that is read."""

ROOT = b"<SpimData"

_SAME = 1e-3
"""Part by which a registration's scale and the voxel size may differ: both are rounded."""


@dataclass(frozen=True)
class Setup:
    """What the XML says of the images of one setup.

    Attributes:
        label: Its name.
        spacing: Distances of its nodes along x, y, z in `unit`, or None.
        unit: As the XML spells it.
        attributes: Number of its channel, angle, illumination, tile, ...
    """

    label: str = ""
    spacing: Triple | None = None
    unit: str = ""
    attributes: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class SpimData:
    """What the XML says of its views.

    Attributes:
        setups: By their numbers.
        names: What each kind of attribute calls its numbers.
        registrations: Shape (3, 4): node to world, by time and setup.
        path: The XML.
    """

    setups: dict[int, Setup]
    names: dict[str, dict[int, str]]
    registrations: dict[tuple[int, int], Float64Array]
    path: Path

    def placed(self, time: int, setup: int) -> tuple[Triple | None, tuple[Notice, ...]]:
        """Return the place of a view's first node along x, y, z in its setup's unit, and what is told.

        A registration that does more than to scale as the voxel size does, and to move, is told.
        """
        spacing, affine = self.setups[setup].spacing, self.registrations.get((time, setup))
        if spacing is None or affine is None or min(spacing) <= 0:
            return None, ()
        diagonal = np.diag(np.diag(affine[:, :3]))
        scales = np.diag(affine[:, :3]) / np.array(spacing)
        is_plain = np.abs(affine[:, :3] - diagonal).max() <= _SAME * np.abs(diagonal).max()
        if not is_plain or scales.min() <= 0 or np.ptp(scales) > _SAME * scales.max():
            sentence = (
                "the XML's registration turns, shears or scales the view otherwise than its voxel size does; "
                "it is not applied, the voxel size is taken"
            )
            return None, (Notice("W-GEOMETRY-CONTRADICTED", sentence),)
        x, y, z = (affine[:, 3] / scales).tolist()
        return (x, y, z), ()


def is_spim_data(start: bytes) -> bool:
    """Return whether a file begins as the XML does."""
    return start.startswith((b"<", b"\xef\xbb\xbf<")) and ROOT in start


def spim_data_beside(source: Path) -> SpimData | None:
    """Return what the XML of the same name beside an HDF5 file says, or None where there is none of it."""
    path = source.with_suffix(".xml")
    if not exists(path) or not path.is_file() or not Bounds(source.parent).hold(path):
        return None
    root = _root(path, path.name)
    named = None if root is None else root.findtext(".//ImageLoader/hdf5")
    if root is None or named is None or Path(named.replace("\\", "/")).name != source.name:
        return None
    return _parsed(root, path)


def spim_data_of(path: Path, name: str, allow_outside: bool) -> tuple[SpimData, Path]:
    """Return what an XML says, and the HDF5 file that it names.

    Raises:
        UnsupportedFormatError: It is no XML of BigDataViewer, or its values are in no HDF5 file.
        VolumeError: The file is not there, or lies elsewhere.
    """
    root = _root(path, name)
    if root is None:
        raise UnsupportedFormatError(
            f"{name}: an XML that is none of BigDataViewer's found; expected SpimData with an HDF5 file"
        )
    loader = root.find(".//ImageLoader")
    named = None if loader is None else loader.findtext("hdf5")
    if not named:
        found = "none" if loader is None else loader.get("format", "")
        raise UnsupportedFormatError(
            f"{name}: an XML of BigDataViewer with the image loader {found[:40]!r} found; expected bdv.hdf5; "
            "export it as HDF5, or give the files with the values"
        )
    return _parsed(root, path), named_file(path, named.strip(), name, allow_outside)


def _root(path: Path, name: str) -> ElementTree.Element | None:
    """Return the root of an XML of BigDataViewer, None for another one.

    Raises:
        DamagedVolumeError: It is too long, defines entities, or is no XML.
    """
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if ROOT not in content[:4096]:
        return None
    if len(content) > MOST_BYTES or b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise DamagedVolumeError(
            f"{name}: an XML of more than {MOST_BYTES} bytes or with entities found; expected neither; get "
            "it again"
        )
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise DamagedVolumeError(
            f"{name}: the XML cannot be read ({str(error)[:100]}); get it again"
        ) from error


def _parsed(root: ElementTree.Element, path: Path) -> SpimData:
    """Return what an XML says; ValueError where it is not as BigDataViewer writes it."""
    setups = {int(each.findtext("id", "")): _setup(each) for each in root.iter("ViewSetup")}
    names: dict[str, dict[int, str]] = {}
    for attributes in root.iter("Attributes"):
        entries = {int(each.findtext("id", "")): each.findtext("name", "").strip() for each in attributes}
        names[attributes.get("name", "")] = entries
    registrations: dict[tuple[int, int], Float64Array] = {}
    for view in root.iter("ViewRegistration"):
        place = int(view.get("timepoint", "")), int(view.get("setup", ""))
        steps = [each.findtext("affine", "") for each in view.iter("ViewTransform")]
        if steps:
            registrations[place] = _product(steps)
    return SpimData(setups, names, registrations, path)


def _setup(element: ElementTree.Element) -> Setup:
    size = element.find("voxelSize")
    numbers = [] if size is None else [float(each) for each in size.findtext("size", "").split()]
    spacing = (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else None
    unit = "" if size is None else size.findtext("unit", "").strip()
    told = element.find("attributes")
    attributes = {each.tag: int(each.text or "") for each in (() if told is None else told)}
    return Setup(element.findtext("name", "").strip(), spacing, unit, attributes)


def _product(affines: list[str]) -> Float64Array:
    """Return the product of affine maps, shape (3, 4); the last one of the list comes first."""
    whole = np.eye(4)
    for text in affines:
        step = np.eye(4)
        step[:3] = np.array([float(each) for each in text.split()]).reshape(3, 4)
        whole = whole @ step
    return whole[:3]
