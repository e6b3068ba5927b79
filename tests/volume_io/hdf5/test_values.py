"""What attributes of HDF5 datasets say of their values."""

import numpy as np
import pytest

from tests.volume_io.hdf5.files import VALUES, codes, nexus, write
from tests.volume_io.reading import read

h5py = pytest.importorskip("h5py")


@pytest.mark.parametrize(
    ("attributes", "scale", "told"),
    [
        ({"scale_factor": 0.5, "add_offset": -1000}, (0.5, -1000), []),
        ({"scale_factor": np.array([2.0], "f4")}, (2, 0), []),
        ({"scale_factor": 0.0}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"scale_factor": "high"}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"scale_factor": [1.0, 2.0]}, (1, 0), ["W-RESCALE-UNKNOWN"]),
    ],
)
def test_values_are_scaled_as_climate_conventions_have_it(path, attributes, scale, told):
    """The attributes of CF 8.1 and 2.5.1, which netCDF 4 has."""
    write(path, {"a": VALUES}, **attributes)
    volume = read(path, spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert (volume.slope, volume.intercept) == scale
    assert codes(volume) == told


@pytest.mark.parametrize(
    ("attributes", "missing"),
    [
        ({"_FillValue": np.int16(7)}, [7]),
        ({"missing_value": np.array([7], "<i2")}, [7]),
        ({"missing_value": np.array([7, 9, 7000])}, [7, 9]),
        ({"_FillValue": np.int16(-7)}, []),
        ({"_FillValue": np.int16(7), "missing_value": np.int16(9)}, [7, 9]),
        ({"valid_range": np.array([2, 117], "<i2")}, [0, 1, 118, 119]),
        ({"valid_min": np.int16(2)}, [0, 1]),
        ({"valid_max": np.int16(117), "_FillValue": np.int16(5)}, [5, 118, 119]),
        ({"valid_max": 58.5, "scale_factor": 0.5}, [118, 119]),
        ({"valid_range": [-59.0, 0.0], "scale_factor": -0.5, "add_offset": 0.0}, [119]),
        ({"valid_max": np.int16(117), "scale_factor": 0.5}, [118, 119]),
        ({"valid_range": np.array([9, 2], "<i2")}, []),
    ],
)
@pytest.mark.parametrize("dtype", ["<i2", ">i4", "<f4"])
def test_missing_values_are_nodes_without_data(path, attributes, missing, dtype):
    if dtype == "<f4" and "scale_factor" in attributes:
        attributes = {key: value for key, value in attributes.items() if key != "valid_max"}
        attributes, missing = attributes | {"valid_range": [0.0, 117.0]}, [118, 119]
    volume = read(write(path, {"a": VALUES.astype(dtype)}, **attributes), spacing=(1, 1, 1))
    is_missing = np.isin(VALUES, missing)
    np.testing.assert_array_equal(volume.values[~is_missing], VALUES[~is_missing])
    if dtype == "<f4":
        assert volume.padding is None
        np.testing.assert_array_equal(np.isnan(volume.values), is_missing)
    else:
        low, high = volume.padding or (1, 0)
        np.testing.assert_array_equal((volume.values >= low) & (volume.values <= high), is_missing)
    assert codes(volume) == (["W-NO-DATA"] if missing else [])
    if missing:
        assert f"{len(missing)} nodes have no value" in volume.warnings[0].sentence


@pytest.mark.parametrize(("told", "dtype"), [("true", "u1"), ("false", "i1")])
def test_whole_numbers_may_be_without_a_sign_whatever_their_type_is(path, told, dtype):
    stored = (VALUES + 100).astype({"u1": "i1", "i1": "u1"}[dtype])
    volume = read(
        write(path, {"a": stored}, _Unsigned=told, _FillValue=stored[-1, -1, -1]), spacing=(1, 1, 1)
    )
    np.testing.assert_array_equal(volume.values, (VALUES + 100).astype(dtype))
    assert volume.values.dtype == dtype
    last = int(volume.values[-1, -1, -1])
    assert volume.padding == (last, last)


def test_a_mark_that_is_no_number_is_told(path):
    assert codes(read(write(path, {"a": VALUES}, _FillValue="none"), spacing=(1, 1, 1))) == [
        "W-VALUES-MAPPED"
    ]


PLACES = [np.arange(4), np.arange(5), np.arange(6)]


@pytest.mark.parametrize(
    ("fields", "scale", "told"),
    [
        ({"data_scaling_factor": 0.5, "data_offset": 10.0}, (0.5, 5), []),
        ({"scaling_factor": 2.0}, (2, 0), []),
        ({"offset": np.array([-3.0])}, (1, -3), []),
        ({"other_offset": 7.0}, (1, 0), []),
        ({"data_scaling_factor": 0.0}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"data_scaling_factor": np.ones(3)}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"scaling_factor": "two"}, (1, 0), ["W-RESCALE-UNKNOWN"]),
    ],
)
def test_values_are_scaled_as_nexus_has_it(path, fields, scale, told):
    """(stored + offset) * factor."""
    nexus(path, ["z", "y", "x"], PLACES, ["mm"] * 3)
    with h5py.File(path, "a") as file:
        for key, value in fields.items():
            file[f"entry/data/{key}"] = value
    volume = read(path)
    assert (volume.slope, volume.intercept) == scale
    assert codes(volume) == told


def test_places_are_scaled_as_nexus_has_it(path):
    nexus(path, ["z", "y", "x"], PLACES, ["mm"] * 3)
    with h5py.File(path, "a") as file:
        file["entry/data/x_scaling_factor"] = 0.5
        file["entry/data/x_offset"] = 4.0
    volume = read(path)
    assert (volume.spacing, volume.affine[0, 3]) == ((0.5, 1, 1), 2)


@pytest.mark.parametrize("kind", ["field", "attribute", "end"])
def test_transformations_are_told(path, kind):
    nexus(path, ["z", "y", "x"], PLACES, ["mm"] * 3)
    with h5py.File(path, "a") as file:
        if kind == "attribute":
            file["measured"].attrs["depends_on"] = "/entry/sample/rotation"
        else:
            file["entry/data/depends_on"] = "/entry/sample/rotation" if kind == "field" else "."
    assert codes(read(path)) == ([] if kind == "end" else ["W-ORIENTATION-MISSING"])
