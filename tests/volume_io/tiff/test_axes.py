"""Axes of TIFF files are taken by their names, whatever their order; all that is not of space is a choice."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, SettingsError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import counting, read

tifffile = pytest.importorskip("tifffile")

SIZES = {"Z": 5, "Y": 4, "X": 6, "T": 3, "C": 2, "A": 2}


def values_of(axes, dtype="<u2"):
    return counting(tuple(SIZES[axis] for axis in axes), dtype)


def volume_of(values, axes, **where):
    """One volume [z, y, x] of an array with such axes."""
    others = [axis for axis in axes if axis not in "ZYX"]
    moved = values.transpose([axes.index(axis) for axis in (*others, *"ZYX")])
    return moved[tuple(where[axis] for axis in others)]


@settings(max_examples=20)
@given(
    st.permutations("TCAZYX"), st.integers(0, 3), st.sampled_from(["u1", "<u2", "f4", "f2", "?"]), st.data()
)
def test_axes_of_any_names_in_any_order(tmp_path_factory, order, left_out, dtype, data):
    axes = "".join(axis for axis in order if axis in "ZYX" or axis in "TCA"[left_out:])
    values, path = values_of(axes, dtype), tmp_path_factory.mktemp("axes") / "a.tif"
    tifffile.imwrite(path, values, photometric="minisblack", metadata={"axes": axes})
    where = {axis: data.draw(st.integers(0, SIZES[axis] - 1)) for axis in axes if axis not in "ZYX"}
    others = [axis for axis in axes if axis not in "ZYX"]
    index = (
        int(np.ravel_multi_index([where[a] for a in others], [SIZES[a] for a in others])) if others else None
    )
    expected = volume_of(values, axes, **where)
    np.testing.assert_array_equal(read(path, volume_index=index).values, expected)
    named = {n: str(where[a]) for a, n in (("C", "channel"), ("T", "time")) if a in where}
    left = where.get("A")
    np.testing.assert_array_equal(read(path, volume_index=left, **named).values, expected)


@settings(max_examples=20)
@given(st.permutations("TCZ"), st.sampled_from([None, "zlib"]), st.integers(0, 2), st.integers(0, 1))
def test_the_orders_of_ome(tmp_path_factory, order, compression, time, channel):
    axes = "".join(order) + "YX"
    values, path = values_of(axes), tmp_path_factory.mktemp("ome") / "a.ome.tif"
    tifffile.imwrite(
        path, values, metadata={"axes": axes, "Channel": {"Name": ["DAPI", "GFP"]}}, compression=compression
    )
    volume = read(path, time=str(time), channel=("dapi", "GFP")[channel])
    np.testing.assert_array_equal(volume.values, volume_of(values, axes, T=time, C=channel))


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("axes", ["TZCYX", "ZCYX", "TZYX", "CYX", "TYX"])
def test_hyperstacks_of_imagej(tmp_path, axes, compression):
    values, path = values_of(axes), tmp_path / "a.tif"
    tifffile.imwrite(
        path, values, imagej=True, metadata={"axes": axes, "spacing": 1}, compression=compression
    )
    if "Z" not in axes:
        with pytest.raises(
            UnsupportedFormatError, match=r"of the axes (channel|time) \d, y 4, x 6 found; expected"
        ):
            read(path)
        return
    with pytest.raises(AmbiguousVolumeError, match=r"\d volumes found \(.*\); .*--volume-index N"):
        read(path)
    where = {axis: SIZES[axis] - 1 for axis in axes if axis in "TC"}
    named = {{"T": "time", "C": "channel"}[axis]: str(place) for axis, place in where.items()}
    np.testing.assert_array_equal(read(path, **named).values, volume_of(values, axes, **where))


def test_the_volumes_are_listed_as_they_are_counted(tmp_path):
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, values_of("TZCYX"), metadata={"axes": "TZCYX", "Channel": {"Name": ["a", "b"]}})
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.size == (6, 4, 5)
    assert entry.volumes[:3] == (
        "time 0, channel 0 (a), 6 x 4 x 5",
        "time 0, channel 1 (b), 6 x 4 x 5",
        "time 1, channel 0 (a), 6 x 4 x 5",
    )
    (left,) = list_volumes(str(path), ReadSettings(channel="b"))
    assert left.volumes == tuple(f"time {t}, channel 1 (b), 6 x 4 x 5" for t in range(3))


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"channel": "2"}, r"channel is '2'; .* has channel 0 to 1 \(DAPI, GFP\); expected one of these"),
        ({"channel": "Cy5"}, r"channel is 'Cy5'"),
        ({"time": "1"}, r"time is '1'; .* has no such axis; expected 0, or leave --time out"),
        ({"channel": "1", "volume_index": 1}, r"volume_index is 1; .* holds 1 volume"),
    ],
)
def test_what_is_not_there_cannot_be_chosen(tmp_path, wrong, told):
    path = tmp_path / "a.ome.tif"
    metadata = {"axes": "CZYX", "Channel": {"Name": ["DAPI", "GFP"]}}
    tifffile.imwrite(path, values_of("CZYX"), metadata=metadata)
    with pytest.raises(SettingsError, match=told):
        read(path, **wrong)


def test_images_of_one_file_are_volumes_to_choose_from(tmp_path):
    path = tmp_path / "a.ome.tif"
    big, small = counting((5, 4, 6), "<u2"), counting((3, 7, 8), "<u2")
    with tifffile.TiffWriter(path, ome=True) as file:
        for values, name, size in ((big, "left", 0.5), (small, "right", 0.25)):
            file.write(
                values, metadata={"axes": "ZYX", "Name": name, **{f"PhysicalSize{a}": size for a in "XYZ"}}
            )
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(0: left, 1: right\)"):
        read(path)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.volumes == ("left, 6 x 4 x 5", "right, 8 x 7 x 3")
    volume = read(path, volume_index=1)
    np.testing.assert_array_equal(volume.values, small)
    np.testing.assert_allclose(volume.spacing, [0.00025] * 3)


def test_a_plane_that_is_missing_is_no_zero(tmp_path):
    """Of an OME-TIFF of several files one of which is not there."""
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, values_of("ZYX"), metadata={"axes": "ZYX"}, compression="zlib")
    with tifffile.TiffFile(path) as file:
        xml = file.ome_metadata
    planes = "".join(
        f'<TiffData IFD="{z if z < 3 else 0}" FirstZ="{z}" PlaneCount="1">'
        f'<UUID FileName="{"a.ome.tif" if z < 3 else "b.ome.tif"}">urn:{int(z >= 3)}</UUID></TiffData>'
        for z in range(5)
    )
    start, end = xml.index("<TiffData"), xml.index("</Pixels>")
    path.unlink()
    told = {"description": xml[:start] + planes + xml[end:], "metadata": None, "photometric": "minisblack"}
    tifffile.imwrite(path, values_of("ZYX")[:3], compression="zlib", **told)
    with pytest.raises(DamagedVolumeError, match=r"plane 3 of 5 is missing"):
        read(path)


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("where", ["a file", "a folder"])
def test_one_bit_a_pixel(tmp_path, where, compression):
    values = counting((6, 16, 20)) % 3 == 0
    if where == "a file":
        path = tmp_path / "a.tif"
        tifffile.imwrite(path, values, photometric="minisblack", compression=compression)
    else:
        path = tmp_path
        for k, plane in enumerate(values):
            tifffile.imwrite(path / f"{k}.tif", plane, photometric="minisblack", compression=compression)
    with tifffile.TiffFile(path if path.is_file() else path / "0.tif") as file:
        assert file.pages[0].bitspersample == 1
    volume = read(path)
    assert volume.values.dtype == np.uint8
    np.testing.assert_array_equal(volume.values, values)


@pytest.mark.parametrize(
    ("photometric", "told"), [("miniswhite", "lowest value is white"), ("palette", "colour table")]
)
def test_values_that_are_no_brightness_are_told(tmp_path, photometric, told):
    colors = {"colormap": np.zeros((3, 256), "u2")} if photometric == "palette" else {}
    values = counting((6, 16, 20), "u1")
    tifffile.imwrite(tmp_path / "a.tif", values, photometric=photometric, **colors)
    volume = read(tmp_path / "a.tif", spacing=(1, 1, 1))
    assert [(n.code, told in n.sentence) for n in volume.warnings] == [("W-PHOTOMETRIC", True)]
    np.testing.assert_array_equal(volume.values, values)


@pytest.mark.parametrize("name", ["zcyx_imagej.tif", "zcyx_ome.ome.tif", "czyx_ome.ome.tif"])
def test_two_channels_are_two_volumes(name):
    path = case(f"tiff_hyperstack/{name}")
    found = [read(path, channel=str(channel)) for channel in (0, 1)]
    with tifffile.TiffFile(path) as file:
        values = np.moveaxis(file.asarray(), file.series[0].axes.index("C"), 0)
    for volume, expected in zip(found, values, strict=True):
        np.testing.assert_array_equal(volume.values, expected)
        np.testing.assert_allclose(volume.spacing, (0.0005, 0.0005, 0.0015), rtol=1e-6)


def test_three_times_of_two_channels_are_six_volumes():
    (entry,) = list_volumes(str(case("tiff_hyperstack/tzcyx_imagej.tif")), ReadSettings())
    assert entry.size == (64, 48, 40)
    assert len(entry.volumes) == 6


@pytest.mark.parametrize("name", ["tyx_imagej.tif", "cyx_imagej.tif"])
def test_times_and_channels_of_a_flat_image_are_no_volume(name):
    with pytest.raises(UnsupportedFormatError, match="expected a stack of grey slices along z"):
        read(case(f"tiff_hyperstack/{name}"))


def test_axes_that_nobody_names_are_told(tmp_path):
    values = counting((2, 3, 5, 4, 6), "<u2")
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack")
    volume = read(tmp_path / "a.tif", volume_index=4, spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, values[1, 1])
    assert [notice.code for notice in volume.warnings] == ["W-AXES-MISSING"]
    assert "shape (2, 3, 5, 4, 6) has axes without names" in volume.warnings[0].sentence


@pytest.mark.parametrize(
    "description",
    [
        '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image></OME>',
        "ImageJ=1.54f\nimages=5\nslices=2\nchannels=7\nhyperstack=true\n",
    ],
)
def test_metadata_that_cannot_be_followed_are_refused(tmp_path, description):
    told = {"description": description, "metadata": None, "photometric": "minisblack"}
    tifffile.imwrite(tmp_path / "a.tif", values_of("ZYX"), **told)
    with pytest.raises(DamagedVolumeError, match="the TIFF cannot be read"):
        read(tmp_path / "a.tif", volume_index=0)


def test_the_files_of_a_relative_path_are_the_one_that_is_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tifffile.imwrite("a.tif", np.zeros((3, 4, 5), "u1"), photometric="minisblack")
    assert read(Path("a.tif")).files == (Path("a.tif"),)
