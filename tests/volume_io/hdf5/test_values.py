"""What attributes of HDF5 datasets say of their values."""

import numpy as np
import pytest

from tests.volume_io.hdf5.files import VALUES, codes, write
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
        ({"_FillValue": np.int16(7)}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"missing_value": np.array([7], "<i2")}, (1, 0), ["W-VALUES-MAPPED"]),
        ({"_FillValue": np.int16(-7)}, (1, 0), []),
    ],
)
def test_values_are_scaled_as_climate_conventions_have_it(path, attributes, scale, told):
    """The attributes of CF 8.1 and 2.5.1, which netCDF 4 has."""
    write(path, {"a": VALUES}, **attributes)
    volume = read(path, spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert (volume.slope, volume.intercept) == scale
    assert codes(volume) == told
