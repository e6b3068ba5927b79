"""Distances and origins as each format tells them; what cannot be a distance ends in one message."""

import json
import math
import struct

import nibabel as nib
import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.volume_io.lengths import missing_spacing
from tests.volume_io.dicom.scanner import axial, make_slice, save
from tests.volume_io.reading import counting, read

VALUES = counting((3, 4, 5), "<i2")
UNUSABLE = [0.0, math.nan, math.inf]


def imagej(folder, x=2.0, z=3.0, resolution=None):
    tifffile = pytest.importorskip("tifffile")
    resolution = resolution or (1 / x, 1 / x)
    metadata = {"spacing": z, "unit": "mm", "axes": "ZYX"}
    tifffile.imwrite(
        folder / "a.tif", VALUES.view("u2"), imagej=True, resolution=resolution, metadata=metadata
    )
    return folder / "a.tif"


def ome_tiff(folder, x=2.0, z=3.0):
    tifffile = pytest.importorskip("tifffile")
    metadata = {"axes": "ZYX"} | {f"PhysicalSize{a}Unit": "mm" for a in "XYZ"}
    metadata |= {"PhysicalSizeX": x, "PhysicalSizeY": 2.0, "PhysicalSizeZ": z}
    tifffile.imwrite(folder / "a.ome.tif", VALUES.view("u2"), metadata=metadata)
    return folder / "a.ome.tif"


def ome_zarr(folder, x=2.0, z=3.0):
    pytest.importorskip("numcodecs")
    path = folder / "a.zarr"
    (path / "0").mkdir(parents=True)
    array = {"zarr_format": 2, "shape": [3, 4, 5], "chunks": [3, 4, 5], "dtype": "<i2", "fill_value": 0}
    array |= {"compressor": None, "order": "C", "filters": None}
    steps = [{"type": "scale", "scale": [z, 2.0, x]}]
    levels = [{"path": "0", "coordinateTransformations": steps}]
    image = {"axes": [{"name": name, "unit": "millimeter"} for name in "zyx"], "datasets": levels}
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / ".zattrs").write_text(json.dumps({"multiscales": [image]}))
    (path / "0/.zarray").write_text(json.dumps(array))
    (path / "0/0.0.0").write_bytes(VALUES.tobytes())
    return path


LENGTHS = {"imagej": imagej, "ome-tiff": ome_tiff, "ome-zarr": ome_zarr}


@pytest.mark.parametrize("length", [*UNUSABLE, -2.0])
@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("kind", LENGTHS)
def test_lengths_that_cannot_be_are_refused(tmp_path, kind, axis, length):
    if kind == "imagej" and axis == "x" and not length > 0:
        pytest.skip("a rational number cannot say so")
    if kind == "imagej" and length in (-2.0, 0.0):
        pytest.skip("tells no spacing then")
    path = LENGTHS[kind](tmp_path, **{axis: length})
    with pytest.raises(
        DamagedVolumeError, match=r"distances of .* mm between the nodes found; expected positive"
    ):
        read(path)


@pytest.mark.parametrize("kind", LENGTHS)
def test_lengths_as_they_may_be(tmp_path, kind):
    np.testing.assert_allclose(read(LENGTHS[kind](tmp_path)).spacing, (2, 2, 3))


def test_a_resolution_of_no_pixels_is_refused(tmp_path):
    path = imagej(tmp_path, resolution=((0, 1), (1, 1)))
    with pytest.raises(DamagedVolumeError, match="distances of inf x 1 x 3 mm"):
        read(path)


def nrrd(folder, **fields):
    lines = {
        "type": "short",
        "dimension": 3,
        "sizes": "5 4 3",
        "encoding": "raw",
        "endian": "little",
        **fields,
    }
    header = "NRRD0004\n" + "".join(f"{key.replace('_', ' ')}: {value}\n" for key, value in lines.items())
    (folder / "a.nrrd").write_bytes(header.encode() + b"\n" + VALUES.tobytes())
    return folder / "a.nrrd"


