"""Zarr arrays that are no OME image: places beside them, as xarray keeps these, and lengths as attributes."""

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.reading import counting, read

zarr = pytest.importorskip("zarr", minversion="3")

VALUES = counting((5, 4, 6), "<i2")
PLACES = {"z": 10 + 3.0 * np.arange(5), "y": 2.0 * np.arange(4), "x": 1 - 0.5 * np.arange(6)}


def write(path, values, version, names=(), **attributes):
    """An array with names of its axes as xarray writes them."""
    if version == 2 and names:
        attributes["_ARRAY_DIMENSIONS"] = list(names)
    options = {"dimension_names": names} if version == 3 and names else {}
    array = zarr.create_array(
        path, data=values, chunks=(2,) * values.ndim, zarr_format=version, attributes=attributes, **options
    )
    return array.metadata and path


def dataset(path, version, names=("z", "y", "x"), values=VALUES, places=None, told=None):
    """A group as xarray's `to_zarr` writes it: `ct`, and an array of places for each axis."""
    zarr.open_group(path, mode="w", zarr_format=version)
    write(path / "ct", values, version, names)
    for named, along in (PLACES if places is None else places).items():
        attributes = {"units": "um"} if told is None else told.get(named, {})
        write(path / named, np.asarray(along), version, [named], **attributes)
    return path


def codes(volume):
    return [notice.code for notice in volume.warnings]


@pytest.mark.parametrize("version", [2, 3])
def test_places_beside_an_array_are_read(tmp_path, version):
    path = dataset(tmp_path / "a.zarr", version)
    for each in (path, path / "ct"):
        volume = read(each)
        np.testing.assert_array_equal(volume.values, VALUES)
        np.testing.assert_allclose(np.diag(volume.affine)[:3], (-0.0005, 0.002, 0.003))
        np.testing.assert_allclose(volume.affine[:3, 3], (0.001, 0, 0.01))
        assert volume.warnings == ()
    assert list_volumes(str(path), ReadSettings())[0].size == (6, 4, 5)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    "told",
    [
        {"easting": {"axis": "X"}, "northing": {"axis": "Y"}, "lev": {"axis": "Z"}},
        {
            "easting": {"standard_name": "projection_x_coordinate"},
            "northing": {"standard_name": "projection_y_coordinate"},
            "lev": {"standard_name": "depth"},
        },
    ],
)
def test_axes_are_what_their_places_say(tmp_path, version, told):
    told = {named: {"units": "m", **each} for named, each in told.items()} | {"when": {"units": "hours"}}
    names = ("easting", "when", "lev", "northing")
    values = counting((6, 2, 5, 4), "<i2")
    places = dict(zip(names, (PLACES["x"], np.arange(2), PLACES["z"], PLACES["y"]), strict=True))
    path = dataset(tmp_path / "a.zarr", version, names, values, places, told)
    volume = read(path, time="1")
    np.testing.assert_array_equal(volume.values, values[:, 1].transpose(1, 2, 0))
    np.testing.assert_allclose(np.diag(volume.affine)[:3], (-500, 2000, 3000))


def test_a_height_beside_a_y_is_the_third_axis(tmp_path):
    places = {"height": PLACES["z"], "y": PLACES["y"], "x": PLACES["x"]}
    volume = read(dataset(tmp_path / "a.zarr", 2, ("height", "y", "x"), places=places))
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.002, 0.003))


@pytest.mark.parametrize("unit", ["days since 2000-01-01", "hours", "s"])
def test_a_time_is_no_third_axis(tmp_path, unit):
    places = {"lev": np.arange(5.0), "y": PLACES["y"], "x": PLACES["x"]}
    told = {"lev": {"units": unit}, "y": {"units": "m"}, "x": {"units": "m"}}
    path = dataset(tmp_path / "a.zarr", 2, ("lev", "y", "x"), places=places, told=told)
    with pytest.raises(
        UnsupportedFormatError, match=r"the axes time 5, y 4, x 6 found; expected axes z, y, x"
    ):
        read(path)


def test_degrees_are_no_lengths(tmp_path):
    names = ("depth", "lat", "lon")
    places = dict(zip(names, PLACES.values(), strict=True))
    told = {"depth": {"units": "m"}, "lat": {"units": "degrees_north"}, "lon": {"units": "degrees_east"}}
    path = dataset(tmp_path / "a.zarr", 3, names, places=places, told=told)
    with pytest.raises(
        UnsupportedFormatError, match=r"the axes z 5, lat 4, lon 6 found; expected axes z, y, x"
    ):
        read(path)


def test_places_without_a_unit_are_told_and_uneven_ones_refused(tmp_path):
    path = dataset(tmp_path / "a.zarr", 3, told={"z": {"units": "um"}, "y": {"units": "um"}})
    volume = read(path)
    assert codes(volume) == ["W-UNIT-MISSING", "W-SPACING-MISSING"]
    assert read(path, spacing=(1, 2, 3), strict=True).spacing == (1, 2, 3)
    path = dataset(tmp_path / "b.zarr", 3, places=PLACES | {"z": np.array([0.0, 1, 2, 4, 5])})
    with pytest.raises(UnsupportedFormatError, match=r"along the axis z found that are not even; .*resample"):
        read(path)


def test_names_of_axes_lead_nowhere(tmp_path):
    """They are names of folders only where they are names."""
    dataset(tmp_path / "b.zarr", 2)
    names = ["../b.zarr/z", "..", "x"]
    path = dataset(tmp_path / "a.zarr", 2, names, places={})
    assert codes(read(path)) == ["W-SPACING-MISSING"]


