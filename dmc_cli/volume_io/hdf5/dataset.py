"""Find the dataset of an HDF5 file that is meant: the one named, the one NeXus shows, or the only one."""

from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Any

from dmc_cli.errors import AmbiguousVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.hdf5.imaris import is_coarse
from dmc_cli.volume_io.hdf5.links import MOST_LINKS, followed, text_of
from dmc_cli.volume_io.hdf_storage import Attributes
from dmc_cli.volume_io.left_out import shortened

MOST_OBJECTS = 10_000
"""Groups and datasets that are looked at."""

MATLABS_OWN = ("/#refs#/", "/#subsystem#/")
"""Where MATLAB keeps what its cells and objects are made of."""

ITK_VALUES = "/ITKImage/0/VoxelData"
"""Where ITK keeps the values of an image."""


def is_volume(dataset: Any) -> bool:
    """Return whether a dataset holds numbers along three axes or more, two nodes along three at least."""
    shape = dataset.shape or ()
    return dataset.dtype.kind in "iufb" and sum(size > 1 for size in shape) >= 3


def meant_dataset(file: Any, named: str, name: str, h5py: Any) -> tuple[Any, Any]:
    """Return the dataset that is meant, and the group that it is named in, which a link may lead out of.

    Args:
        file: An open file of h5py.
        named: Its path in the file, or nothing.
        name: The input, for messages.
        h5py: The package.

    Raises:
        VolumeError: There is none of that name.
        UnsupportedFormatError: None holds a volume, or it lies in another file.
        AmbiguousVolumeError: Several do, and none is named.
    """
    if named:
        found = followed(file, named, name, h5py)
        if isinstance(found, h5py.Group):
            return _only(volumes_of(found, h5py), name.removesuffix(named), name)
        if not isinstance(found, h5py.Dataset):
            told = _listed(volumes_of(file, h5py)) or "none holds a volume"
            raise VolumeError(f"{name}: {named} is no dataset; expected one of the file's: {told}")
        return found, followed(file, named.rstrip("/").rpartition("/")[0], name, h5py)
    shown = _shown(file, name, h5py)
    if shown is not None:
        return shown
    found_volumes = [dataset for dataset in volumes_of(file, h5py) if not is_coarse(dataset)]
    if any(dataset.name == ITK_VALUES for dataset in found_volumes):
        return file[ITK_VALUES], file[ITK_VALUES].parent
    return _only(found_volumes, f"{name}:", name)


def _only(found_volumes: list[Any], before: str, name: str) -> tuple[Any, Any]:
    """Return the only one of datasets and its group; `before` stands before a dataset's name in messages.

    Raises:
        UnsupportedFormatError: There is none.
        AmbiguousVolumeError: There are several.
    """
    if not found_volumes:
        raise UnsupportedFormatError(
            f"{name}: an HDF5 file without a dataset of numbers along three axes found; expected a volume"
        )
    if len(found_volumes) > 1:
        raise AmbiguousVolumeError(
            f"{name}: {len(found_volumes)} datasets found ({_listed(found_volumes)}); expected one; choose "
            f"with {before}{found_volumes[0].name}"
        )
    return found_volumes[0], found_volumes[0].parent


def _listed(datasets: list[Any]) -> str:
    sizes = [f"{dataset.name} of {' x '.join(map(str, dataset.shape))}" for dataset in datasets]
    return shortened(sizes, ", ")


def volumes_of(file: Any, h5py: Any) -> list[Any]:
    """Return all datasets of a file that hold a volume; no link to elsewhere is followed."""
    found: list[Any] = []

    def look(item: Any) -> None:
        if isinstance(item, h5py.Dataset) and is_volume(item) and not str(item.name).startswith(MATLABS_OWN):
            found.append(item)

    _visit(file, look)
    return sorted(found, key=lambda dataset: str(dataset.name))


def _visit(file: Any, look: Callable[[Any], None]) -> None:
    """Show the groups and datasets of a file one after the other, `MOST_OBJECTS` and one at most."""
    numbers = count(1)

    def step(_: str, item: Any) -> bool | None:
        look(item)
        return True if next(numbers) > MOST_OBJECTS else None

    file.visititems(step)


def _shown(file: Any, name: str, h5py: Any) -> tuple[Any, Any] | None:
    """Return the signal that NeXus' attribute `default` leads to, and its NXdata, or None."""
    group = file
    for _ in range(MOST_LINKS):
        following = text_of(Attributes(group).get("default", ""))
        found = followed(file, f"{group.name}/{following}", name, h5py) if following else None
        if not isinstance(found, h5py.Group):
            break
        group = found
    return _signal(file, group, name, h5py) or _only_signal(file, name, h5py)


def _signal(file: Any, group: Any, name: str, h5py: Any) -> tuple[Any, Any] | None:
    """Return the signal of a group if it is a volume, and the group."""
    signal = text_of(Attributes(group).get("signal", ""))
    dataset = followed(file, f"{group.name}/{signal}", name, h5py) if signal else None
    return (dataset, group) if isinstance(dataset, h5py.Dataset) and is_volume(dataset) else None


def _only_signal(file: Any, name: str, h5py: Any) -> tuple[Any, Any] | None:
    """Return the only volume that is the signal of an NXdata, or, as before 2014, says so itself."""
    found: dict[str, tuple[Any, Any]] = {}

    def look(item: Any) -> None:
        if isinstance(item, h5py.Group):
            is_shown = text_of(Attributes(item).get("NX_class", "")) == "NXdata"
            shown = None
            with suppress(UnsupportedFormatError):  # a link out of the file
                shown = _signal(file, item, name, h5py) if is_shown else None
        else:
            told = Attributes(item).get("signal") if isinstance(item, h5py.Dataset) else None
            is_shown = told is not None and str(text_of(told) or told).strip("[]") == "1"
            shown = (item, item.parent) if is_shown and is_volume(item) else None
        if shown is not None:
            found[str(shown[0].name)] = shown

    _visit(file, look)
    return next(iter(found.values())) if len(found) == 1 else None
