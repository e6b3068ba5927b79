"""Datasets of HDF5 and NeXus files: which is meant, where it lies, and what is refused."""

import gzip
import json
import sys

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import check_input, list_volumes
from tests.volume_io.minc_files import hdf as minc
from tests.volume_io.reading import assert_same_as_itk, counting, read

h5py = pytest.importorskip("h5py")

VALUES = counting((4, 5, 6), "<i2")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.h5"


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


@pytest.mark.parametrize(
    "storage", [{}, {"chunks": (2, 2, 5)}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"}]
)
@pytest.mark.parametrize("dtype", ["<i2", ">u4", "f8", "<f2", "?"])
def test_the_only_volume_of_a_file_is_read(path, storage, dtype):
    values = VALUES.astype(dtype)
    with h5py.File(path, "w") as file:
        file.create_dataset("entry/data", data=values, **storage)
        file["entry/table"] = np.zeros((30, 4))
        file["entry/names"] = ["a", "b"]
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    assert (volume.format, volume.space, volume.files) == ("hdf5", "none", (path,))
    assert codes(volume) == ["W-SPACING-MISSING"]
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.size == (6, 5, 4)


def test_a_dataset_is_chosen_by_its_path(path):
    write(path, {"entry/one": VALUES, "entry/two": VALUES + 1})
    with pytest.raises(AmbiguousVolumeError, match=r"2 datasets .*/one of 4 x 5 x 6, .*a.h5:/entry/one"):
        read(path)
    for named in ("/entry/two", "entry/two"):
        volume = read(f"{path}:{named}")
        np.testing.assert_array_equal(volume.values, VALUES + 1)
        assert volume.files == (path,)
    check_input(f"{path}:/entry/two", ReadSettings())
    assert list_volumes(f"{path}:/entry/two", ReadSettings())[0].size == (6, 5, 4)
    with pytest.raises(VolumeError, match=r"/entry/three is no dataset; expected one of .*/entry/one of"):
        read(f"{path}:/entry/three")


def test_a_packed_file_has_datasets_too(path):
    content = write(path, {"one": VALUES, "two": VALUES + 1}).read_bytes()
    packed = path.with_name("b.h5.gz")
    packed.write_bytes(gzip.compress(content))
    volume = read(f"{packed}:/two")
    np.testing.assert_array_equal(volume.values, VALUES + 1)
    assert volume.files == (packed,)


def test_what_nexus_shows_is_read_with_its_axes(path):
    places = [2 + 0.5 * np.arange(4), np.arange(5) * 100.0, 7e-6 * np.arange(6)]
    volume = read(nexus(path, ["z", "y", "x"], places, ["mm", "um", "m"]))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.007, 0.1, 0.5))
    np.testing.assert_allclose(volume.affine[:3, 3], (0, 0, 2))
    assert volume.warnings == ()


def test_axes_are_taken_by_their_names(path):
    places = [np.arange(4.0), 2 * np.arange(5.0), 3 * np.arange(6.0)]
    volume = read(nexus(path, ["x", "y", "z"], places, ["mm"] * 3))
    np.testing.assert_array_equal(volume.values, VALUES.T)
    np.testing.assert_allclose(volume.spacing, (1, 2, 3))


