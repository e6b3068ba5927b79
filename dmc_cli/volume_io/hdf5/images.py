"""Find the images of an HDF5 file: the datasets that make one together, or the dataset that is meant.

Imaris and BigDataViewer keep a dataset for each time and channel or setup. Of these the finest are one image,
with the times and channels as axes, unless one of them is named.
"""

from typing import Any

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.volume_io.axes import Axis, nameless_image, stacked_image
from dmc_cli.volume_io.hdf5 import big_data_viewer as bdv
from dmc_cli.volume_io.hdf5.dataset import is_volume, meant_dataset
from dmc_cli.volume_io.hdf5.geometry import hdf_geometry
from dmc_cli.volume_io.hdf5.imaris import FINEST, imaris_axes, is_imaris
from dmc_cli.volume_io.hdf5.links import followed
from dmc_cli.volume_io.hdf5.spim_data import SpimData
from dmc_cli.volume_io.hdf5.stored import HdfGeometry, Stored, Where, stored_alone


def hdf_images(file: Any, named: str, spim: SpimData | None, name: str, h5py: Any) -> list[Stored]:
    """Return the images of a file, or that of the dataset that is named.

    Args:
        file: An open file of h5py.
        named: The path of a dataset or a group in it, or nothing.
        spim: What the XML of BigDataViewer says, or None.
        name: The input, for messages.
        h5py: The package.

    Raises:
        VolumeError: There is none of that name.
        UnsupportedFormatError: None holds a volume, or it lies in another file.
        AmbiguousVolumeError: Several datasets do, and none is named.
        DamagedVolumeError: Views are missing.
    """
    if not named and bdv.is_big_data_viewer(file):
        return bdv.views(file, spim, name, h5py)
    if not named and isinstance(followed(file, FINEST, name, h5py), h5py.Group):
        times, channels, labels = imaris_axes(file, name, h5py)
        if len(times) * len(channels) > 1:
            return [_imaris(file, times, channels, labels, name, h5py)]
    dataset, group = meant_dataset(file, named, name, h5py)
    if not is_volume(dataset):
        raise UnsupportedFormatError(
            f"{name}: {dataset.name} of type {dataset.dtype} and shape {dataset.shape} found; "
            "expected numbers along z, y and x"
        )
    if bdv.DATASET.fullmatch(str(dataset.name)) and bdv.is_big_data_viewer(file):
        image = nameless_image(dataset.shape)
        return [stored_alone(dataset, bdv.view_geometry(file, dataset, image, spim, name, h5py))]
    return [stored_alone(dataset, hdf_geometry(file, dataset, group, name, h5py))]


def _imaris(
    file: Any, times: list[int], channels: list[int], labels: tuple[str, ...], name: str, h5py: Any
) -> Stored:
    """Return the finest level of an Imaris file of several times or channels as one image."""

    def geometry_of(time: int, channel: int) -> tuple[Any, HdfGeometry]:
        place = f"{FINEST}/TimePoint {times[time]}/Channel {channels[channel]}/Data"
        dataset = followed(file, place, name, h5py)
        if not isinstance(dataset, h5py.Dataset) or not is_imaris(file, dataset) or dataset.ndim != 3:
            raise DamagedVolumeError(
                f"{name}: no image {place} of three axes found; the file is incomplete; get it again"
            )
        return dataset, hdf_geometry(file, dataset, dataset.parent, name, h5py)

    _, first = geometry_of(0, 0)
    axes = Axis("time", len(times)), Axis("channel", len(channels), labels)
    image = stacked_image(first.image.nodes, *axes)

    def find(where: Where) -> tuple[Any, Where, HdfGeometry]:
        dataset, geometry = geometry_of(where[0] or 0, where[1] or 0)
        if geometry.image.nodes != image.nodes:
            raise DamagedVolumeError(
                f"{name}: {dataset.name} of {geometry.image.nodes} nodes found, the first one of "
                f"{image.nodes}; expected times and channels of one size; name one, as in FILE:/DATASET"
            )
        return dataset, where[2:], geometry

    return Stored(image, find)
