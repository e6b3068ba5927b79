"""Axes of NRRD files are taken by directions, kinds and labels, wherever they stand."""

import gzip

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import counting, read

SIZES = {"x": 6, "y": 4, "z": 5, "t": 3, "c": 2, "l": 2}
SPACINGS = {"x": 0.5, "y": 2.0, "z": 3.0, "t": 7.0, "c": 1.0, "l": 1.0}


def write(path, axes, encoding="raw", **fields):
    """A file with axes, the fastest first, and the array [slowest, ..., fastest]."""
    values = counting(tuple(SIZES[axis] for axis in reversed(axes)))
    told = {
        "type": "short",
        "dimension": len(axes),
        "sizes": " ".join(str(SIZES[axis]) for axis in axes),
        "endian": "little",
        "encoding": encoding,
        **fields,
    }
    header = "\n".join(["NRRD0005", *(f"{key}: {value}" for key, value in told.items())]) + "\n\n"
    content = values.tobytes()
    path.write_bytes(header.encode() + (gzip.compress(content) if encoding == "gzip" else content))
    return values


def volume_of(values, axes, order, **where):
    """One volume of such an array, its axes in an order, the fastest first."""
    stored = axes[::-1]
    others = [axis for axis in stored if axis not in order]
    moved = values.transpose([stored.index(axis) for axis in (*others, *reversed(order))])
    return moved[tuple(where[axis] for axis in others)]


def kinds_of(axes):
    kinds = {"t": "time", "c": "???", "l": "list"}
    return " ".join(kinds.get(axis, "domain") for axis in axes)


def labels_of(axes):
    names = {"t": "time", "c": "channel", "l": "l"}
    return " ".join(f'"{names.get(axis, axis)}"' for axis in axes)


@settings(max_examples=30)
@given(
    st.permutations("xyztcl"),
    st.integers(0, 3),
    st.sampled_from(["raw", "gzip"]),
    st.sampled_from(["directions", "kinds", "labels"]),
    st.data(),
)
def test_axes_of_any_kinds_in_any_order(tmp_path_factory, order, left_out, encoding, told, data):
    axes = "".join(axis for axis in order if axis in "xyz" or axis in "tcl"[left_out:])
    grid = [axis for axis in axes if axis in "xyz"]
    fields = {"spacings": " ".join(str(SPACINGS[axis]) for axis in axes), "labels": labels_of(axes)}
    if told != "labels":
        fields["kinds"] = kinds_of(axes)
    elif "l" in axes:
        fields["kinds"] = " ".join("list" if axis == "l" else "???" for axis in axes)
    if told == "directions":
        vectors = {a: [SPACINGS[a] * (n == "xyz".index(a)) for n in range(3)] for a in grid}
        text = [f"({','.join(map(str, vectors[a]))})" if a in vectors else "none" for a in axes]
        fields |= {"space": "left-posterior-superior", "space directions": " ".join(text)}
        del fields["spacings"]
    path = tmp_path_factory.mktemp("axes") / "a.nrrd"
    values = write(path, axes, encoding, **fields)
    where = {axis: data.draw(st.integers(0, SIZES[axis] - 1)) for axis in axes[::-1] if axis not in "xyz"}
    index = int(np.ravel_multi_index([*where.values()], [SIZES[a] for a in where])) if where else None
    volume = read(path, volume_index=index)
    np.testing.assert_array_equal(volume.values, volume_of(values, axes, grid, **where))
    expected = np.zeros((3, 3))
    for column, axis in enumerate(grid):
        expected["xyz".index(axis), column] = SPACINGS[axis]
    np.testing.assert_allclose(volume.affine[:3, :3], expected)
    named = {n: str(where[a]) for a, n in (("t", "time"), ("c", "channel")) if a in where}
    chosen = read(path, volume_index=where.get("l"), **named)
    np.testing.assert_array_equal(chosen.values, volume.values)
    (entry,) = list_volumes(str(path), ReadSettings())
    count = int(np.prod([SIZES[a] for a in where], dtype=int))
    several = f", {count} volumes (--volume-index 0 to {count - 1})" if count > 1 else ""
    assert (len(entry.volumes), entry.description) == (count, f"nrrd{several}")


@pytest.mark.parametrize(
    ("axes", "fields"),
    [
        ("xyt", {"kinds": "domain domain time"}),
        ("xyt", {"kinds": "??? ??? time"}),
        ("xyt", {"labels": '"x" "y" "t"'}),
        ("txy", {"labels": '"time" "" ""'}),
        ("cxyt", {"kinds": "list space space time"}),
        ("xyzt", {"space": "RAS", "space directions": "(1,0,0) (0,1,0) none none"}),
    ],
)
def test_without_three_axes_of_space_there_is_no_volume(tmp_path, axes, fields):
    write(tmp_path / "a.nrrd", axes, **fields)
    with pytest.raises(UnsupportedFormatError, match="expected three axes of space"):
        read(tmp_path / "a.nrrd")