def test_projections_are_no_slices(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    for label, unit in (("rotation_angle", "degree"), ("rotation_angle", ""), ("theta", "deg"), ("t", "s")):
        with pytest.raises(UnsupportedFormatError, match=rf"the axis {label} in .*projections are no slices"):
            read(nexus(path, [label, "y", "x"], places, [unit, "mm", "mm"]))


def test_axes_with_unknown_or_no_unit_or_uneven_places(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    volume = read(nexus(path, ["z", "y", "x"], places, ["", "parasang", "mm"]))
    assert codes(volume) == ["W-UNIT-MISSING", "W-UNIT-UNKNOWN", "W-SPACING-MISSING"]
    places[0][2] += 0.5
    with pytest.raises(UnsupportedFormatError, match="along the axis z found that are not even"):
        read(nexus(path, ["z", "y", "x"], places, ["mm"] * 3))


def test_times_before_the_grid_are_volumes_to_choose_from(path):
    values = counting((3, 4, 5, 6), "<i2")
    write(path, {"data": values})
    with pytest.raises(AmbiguousVolumeError, match=r"3 volumes found.*--volume-index"):
        read(path)
    np.testing.assert_array_equal(read(path, volume_index=2).values, values[2])
    with pytest.raises(SettingsError, match="3 volumes"):
        read(path, volume_index=3)
    assert "3 volumes" in list_volumes(str(path), ReadSettings())[0].description


def test_element_sizes_are_read_and_loose_lengths_told(path):
    volume = read(write(path, {"data": VALUES}, element_size_um=[3.0, 2.0, 1.0]))
    np.testing.assert_allclose(volume.spacing, (0.001, 0.002, 0.003))
    assert volume.warnings == ()
    volume = read(write(path, {"data": VALUES}, resolution=[40.0, 4.0, 4.0]))
    assert codes(volume) == ["W-UNIT-MISSING", "W-SPACING-MISSING"]
    assert "'resolution'" in volume.warnings[0].sentence


def test_an_image_that_itk_wrote_agrees_with_it(path):
    image = sitk.GetImageFromArray(VALUES)
    image.SetSpacing((1, 2, 3))
    image.SetOrigin((7, 8, 9))
    image.SetDirection((0, 1, 0, 0, 0, 1, 1, 0, 0))
    sitk.WriteImage(image, str(path))
    volume = read(path)
    assert_same_as_itk(volume, path)
    assert volume.space == "LPS"
    assert volume.warnings == ()


def test_a_minc_file_is_known_by_its_content(tmp_path):
    path = minc(tmp_path / "b", VALUES.astype("u1"), 0.0, 1.0)
    assert read(path).format == "minc"
    with pytest.raises(UnsupportedFormatError, match="a MINC 2 file found; read it with --input-format minc"):
        read(path, input_format="hdf5")


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


def test_a_colon_in_a_name_stays_one(tmp_path):
    path = write(tmp_path / "a.h5:data", {"data": VALUES})
    (tmp_path / "a.h5").write_bytes(b"something else")
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_h5py_may_be_missing(path, monkeypatch):
    write(path, {"data": VALUES})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UnsupportedFormatError, match=r"h5py is not installed; pip install .*dmc-cli\[hdf5\]"):
        read(path)


def test_axes_of_vigra_are_taken_by_their_names(path):
    """ilastik writes the channels last."""
    values = np.stack([VALUES, VALUES + 1], axis=-1)
    tags = json.dumps({"axes": [{"key": key} for key in "zyxc"]})
    write(path, {"exported_data": values}, axistags=tags)
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(channel 0 to 1\).*--channel"):
        read(path)
    for choice in ({"channel": "1"}, {"volume_index": 1}):
        np.testing.assert_array_equal(read(path, **choice).values, VALUES + 1)
    assert list_volumes(str(path), ReadSettings())[0].volumes == (
        "channel 0, 6 x 5 x 4",
        "channel 1, 6 x 5 x 4",
    )
    write(
        path,
        {"data": VALUES.T[None, ..., None]},
        axistags=json.dumps({"axes": [{"key": k} for k in "txyzc"]}),
    )
    volume = read(path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert codes(volume) == ["W-SPACING-MISSING"]
    write(path, {"data": VALUES}, axistags=json.dumps({"axes": [{"key": "z"}]}))
    with pytest.raises(DamagedVolumeError, match="1 axistags for 3 axes"):
        read(path)


@pytest.mark.parametrize("storage", [{}, {"chunks": (2, 3, 1, 5), "compression": "gzip"}])
def test_a_volume_may_lie_across_the_stored_axes(path, storage):
    values = counting((4, 5, 2, 6), "<i2")
    with h5py.File(path, "w") as file:
        file.create_dataset("data", data=values, **storage)
        for dimension, label in zip(file["data"].dims, ("y", "x", "channel", "z"), strict=True):
            dimension.label = label
    volume = read(path, channel="1")
    np.testing.assert_array_equal(volume.values, values[:, :, 1].transpose(2, 0, 1))


def test_scales_of_dimensions_are_places(path):
    with h5py.File(path, "w") as file:
        file["data"] = VALUES
        for k, (label, step) in enumerate((("z", 3.0), ("y", 2.0), ("x", 1.0))):
            file[label] = step * np.arange(VALUES.shape[k])
            file[label].attrs["units"] = "um"
            file[label].make_scale(label)
            file["data"].dims[k].attach_scale(file[label])
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, (0.001, 0.002, 0.003))
    assert volume.warnings == ()


@pytest.mark.parametrize(
    ("label", "unit"),
    [
        ("energy", "eV"),
        ("wavelength", "angstrom"),
        ("qz", "1/angstrom"),
        ("time", ""),
        ("a", "K"),
        ("theta", ""),
    ],
)
def test_what_is_no_place_is_no_axis_of_space(path, label, unit):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    with pytest.raises(UnsupportedFormatError, match=rf"the axis {label} in .*expected axes of space"):
        read(nexus(path, [label, "y", "x"], places, [unit, "mm", "mm"]))


def test_times_that_nexus_names_are_chosen_by_name(path):
    values = counting((3, 4, 5, 6), "<i2")
    places = [np.arange(float(n)) for n in values.shape]
    nexus(path, ["t", "z", "y", "x"], places, ["s", "mm", "mm", "mm"], values)
    volume = read(path, time="2")
    np.testing.assert_array_equal(volume.values, values[2])
    assert volume.warnings == ()


@pytest.mark.parametrize("angles", ["theta", "rotation_angle"])
def test_images_with_an_angle_each_are_no_slices(path, angles):
    write(path, {"exchange/data": VALUES, f"exchange/{angles}": np.arange(4.0)})
    with pytest.raises(UnsupportedFormatError, match=rf"an angle a slice in {angles}.*projections"):
        read(path)


def test_axes_without_names_are_told(path):
    write(path, {"data": np.stack([VALUES, VALUES])})
    assert "W-AXES-MISSING" in codes(read(path, volume_index=1))
    with pytest.raises(AmbiguousVolumeError, match="W-AXES-MISSING"):
        read(path, volume_index=1, spacing=(1, 1, 1), strict=True)
    write(path, {"data": VALUES[None, :, None, :, :, None]})
    volume = read(path, spacing=(1, 1, 1), strict=True)
    np.testing.assert_array_equal(volume.values, VALUES)


def test_an_array_of_matlabs_is_told(path):
    volume = read(write(path, {"data": VALUES}, MATLAB_class=np.bytes_("int16")))
    assert codes(volume) == ["W-AXES-MISSING", "W-SPACING-MISSING"]


def test_a_group_stands_for_its_only_dataset(path):
    write(
        path, {"one/data": VALUES, "two/data": VALUES + 1, "two/more/data": VALUES, "none/table": np.zeros(3)}
    )
    np.testing.assert_array_equal(read(f"{path}:/one").values, VALUES)
    with pytest.raises(AmbiguousVolumeError, match=r"2 datasets found .*choose with .*a\.h5:/two/data"):
        read(f"{path}:/two")
    with pytest.raises(UnsupportedFormatError, match="without a dataset of numbers along three axes"):
        read(f"{path}:/none")


@pytest.mark.parametrize(
    ("attributes", "spacing"),
    [
        ({"pixel_size_um": 12.0}, 0.012),
        ({"voxel_size": [5.0, 5.0, 5.0], "unit": "nm"}, 5e-6),
        ({"resolution": 2.0, "units": "mm"}, 2.0),
        ({"spacing": 3.0, "units": ["um", "um", "um"]}, 0.003),
        ({"voxel_size": [1.0, 2.0, 3.0], "unit": "um"}, "W-SPACING-MISSING"),
        ({"voxel_size_um": [1.0, 2.0, 3.0]}, "W-SPACING-MISSING"),
        ({"voxel_size": 1.0, "units": ["um", "nm", "um"]}, "W-UNIT-MISSING"),
    ],
)
@pytest.mark.parametrize("owner", ["entry/data", "entry", "/"])
def test_one_length_with_its_unit_counts(path, attributes, spacing, owner):
    write(path, {"entry/data": VALUES})
    with h5py.File(path, "a") as file:
        file[owner].attrs.update(attributes)
    volume = read(path)
    if isinstance(spacing, str):
        assert codes(volume)[0] == spacing
        assert volume.spacing == (1, 1, 1)
    else:
        assert volume.spacing == pytest.approx((spacing,) * 3)
        assert volume.warnings == ()


def test_components_of_itk_are_volumes_to_choose_from(path):
    image = sitk.GetImageFromArray(np.stack([VALUES, VALUES + 1], axis=-1), isVector=True)
    sitk.WriteImage(image, str(path))
    np.testing.assert_array_equal(read(path, channel="1").values, VALUES + 1)


def test_places_along_some_axes_only_are_told(path):
    places = [np.arange(4.0), np.arange(5.0), np.arange(6.0)]
    nexus(path, ["z", "y", "x"], places, ["mm"] * 3)
    with h5py.File(path, "a") as file:
        del file["entry/data/z"]
    volume = read(path)
    assert codes(volume) == ["W-SPACING-MISSING", "W-SPACING-MISSING"]
    assert "no places along z" in volume.warnings[0].sentence


def imaris(path, channels=1, unit="um"):
    """As Imaris writes it: chunks filled up, smaller copies, attributes of single characters."""

    def characters(text):
        return np.array(list(text), "S1")

    with h5py.File(path, "w") as file:
        for level, values in enumerate((VALUES, VALUES[::2, ::2, ::2])):
            padded = np.full((8, 8, 8), 77, "<i2")
            padded[tuple(map(slice, values.shape))] = values
            for channel in range(channels):
                place = f"DataSet/ResolutionLevel {level}/TimePoint 0/Channel {channel}"
                group = file.create_group(place)
                group.create_dataset("Data", data=padded + channel, chunks=(4, 8, 8), compression="gzip")
                for axis, n in zip("ZYX", values.shape, strict=True):
                    group.attrs[f"ImageSize{axis}"] = characters(str(n))
        told = file.create_group("DataSetInfo/Image").attrs
        told["Unit"] = characters(unit)
        for n, (first, last) in enumerate(((0, 3), (10, 15), (-2, 6))):
            told[f"ExtMin{n}"], told[f"ExtMax{n}"] = characters(str(first)), characters(str(last))
    return path


def test_an_imaris_file_is_read_without_its_padding(path):
    volume = read(imaris(path.with_suffix(".ims")))
    np.testing.assert_array_equal(volume.values, VALUES)
    np.testing.assert_allclose(volume.spacing, (0.0005, 0.001, 0.002))
    np.testing.assert_allclose(volume.affine[:3, 3], (0.00025, 0.0105, -0.001))
    assert volume.warnings == ()
    coarse = read(f"{imaris(path)}:/DataSet/ResolutionLevel 1/TimePoint 0/Channel 0")
    np.testing.assert_array_equal(coarse.values, VALUES[::2, ::2, ::2])
    np.testing.assert_allclose(coarse.spacing, (0.001, 5e-3 / 3, 0.004))
    with pytest.raises(
        AmbiguousVolumeError, match=r"2 datasets found \(/DataSet/ResolutionLevel 0/.*Channel 0"
    ):
        read(imaris(path, channels=2))
    chosen = read(f"{path}:/DataSet/ResolutionLevel 0/TimePoint 0/Channel 1")
    np.testing.assert_array_equal(chosen.values, VALUES + 1)
    assert codes(read(imaris(path, unit="ell"))) == ["W-UNIT-UNKNOWN"]


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