@pytest.mark.parametrize("length", ["0", "inf"])
def test_nrrd_lengths_that_cannot_be(tmp_path, length):
    with pytest.raises(VolumeError, match=r"span the space|not finite"):
        read(nrrd(tmp_path, spacings=f"1 {length} 1"))
    with pytest.raises(VolumeError, match=r"span the space|not finite"):
        read(nrrd(tmp_path, space="ras", space_directions=f"(1,0,0) (0,{length},0) (0,0,1)"))


def test_nrrd_spacings_that_are_not_told_are_one(tmp_path):
    volume = read(nrrd(tmp_path, spacings="2 nan 3"))
    assert volume.spacing == (2, 1, 3)


@pytest.mark.parametrize(
    ("centers", "spacing", "first"),
    [("cell cell cell", (4, 5, 6), (12, 12.5, 13)), ("node node node", (5, 20 / 3, 9), (10, 10, 10))],
)
def test_nrrd_mins_and_maxs_are_of_cells_or_of_nodes(tmp_path, centers, spacing, first):
    """A cell's border is half a step before its node; n cells are n steps long, n nodes n - 1."""
    told = {"axis_mins": "10 10 10", "axis_maxs": "30 30 28", "centers": centers}
    volume = read(nrrd(tmp_path, **told))
    np.testing.assert_allclose(volume.spacing, spacing)
    np.testing.assert_allclose(volume.affine[:3, 3], first)


def test_nrrd_units_scale_spacings_and_mins(tmp_path):
    volume = read(nrrd(tmp_path, spacings="2 3 4", axis_mins="10 20 30", units='"um" "cm" "mm"'))
    np.testing.assert_allclose(volume.spacing, (0.002, 30, 4))
    np.testing.assert_allclose(volume.affine[:3, 3], (0.01, 200, 30))


DIRECTIONS = "(1,0,0) (0,2,0) (0,0,3)"


@pytest.mark.parametrize(
    ("units", "spacing"),
    [
        ('"um" "um" "um"', (1e-3, 2e-3, 3e-3)),
        ('"mm" "mm" ""', (1, 2, 3)),
        ('"" "" "???"', (1, 2, 3)),
        ("cm cm cm", (10, 20, 30)),
    ],
)
def test_nrrd_units_of_axes_count_beside_directions(tmp_path, units, spacing):
    volume = read(
        nrrd(tmp_path, space="RAS", space_origin="(4,5,6)", space_directions=DIRECTIONS, units=units)
    )
    np.testing.assert_allclose(volume.spacing, spacing)
    assert volume.sentences == ()


def test_nrrd_directions_without_an_origin_are_told(tmp_path):
    path = nrrd(tmp_path, space="LPS", space_directions=DIRECTIONS)
    volume = read(path)
    assert [notice.code for notice in volume.warnings] == ["W-POSITION-MISSING"]
    np.testing.assert_array_equal(volume.affine, np.diag([1, 2, 3, 1]))
    volume = read(path, origin=(4, 5, 6))
    assert volume.warnings == ()
    np.testing.assert_array_equal(volume.affine, [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1]])
    volume = read(nrrd(tmp_path, space_directions=DIRECTIONS, units='"mm" "mm" "mm"', space_dimension="3"))
    assert volume.warnings == ()


def test_nrrd_units_of_axes_that_differ_beside_directions_are_refused(tmp_path):
    path = nrrd(
        tmp_path, space="RAS", space_origin="(4,5,6)", space_directions=DIRECTIONS, units='"um" "um" "mm"'
    )
    with pytest.raises(UnsupportedFormatError, match="expected one unit, or space units"):
        read(path)


