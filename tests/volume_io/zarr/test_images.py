"""Axes of Zarr arrays and OME-Zarr images are taken by names and types, in all versions and any order."""

import json

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import counting, read

zarr = pytest.importorskip("zarr", minversion="3")

SIZES = {"z": 5, "y": 4, "x": 6, "t": 3, "c": 2, "a": 2}
SCALES = {"z": 3.0, "y": 2.0, "x": 0.5, "t": 7.0, "c": 1.0, "a": 1.0}
TYPES = {"t": "time", "c": "channel", "a": "angle", **dict.fromkeys("zyx", "space")}


def values_of(axes, dtype="<i2"):
    return counting(tuple(SIZES[axis] for axis in axes), dtype)


def volume_of(values, axes, **where):
    """One volume [z, y, x] of an array with such axes."""
    others = [axis for axis in axes if axis not in "zyx"]
    moved = values.transpose([axes.index(axis) for axis in (*others, *"zyx")])
    return moved[tuple(where[axis] for axis in others)]


def write_array(path, values, version=2, **options):
    chunks = options.pop("chunks", (2,) * values.ndim)
    array = zarr.create_array(
        path, shape=values.shape, chunks=chunks, dtype=values.dtype, zarr_format=version, **options
    )
    array[...] = values


def write_image(path, values, image, version=2, **attributes):
    """A group with one OME image, whose metadata are those of `image` with the level's path."""
    level = {"path": "0", **image.pop("level", {})}
    group = zarr.open_group(path, mode="w", zarr_format=version)
    write_array(path / "0", values, version)
    told = {"multiscales": [{"datasets": [level], **image}], **attributes}
    group.attrs.update({"ome": told} if version == 3 else told)
    return path


def typed(axes):
    return [{"name": a, "type": TYPES[a]} | ({"unit": "micrometer"} if a in "zyx" else {}) for a in axes]


def scaled(axes):
    scale = {"type": "scale", "scale": [SCALES[axis] for axis in axes]}
    return {"coordinateTransformations": [scale]}


@settings(max_examples=20)
@given(st.permutations("tcazyx"), st.integers(0, 3), st.sampled_from([2, 3]), st.data())
def test_axes_of_any_types_in_any_order(tmp_path_factory, order, left_out, version, data):
    axes = "".join(axis for axis in order if axis in "zyx" or axis in "tca"[left_out:])
    values = values_of(axes)
    image = {"axes": typed(axes), "level": scaled(axes)}
    path = write_image(tmp_path_factory.mktemp("axes") / "a.zarr", values, image, version)
    where = {axis: data.draw(st.integers(0, SIZES[axis] - 1)) for axis in axes if axis not in "zyx"}
    others = list(where)
    index = (
        int(np.ravel_multi_index([where[a] for a in others], [SIZES[a] for a in others])) if others else None
    )
    for chosen in (
        {"volume_index": index},
        {n: str(where[a]) for a, n in (("c", "channel"), ("t", "time")) if a in where}
        | {"volume_index": where.get("a")},
    ):
        volume = read(path, **chosen)
        np.testing.assert_array_equal(volume.values, volume_of(values, axes, **where))
        np.testing.assert_allclose(volume.spacing, (0.0005, 0.002, 0.003))


@settings(max_examples=10)
@given(st.permutations("tczyx"), st.sampled_from(["|b1", "<u2", ">f4"]), st.booleans())
def test_sharded_and_named_arrays(tmp_path_factory, order, dtype, is_sharded):
    axes = "".join(order)
    values, path = values_of(axes, dtype), tmp_path_factory.mktemp("sharded") / "a.zarr"
    shards = {"shards": (4,) * 5} if is_sharded else {}
    write_array(path, values, 3, dimension_names=list(axes), **shards)
    volume = read(path, time="2", channel="1")
    np.testing.assert_array_equal(volume.values, volume_of(values, axes, t=2, c=1))


@pytest.mark.parametrize("version", [2, 3])
def test_truth_values_are_bytes(tmp_path, version):
    values = counting((6, 16, 20)) % 3 == 0
    write_array(tmp_path / "a.zarr", values, version)
    volume = read(tmp_path / "a.zarr")
    assert volume.values.dtype == np.uint8
    np.testing.assert_array_equal(volume.values, values)


