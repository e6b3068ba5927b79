"""Write small HDF5 files for the tests of their reader."""

import numpy as np
import pytest

from tests.volume_io.reading import counting

h5py = pytest.importorskip("h5py")

VALUES = counting((4, 5, 6), "<i2")


def write(path, datasets, **attributes):
    """Write datasets by name, and attributes of the first."""
    with h5py.File(path, "w") as file:
        for name, values in datasets.items():
            file[name] = values
        file[next(iter(datasets))].attrs.update(attributes)
    return path


def nexus(path, labels, places, units, values=VALUES):
    """NXdata as NeXus has it: `default` leads to it, `axes` names the places along each axis."""
    with h5py.File(path, "w") as file:
        file.attrs["default"] = "entry"
        entry = file.create_group("entry")
        entry.attrs.update(NX_class="NXentry", default="data")
        file["measured"] = values
        data = entry.create_group("data")
        data.attrs.update(NX_class="NXdata", signal="data", axes=list(labels))
        data["data"] = h5py.SoftLink("/measured")
        file["other"] = np.zeros((3, 3, 3))
        for label, along, unit in zip(labels, places, units, strict=True):
            data[label] = along
            data[label].attrs["units"] = unit
    return path


def codes(volume):
    return [notice.code for notice in volume.warnings]