@pytest.mark.parametrize(
    ("fields", "is_told"),
    [
        ({"space_directions": DIRECTIONS, "spacings": "1 2 3"}, False),
        ({"space_directions": DIRECTIONS, "spacings": "nan nan 3.0001"}, False),
        ({"space_directions": DIRECTIONS, "spacings": "1 2 5"}, True),
        ({"spacings": "1 2 3", "axis_mins": "0 0 0", "axis_maxs": "4 6 6"}, False),
        ({"spacings": "1 -2 3", "axis_mins": "0 0 0", "axis_maxs": "4 -6 6"}, False),
        (
            {"spacings": "1 2 3", "axis_mins": "0 0 0", "axis_maxs": "5 8 9", "centers": "cell cell cell"},
            False,
        ),
        ({"spacings": "1 2 3", "axis_mins": "0 0 0", "axis_maxs": "4 6 9"}, True),
    ],
)
def test_nrrd_statements_about_a_distance_that_differ_are_told(tmp_path, fields, is_told):
    units = (
        {"space": "RAS", "space_origin": "(4,5,6)"}
        if "space_directions" in fields
        else {"units": '"mm" "mm" "mm"'}
    )
    volume = read(nrrd(tmp_path, **fields, **units))
    assert volume.spacing == (1, 2, 3)
    assert [notice.code for notice in volume.warnings] == ["W-GEOMETRY-CONTRADICTED"] * is_told


@pytest.mark.parametrize(
    ("fields", "is_told"),
    [
        ({"old_min": "-1000", "old_max": "3000"}, True),
        ({"old_min": "-1000"}, False),
        ({"old_min": "nan", "old_max": "nan"}, False),
        ({"oldmin": "0", "oldmax": "1"}, True),
    ],
)
def test_nrrd_values_that_were_others_before_they_were_rounded_are_told(tmp_path, fields, is_told):
    volume = read(nrrd(tmp_path, space="RAS", space_origin="(4,5,6)", space_directions=DIRECTIONS, **fields))
    assert [notice.code for notice in volume.warnings] == ["W-VALUES-MAPPED"] * is_told


def nifti(folder, **fields):
    image = nib.Nifti1Image(VALUES.T, np.diag([2, 3, 4, 1]))
    nib.save(image, folder / "a.nii")
    content = bytearray((folder / "a.nii").read_bytes())
    places = {"scl_slope": 112, "scl_inter": 116, "vox_offset": 108, "pixdim1": 80}
    for key, value in fields.items():
        struct.pack_into("<f", content, places[key], value)
    (folder / "a.nii").write_bytes(content)
    return folder / "a.nii"


@pytest.mark.parametrize(
    ("slope", "intercept", "expected"),
    [
        (2.0, 3.0, (2, 3)),
        (-2.0, 3.0, (-2, 3)),
        (2.0, math.nan, (2, 0)),
        (2.0, math.inf, (2, 0)),
        (0.0, 3.0, (1, 0)),
        (math.nan, 3.0, (1, 0)),
        (math.inf, 3.0, (1, 0)),
    ],
)
def test_nifti_scaling_that_is_none(tmp_path, slope, intercept, expected):
    volume = read(nifti(tmp_path, scl_slope=slope, scl_inter=intercept))
    assert (volume.slope, volume.intercept) == expected
    assert math.isfinite(volume.value_range()[1])


@pytest.mark.parametrize("offset", [math.nan, math.inf, -1.0, 2.0**41])
def test_nifti_values_begin_somewhere(tmp_path, offset):
    with pytest.raises(DamagedVolumeError, match=r"vox_offset is .*expected a position"):
        read(nifti(tmp_path, vox_offset=offset))


@pytest.mark.parametrize("offset", [0.0, 348.0, 352.0])
def test_nifti_values_begin_behind_the_header(tmp_path, offset):
    np.testing.assert_array_equal(read(nifti(tmp_path, vox_offset=offset)).values, VALUES)