@pytest.mark.parametrize(
    ("image", "axes"),
    [
        ({"version": "0.1"}, "tczyx"),
        ({"version": "0.2", "name": "x"}, "tczyx"),
        ({"version": "0.1"}, "zyx"),
        ({"version": "0.3", "axes": ["t", "c", "z", "y", "x"]}, "tczyx"),
        ({"version": "0.3", "axes": ["z", "y", "x"]}, "zyx"),
        ({"version": "0.3", "axes": ["z", "c", "y", "x"]}, "zcyx"),
    ],
)
def test_versions_before_distances(tmp_path, image, axes):
    values = values_of(axes)
    path = write_image(tmp_path / "a.zarr", values, image)
    named = {name: "1" for axis, name in (("t", "time"), ("c", "channel")) if axis in axes}
    volume = read(path, **named)
    np.testing.assert_array_equal(volume.values, volume_of(values, axes, t=1, c=1))
    assert [notice.code for notice in volume.warnings] == ["W-SPACING-MISSING"]
    assert read(path, **named, spacing=(1, 2, 3)).spacing == (1, 2, 3)


@pytest.mark.parametrize(
    ("names", "spelling"),
    [("tyx", "dimension_names"), ("cyx", "axes"), ("yx", "axes"), ("tcyx", "axes"), ("tyx", "xarray")],
)
def test_without_a_z_axis_there_is_no_volume(tmp_path, names, spelling):
    values, path = values_of(names), tmp_path / "a.zarr"
    if spelling == "axes":
        write_image(path, values, {"axes": typed(names), "level": scaled(names)})
    elif spelling == "xarray":
        write_array(path, values, attributes={"_ARRAY_DIMENSIONS": ["time", "lat", "lon"]})
    else:
        write_array(path, values, 3, dimension_names=list(names))
    with pytest.raises(UnsupportedFormatError, match=r"an array of the axes .* found; expected axes z, y, x"):
        read(path)


def test_names_that_nobody_knows_are_none(tmp_path):
    values = counting((2, 3, 4, 5))
    write_array(tmp_path / "a.zarr", values, 3, dimension_names=["run", None, "lat", "lon"])
    np.testing.assert_array_equal(read(tmp_path / "a.zarr", volume_index=1).values, values[1])


def test_axes_of_space_with_other_names_are_z_y_x(tmp_path):
    values = values_of("czyx")
    names = ["dye", "depth axis", "v", "u"]
    types = ["channel", "space", "space", "space"]
    axes = [{"name": name, "type": kind} for name, kind in zip(names, types, strict=True)]
    path = write_image(tmp_path / "a.zarr", values, {"axes": axes, "level": scaled("czyx")})
    np.testing.assert_array_equal(read(path, channel="1").values, values[1])


@pytest.mark.parametrize("names", ["width height depth", "Column ROW Plane"])
def test_axes_of_space_with_names_that_are_known(tmp_path, names):
    axes = [{"name": name, "type": "space", "unit": "millimeter"} for name in names.split()]
    values = values_of("xyz")
    volume = read(write_image(tmp_path / "a.zarr", values, {"axes": axes, "level": scaled("xyz")}))
    np.testing.assert_array_equal(volume.values, values.T)
    assert volume.spacing == (0.5, 2, 3)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("attributes", "scale", "told"),
    [
        ({"scale_factor": 0.5, "add_offset": -1000}, (0.5, -1000), []),
        ({"scale_factor": 2.0}, (2, 0), []),
        ({"add_offset": 3}, (1, 3), []),
        ({"scale_factor": 0.0}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"scale_factor": "high"}, (1, 0), ["W-RESCALE-UNKNOWN"]),
        ({"_FillValue": -7}, (1, 0), []),
        ({"_FillValue": [{}]}, (1, 0), ["W-VALUES-MAPPED"]),
    ],
)
def test_values_are_scaled_as_climate_conventions_have_it(tmp_path, version, attributes, scale, told):
    """The attributes of CF 8.1 and 2.5.1, which xarray writes."""
    values = values_of("zyx")
    write_array(tmp_path / "a.zarr", values, version, attributes=attributes)
    volume = read(tmp_path / "a.zarr", spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, values)
    assert (volume.slope, volume.intercept) == scale
    assert [notice.code for notice in volume.warnings] == told


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("attributes", "missing"),
    [
        ({"_FillValue": 7}, [7]),
        ({"missing_value": 7, "valid_range": [3, 110]}, [0, 1, 2, 7, *range(111, 120)]),
        ({"valid_range": [1.5, 50.0], "scale_factor": 0.5}, [0, 1, 2, *range(101, 120)]),
        ({"_FillValue": "AAAAAAAAHEA="}, [7]),
    ],
)
def test_missing_values_are_nodes_without_data(tmp_path, version, attributes, missing):
    """By the attributes of CF 2.5.1, as xarray writes them: real numbers packed as base64 in version 3."""
    for dtype in ("<i2", "<f4"):
        values = values_of("zyx", dtype)
        write_array(tmp_path / dtype[1:], values, version, attributes=attributes)
        volume = read(tmp_path / dtype[1:], spacing=(1, 1, 1))
        assert [notice.code for notice in volume.warnings] == ["W-NO-DATA"]
        if dtype == "<i2":
            is_missing = volume.values == volume.padding[0]
            np.testing.assert_array_equal(is_missing, np.isin(values, missing))
        else:
            found = {*values[np.isnan(volume.values)].astype(int).tolist()}
            assert found == {*missing} or "scale_factor" in attributes