def test_a_group_of_several_arrays_is_a_choice(tmp_path):
    path = dataset(tmp_path / "a.zarr", 2)
    write(path / "labels", VALUES, 2, ("z", "y", "x"))
    with pytest.raises(AmbiguousVolumeError, match=r"with ct, labels; give the path .*such as .*a\.zarr/ct"):
        read(path)
    np.testing.assert_allclose(read(path / "labels").spacing, (0.0005, 0.002, 0.003))


TRANSFORM = {"axes": ["z", "y", "x"], "scale": [3, 2, 1], "translate": [6, 4, 2], "units": ["nm"] * 3}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("attributes", "spacing", "origin"),
    [
        ({"pixelResolution": {"dimensions": [1.0, 2.0, 3.0], "unit": "um"}}, (1e-3, 2e-3, 3e-3), (0, 0, 0)),
        ({"pixelResolution": [1.0, 2.0, 3.0], "units": "nm"}, (1e-6, 2e-6, 3e-6), (0, 0, 0)),
        (
            {
                "pixelResolution": {"dimensions": [1, 2, 3], "unit": "mm"},
                "downsamplingFactors": [2, 2, 1],
            },
            (2, 4, 3),
            (0.5, 1, 0),
        ),
        ({"transform": TRANSFORM}, (1e-6, 2e-6, 3e-6), (2e-6, 4e-6, 6e-6)),
        ({"resolution": [4, 4, 4], "units": ["nm", "nm", "nm"]}, (4e-6,) * 3, (0, 0, 0)),
        ({"voxel_size": [4, 4, 4], "voxel_size_unit": "um", "offset": [8, 8, 8]}, (4e-3,) * 3, (8e-3,) * 3),
        ({"resolution_um": 2.0}, (2e-3,) * 3, (0, 0, 0)),
        (
            {
                "axis_names": ["z", "y", "x"],
                "voxel_size": [3, 2, 1],
                "units": ["nm"] * 3,
                "offset": [30, 20, 10],
            },
            (1e-6, 2e-6, 3e-6),
            (1e-5, 2e-5, 3e-5),
        ),
    ],
)
def test_lengths_that_attributes_tell(tmp_path, version, attributes, spacing, origin):
    path = write(tmp_path / "a.zarr", VALUES, version, **attributes)
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, spacing)
    np.testing.assert_allclose(volume.affine[:3, 3], origin)
    assert volume.warnings == ()


def test_lengths_of_the_group_count_for_its_arrays(tmp_path):
    path = tmp_path / "a.zarr"
    zarr.open_group(path, mode="w").attrs.update(pixelResolution={"dimensions": [1, 2, 3], "unit": "mm"})
    write(path / "s0", VALUES, 3)
    assert read(path / "s0").spacing == (1, 2, 3)


def test_smaller_copies_are_as_much_coarser_as_the_group_says(tmp_path):
    """As n5-viewer has it: `scales` of the group, or `downsamplingFactors` of the level."""
    path = tmp_path / "a.zarr"
    group = zarr.open_group(path, mode="w")
    group.attrs.update(pixelResolution={"dimensions": [1, 2, 3], "unit": "mm"})
    write(path / "s1", VALUES, 3)
    volume = read(path / "s1")
    assert codes(volume) == ["W-SPACING-MISSING"] * 2
    assert "the smaller copy s1" in volume.warnings[0].sentence
    group.attrs.update(scales=[[1, 1, 1], [2, 2, 1]])
    volume = read(path / "s1")
    assert volume.spacing == (2, 4, 3)
    assert volume.affine[:3, 3].tolist() == [0.5, 1, 0]
    write(path / "s2", VALUES, 3, downsamplingFactors=[4, 4, 2])
    assert read(path / "s2").spacing == (4, 8, 6)


@pytest.mark.parametrize(
    ("attributes", "told"),
    [
        ({"resolution": [40, 4, 4]}, ["W-UNIT-MISSING", "W-SPACING-MISSING"]),
        ({"resolution": [40, 4, 4], "units": "nm"}, ["W-SPACING-MISSING", "W-SPACING-MISSING"]),
        ({"voxel_size": [4, 4, 4], "units": "parasang"}, ["W-UNIT-UNKNOWN", "W-SPACING-MISSING"]),
        ({"pixelResolution": [1.0, 2.0, 3.0]}, ["W-UNIT-MISSING", "W-SPACING-MISSING"]),
        ({"pixelResolution": {"dimensions": [1, 2], "unit": "um"}}, ["W-SPACING-MISSING"] * 2),
        ({"transform": {"scale": [3, 2, 1], "units": ["nm"] * 3}}, ["W-SPACING-MISSING"] * 2),
        ({"voxel_size": [4] * 3, "units": "nm", "offset": [1, 2, 3]}, ["W-POSITION-MISSING"]),
    ],
)
def test_lengths_that_are_not_clear_are_told(tmp_path, attributes, told):
    path = write(tmp_path / "a.zarr", VALUES, 3, **attributes)
    assert codes(read(path)) == told
    given = {"origin": (0, 0, 0)} if told == ["W-POSITION-MISSING"] else {"spacing": (1, 2, 3)}
    assert codes(read(path, **given)) == []


def test_channels_that_funlib_names_have_no_length(tmp_path):
    values = counting((2, 5, 4, 6), "<i2")
    told = {
        "axis_names": ["c^", "z", "y", "x"],
        "voxel_size": [3, 2, 1],
        "units": ["nm"] * 3,
        "offset": [0] * 3,
    }
    volume = read(write(tmp_path / "a.zarr", values, 2, **told), channel="1")
    np.testing.assert_array_equal(volume.values, values[1])
    np.testing.assert_allclose(volume.spacing, (1e-6, 2e-6, 3e-6))
