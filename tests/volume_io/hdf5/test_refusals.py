"""What of HDF5 files is refused: links, other files, filters, sizes that cannot be."""

import sys

import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from tests.volume_io.hdf5.files import VALUES, write
from tests.volume_io.reading import read

h5py = pytest.importorskip("h5py")


def test_links_out_of_the_file_are_not_followed(path):
    write(path.with_name("b.h5"), {"data": VALUES})
    with h5py.File(path, "w") as file:
        file["data"] = h5py.ExternalLink("b.h5", "/data")
        file["soft"] = h5py.SoftLink("/data")
        file["ring"] = h5py.SoftLink("/ring")
        file["nowhere"] = h5py.SoftLink("/gone")
    for named in ("/data", "/soft", "/ring"):
        with pytest.raises(UnsupportedFormatError, match="a link out of the file"):
            read(f"{path}:{named}")
    with pytest.raises(VolumeError, match=r"/nowhere is no dataset; expected .*none holds a volume"):
        read(f"{path}:/nowhere")
    with pytest.raises(UnsupportedFormatError, match="without a dataset of numbers along three axes"):
        read(path)


def test_values_in_other_files_and_unusual_filters_are_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("data", (4, 5, 6), "i2", external=[(str(path.with_name("b.raw")), 0, 240)])
    with pytest.raises(UnsupportedFormatError, match="/data found in other files"):
        read(path)
    with h5py.File(path, "w") as file:
        file.create_dataset("data", data=VALUES, scaleoffset=0)
    with pytest.raises(UnsupportedFormatError, match=r"filters \[6\] found; expected gzip; copy it with"):
        read(path)


@pytest.mark.parametrize(
    "storage",
    [
        {"shape": (9999, 9999, 9999), "chunks": (9999, 99, 99), "compression": "gzip"},
        {"shape": (400, 500, 600)},
    ],
)
def test_what_no_file_can_hold_is_refused(path, storage):
    with h5py.File(path, "w") as file:
        file.create_dataset("data", dtype="u1", **storage)
    with pytest.raises(DamagedVolumeError, match="the file is incomplete or damaged"):
        read(path)


@pytest.mark.parametrize("kept", [3, 100, 1000])
def test_a_truncated_file_is_refused(path, kept):
    content = write(path, {"data": VALUES}).read_bytes()
    path.write_bytes(content[:kept])
    with pytest.raises(VolumeError):
        read(path)


def test_what_is_no_volume_is_refused(path):
    write(path, {"table": np.zeros((30, 4)), "thin": np.zeros((3, 1, 4)), "text": ["a"]})
    with pytest.raises(UnsupportedFormatError, match="without a dataset of numbers along three axes"):
        read(path)
    with pytest.raises(UnsupportedFormatError, match=r"/table of type float64 and shape \(30, 4\) found"):
        read(f"{path}:/table")


def test_h5py_may_be_missing(path, monkeypatch):
    write(path, {"data": VALUES})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UnsupportedFormatError, match=r"h5py is not installed; pip install .*dmc-cli\[hdf5\]"):
        read(path)