def test_the_fill_value_of_an_array_of_xarrays_marks_missing_values(tmp_path):
    """In version 2 it is how xarray keeps `_FillValue`; 0 is what everybody fills with."""
    values = values_of("zyx")
    names = {"_ARRAY_DIMENSIONS": ["z", "y", "x"]}
    for fill, attributes, padding in ((7, names, (7, 7)), (7, {}, None), (0, names, None)):
        path = tmp_path / f"{fill}{len(attributes)}.zarr"
        write_array(path, values, 2, fill_value=fill, attributes=attributes)
        assert read(path).padding == padding


def test_channels_have_the_names_of_omero(tmp_path):
    omero = {"channels": [{"label": "DAPI"}, {"label": "GFP"}]}
    values = values_of("zcyx")
    path = write_image(
        tmp_path / "a.zarr", values, {"axes": typed("zcyx"), "level": scaled("zcyx")}, omero=omero
    )
    np.testing.assert_array_equal(read(path, channel="gfp").values, values[:, 1])
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes == ("channel 0 (DAPI), 6 x 4 x 5", "channel 1 (GFP), 6 x 4 x 5")


@pytest.mark.parametrize("version", [2, 3])
def test_stores_of_bioformats2raw(tmp_path, version):
    path = tmp_path / "a.zarr"
    group = zarr.open_group(path, mode="w", zarr_format=version)
    layout = {"bioformats2raw.layout": 3}
    group.attrs.update({"ome": {"version": "0.5", **layout}} if version == 3 else layout)
    zarr.open_group(path / "OME", mode="w", zarr_format=version)
    values = values_of("tczyx")[:1, :1]
    for number in range(2):
        image = {"axes": typed("tczyx"), "level": scaled("tczyx")}
        write_image(path / str(number), values + number, image, version)
        if number == 0:
            np.testing.assert_array_equal(read(path).values, values[0, 0])
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(0: image 0, 1: image 1\)"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=1).values, values[0, 0] + 1)


@pytest.mark.parametrize(
    ("image", "error", "told"),
    [
        ({"axes": typed("zyxt")}, DamagedVolumeError, "4 axes told for an array of 3"),
        ({"axes": typed("zzx")}, DamagedVolumeError, "the axes z 5, z 4, x 6 found; expected each axis once"),
        ({"axes": [{}, "y", "x"]}, DamagedVolumeError, "cannot be read"),
        ({"axes": typed("zyx"), "level": scaled("czyx")}, DamagedVolumeError, "4 numbers for 3 axes"),
        ({"axes": typed("zyx"), "coordinateSystems": []}, UnsupportedFormatError, "OME-Zarr 0.1 to 0.5"),
        ({"axes": typed("zyx"), "datasets": [{"path": "../0"}]}, VolumeError, "leads out of the store"),
    ],
)
def test_metadata_that_are_not_as_specified(tmp_path, image, error, told):
    path = write_image(tmp_path / "a.zarr", values_of("zyx"), image)
    with pytest.raises(error, match=told):
        read(path)


@pytest.mark.parametrize("kind", ["rotation", "affine"])
def test_an_image_that_is_turned_is_refused(tmp_path, kind):
    level = scaled("zyx")
    level["coordinateTransformations"].append({"type": kind, kind: [[1, 0, 0], [0, 0, 1], [0, -1, 0]]})
    path = write_image(tmp_path / "a.zarr", values_of("zyx"), {"axes": typed("zyx"), "level": level})
    with pytest.raises(UnsupportedFormatError, match=rf"a transformation '{kind}' found"):
        read(path)


@pytest.mark.parametrize(
    "name", ["v0.1_tczyx", "v0.2_tczyx", "v0.3_tczyx", "v0.3_zyx", "v0.4_tczyx", "bf2raw"]
)
def test_the_cases_of_old_versions(name):
    path = case(f"zarr_old_versions/{name}.zarr")
    volume = read(path)
    assert volume.shape == (32, 28, 24)
    stored = next(path.rglob("0/.zarray")).parent
    assert json.loads((stored / ".zarray").read_text())["compressor"] is None
    chunk = max((file for file in stored.rglob("*") if file.is_file()), key=lambda file: file.stat().st_size)
    np.testing.assert_array_equal(volume.values, np.fromfile(chunk, "<i2").reshape(24, 28, 32))
    if "v0.4" in name or name == "bf2raw":
        np.testing.assert_allclose(volume.spacing, (0.0005, 0.0005, 0.002))
        assert volume.warnings == ()
    else:
        assert volume.spacing == (1, 1, 1)
        assert [notice.code for notice in volume.warnings] == ["W-SPACING-MISSING"]