@pytest.mark.parametrize("length", [*UNUSABLE, -2.0])
def test_meta_lengths(tmp_path, length):
    text = f"NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementSpacing = 1 {length} 3\n"
    (tmp_path / "a.mha").write_bytes(text.encode() + b"ElementDataFile = LOCAL\n" + VALUES.tobytes())
    if length == -2:  # the axis runs the other way
        np.testing.assert_array_equal(read(tmp_path / "a.mha").affine, np.diag([1, -2, 3, 1]))
        return
    with pytest.raises(VolumeError, match=r"span the space|expected finite numbers"):
        read(tmp_path / "a.mha")


@pytest.mark.parametrize("length", UNUSABLE)
def test_analyze_lengths_that_cannot_be(tmp_path, length):
    nib.save(nib.Spm2AnalyzeImage(VALUES.T, np.diag([2, 3, 4, 1])), tmp_path / "a.img")
    content = bytearray((tmp_path / "a.hdr").read_bytes())
    struct.pack_into("<f", content, 84, length)
    (tmp_path / "a.hdr").write_bytes(content)
    with pytest.raises(VolumeError, match=r"span the space|not finite"):
        read(tmp_path / "a.hdr")


@pytest.mark.parametrize("spacing", [[0.0, 1.0], [1.0, 0.0], [1.0, -1.0]])
def test_dicom_pixel_spacing_is_positive(tmp_path, spacing):
    for k, position in enumerate(axial()):
        save(make_slice(position, k, PixelSpacing=spacing), tmp_path / f"{k}")
    with pytest.raises(DamagedVolumeError, match=r"pixel spacing .*expected positive lengths"):
        read(tmp_path)


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_pixel_spacing_of_frames_without_a_place_is_positive_too(tmp_path, length):
    values = np.array([VALUES[k] for k in range(3)])
    changes = {"NumberOfFrames": 3, "PixelSpacing": [1.0, length], "ImagePositionPatient": None}
    dataset = make_slice((0, 0, 0), 0, values=values[0], ImageOrientationPatient=None, **changes)
    dataset.PixelData = values.tobytes()
    save(dataset, tmp_path / "a.dcm")
    with pytest.raises(VolumeError, match="expected positive lengths"):
        read(tmp_path / "a.dcm")


@pytest.mark.parametrize(
    ("steps", "spacing", "origin"),
    [
        ([("scale", (3, 2, 0.5)), ("translation", (30, 20, 10))], (0.5, 2, 3), (10, 20, 30)),
        ([("translation", (30, 20, 10)), ("scale", (3, 2, 0.5))], (0.5, 2, 3), (5, 40, 90)),
        ([("scale", (3, 2, 0.5)), ("scale", (2, 2, 4))], (2, 4, 6), (0, 0, 0)),
        ([("identity", None)], (1, 1, 1), (0, 0, 0)),
    ],
)
def test_transformations_of_a_zarr_image_are_applied_in_their_order(tmp_path, steps, spacing, origin):
    path = ome_zarr(tmp_path)
    told = json.loads((path / ".zattrs").read_text())
    image = told["multiscales"][0]
    listed = [{"type": kind, kind: numbers} for kind, numbers in steps]
    image["datasets"][0]["coordinateTransformations"] = listed[:1]
    image["coordinateTransformations"] = listed[1:]
    (path / ".zattrs").write_text(json.dumps(told))
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, spacing)
    np.testing.assert_allclose(volume.affine[:3, 3], origin)


def test_what_is_taken_for_a_missing_distance_is_told_in_millimetres():
    """Whatever the unit of the others is."""
    assert missing_spacing({}, "the file") == ()
    told = {
        "along z; 0.001 mm is taken": {"z": 1e-3},
        "along x and y; 25.4 mm is taken": {"x": 25.4, "y": 25.4},
        "along y and z; 1e-06 and 1 mm are taken": {"y": 1e-6, "z": 1.0},
        "spacing; 1 mm is taken": {"x": 1.0, "y": 1.0, "z": 1.0},
    }
    for sentence, taken in told.items():
        assert sentence in missing_spacing(taken, "the file")[0].sentence
