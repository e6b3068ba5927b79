"""Read what an HDF5 file says of a dataset's geometry: places along its axes, ITK's geometry, element sizes.

ITK keeps spacing, origin and directions beside the values, in mm, axes x, y, z, in LPS. `element_size_um`
(z, y, x) is what microscopists' programs write. Other attributes that look like lengths count where they have
a unit and are one length for all axes; else they are told.
"""

from typing import Any

import numpy as np

from dmc_cli.notices import Notice
from dmc_cli.volume_io.axes import Axis, Image, stacked_image, unnamed_axes
from dmc_cli.volume_io.hdf5.dataset import ITK_VALUES
from dmc_cli.volume_io.hdf5.imaris import imaris_grid, is_imaris
from dmc_cli.volume_io.hdf5.named_axes import named_axes, unused_resolution
from dmc_cli.volume_io.hdf5.nexus import moved, signal_scale
from dmc_cli.volume_io.hdf5.stored import HdfGeometry
from dmc_cli.volume_io.hdf_storage import Attributes, check_inside, check_stored
from dmc_cli.volume_io.layout import check_lengths
from dmc_cli.volume_io.loose_lengths import loose_lengths, numbers
from dmc_cli.volume_io.places import placed


def hdf_geometry(file: Any, dataset: Any, group: Any, name: str, h5py: Any) -> HdfGeometry:
    """Return what a file says of a dataset's axes, itself or in the group that it is named in.

    Raises:
        UnsupportedFormatError: They are not those of a volume, or their nodes are not even.
    """
    if dataset.name == ITK_VALUES:
        return _itk(file, dataset, name)
    if is_imaris(file, dataset):
        nodes, lengths, first, doubts = imaris_grid(file, dataset, name)
        return HdfGeometry(stacked_image(nodes), lengths, first, doubts=doubts)
    image, along = named_axes(file, dataset, group, name, h5py)
    notices = (*unnamed_axes(image), *_matlab(dataset), *moved(file, dataset, group, name, h5py))
    scale = signal_scale(file, dataset, group, name, h5py)
    sizes = numbers(Attributes(dataset).get("element_size_um"))
    if len(sizes) == 3:
        z, y, x = (1e-3 * size for size in sizes)
        check_lengths(name, (x, y, z))
        return HdfGeometry(image, (x, y, z), notices=notices, scale=scale)
    spacing, origin, told = placed(image, along, name)
    if spacing is None and not told:
        owners = [(str(owner.name), Attributes(owner)) for owner in (dataset, dataset.parent, file)]
        spacing, origin, told = loose_lengths(owners, str(dataset.name).rpartition("/")[2])
        told = told if spacing else (*told, *unused_resolution(dataset))
    return HdfGeometry(image, spacing, origin, notices=notices, unsettled=told, scale=scale)


def _itk(file: Any, dataset: Any, name: str) -> HdfGeometry:
    """Return the geometry of an image that ITK wrote; a row of its directions is an axis.

    Of several values a node, the last axis counts them.
    """
    told = [file[f"/ITKImage/0/{key}"] for key in ("Spacing", "Origin", "Directions")]
    if [each.shape for each in told] != [(3,), (3,), (3, 3)]:
        raise ValueError("spacing, origin and directions of another shape than those of three axes")
    for each in told:
        check_inside(each, name)
        check_stored(each, file.id.get_filesize(), name, "copy it with h5repack")
    names = ("z", "y", "x", "channel")[: dataset.ndim]
    image = Image(tuple(Axis(label, int(n)) for label, n in zip(names, dataset.shape, strict=True)))
    x, y, z = (float(length) for length in told[0][()])
    check_lengths(name, (x, y, z))
    i, j, k = (float(place) for place in told[1][()])
    directions = np.asarray(told[2][()], np.float64).T
    return HdfGeometry(image, (x, y, z), (i, j, k), directions, "LPS")


def _matlab(dataset: Any) -> tuple[Notice, ...]:
    """Return what is told of an array of MATLAB's, whose images are stored column by column."""
    if "MATLAB_class" not in Attributes(dataset):
        return ()
    sentence = (
        "an array of MATLAB's names no axes; its first index is taken as x, which for images of MATLAB is y: "
        "the mesh may be mirrored"
    )
    return (Notice("W-AXES-MISSING", sentence),)