@pytest.mark.parametrize("kinds", ["domain domain domain domain", "??? ??? ??? ???", None])
@pytest.mark.parametrize("axes", ["lxyz", "xlyz", "xyzl"])
def test_an_axis_without_a_distance_is_none_of_space(tmp_path, axes, kinds):
    fields = {"spacings": " ".join("nan" if a == "l" else str(SPACINGS[a]) for a in axes)}
    values = write(tmp_path / "a.nrrd", axes, **fields, **({"kinds": kinds} if kinds else {}))
    volume = read(tmp_path / "a.nrrd", volume_index=1)
    np.testing.assert_array_equal(volume.values, volume_of(values, axes, "xyz", l=1))
    assert volume.spacing == (0.5, 2, 3)


@pytest.mark.parametrize("label", ["time", "t", "channel"])
def test_a_domain_that_is_called_a_time_is_none_of_space(tmp_path, label):
    fields = {"labels": f'"x" "y" "z" "{label}"', "kinds": "domain domain domain domain"}
    write(tmp_path / "a.nrrd", "xyzt", **fields)
    (entry,) = list_volumes(str(tmp_path / "a.nrrd"), ReadSettings())
    assert (entry.size, len(entry.volumes)) == ((6, 4, 5), 3)
    fields = {"labels": f'"x" "y" "{label}"', "kinds": "domain domain domain"}
    write(tmp_path / "a.nrrd", "xyt", **fields)
    with pytest.raises(UnsupportedFormatError, match="expected three axes of space"):
        read(tmp_path / "a.nrrd")


@pytest.mark.parametrize(
    ("sizes", "line", "is_told"),
    [
        ("3 20 30", "", True),
        ("3 20 30", "kinds: domain domain domain\n", False),
        ("3 20 30", "spacings: 1 1 1\n", False),
        ("20 30 3", "", False),
    ],
)
def test_what_may_be_a_picture_is_told(tmp_path, sizes, line, is_told):
    text = f"NRRD0004\ntype: uchar\ndimension: 3\nsizes: {sizes}\n{line}encoding: raw\n\n"
    (tmp_path / "a.nrrd").write_bytes(text.encode() + bytes(1800))
    volume = read(tmp_path / "a.nrrd", spacing=(1, 1, 1))
    assert ("W-AXES-MISSING" in [notice.code for notice in volume.warnings]) == is_told


@pytest.mark.parametrize(("fields", "is_told"), [({}, True), ({"kinds": "domain domain domain time"}, False)])
def test_axes_that_nobody_names_are_told(tmp_path, fields, is_told):
    values = write(tmp_path / "a.nrrd", "xyzt", spacings="1 1 1 1", units='"mm" "mm" "mm" ""', **fields)
    volume = read(tmp_path / "a.nrrd", volume_index=2)
    np.testing.assert_array_equal(volume.values, values[2])
    assert [notice.code for notice in volume.warnings] == ["W-AXES-MISSING"] * is_told


def test_a_direction_of_nan_is_none(tmp_path):
    directions = "(nan,nan,nan) (0.5,0,0) (0,2,0) (0,0,3)"
    values = write(tmp_path / "a.nrrd", "lxyz", **{"space": "LPS", "space directions": directions})
    volume = read(tmp_path / "a.nrrd", volume_index=1)
    np.testing.assert_array_equal(volume.values, values[..., 1])
    assert volume.spacing == (0.5, 2, 3)
    assert read(case("nrrd_odd/nan_direction.nrrd"), volume_index=0).shape == (32, 28, 24)


def test_a_direction_of_nan_of_three_is_damaged(tmp_path):
    write(tmp_path / "a.nrrd", "xyz", **{"space": "LPS", "space directions": "(1,0,0) (0,1,0) (nan,nan,nan)"})
    with pytest.raises(DamagedVolumeError, match="not finite"):
        read(tmp_path / "a.nrrd")


@pytest.mark.parametrize("count", [1, 2])
def test_four_coordinates_of_a_space_without_a_name_are_told(tmp_path, count):
    """As ITK writes a series of volumes: it knows no names of such spaces."""
    image = sitk.GetImageFromArray(counting((4, 5, 6)))
    image.SetSpacing((1, 2, 3))
    image.SetDirection((0, 1, 0, 0, 0, 1, 1, 0, 0))
    sitk.WriteImage(sitk.JoinSeries([image] * count), str(tmp_path / "a.nrrd"))
    volume = read(tmp_path / "a.nrrd", volume_index=0)
    np.testing.assert_array_equal(volume.affine[:3, :3], [[0, 2, 0], [0, 0, 3], [1, 0, 0]])
    assert [notice.code for notice in volume.warnings] == ["W-ORIENTATION-MISSING", "W-UNIT-MISSING"]


def test_more_units_than_a_space_has_axes_are_told(tmp_path):
    space = {
        "space": "LPS",
        "space directions": "(1,0,0) (0,1,0) (0,0,1)",
        "space origin": "(0,0,0)",
        "space units": '"mm" "mm" "cm" "s"',
    }
    write(tmp_path / "a.nrrd", "xyz", **space)
    volume = read(tmp_path / "a.nrrd")
    assert volume.spacing == (1, 1, 10)
    assert [notice.code for notice in volume.warnings] == ["W-GEOMETRY-CONTRADICTED"]
