"""Volumes with any lengths, in any units, an axis each, are where the file says, whatever wrote it.

Factors of units are those of `test_units.py`, written down from their definitions.
"""

import nibabel as nib
import nrrd
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.volume_io.reading import LPS_OF_RAS, counting, lps_affine, physical, read
from tests.volume_io.test_units import NGFF, OME_XML, SPELLINGS

SHAPE = (3, 4, 5)
FEW = settings(max_examples=15)

lengths = st.tuples(*[st.floats(0.01, 1000).map(lambda length: float(f"{length:.6g}"))] * 3)
places = st.tuples(*[st.floats(-1000, 1000).map(lambda place: float(f"{place:.6g}"))] * 3)


def three(table):
    """Units of three axes, of lengths that a mesh of floats holds; None for an axis without one."""
    near = [unit for unit, length in table.items() if 1e-9 <= length <= 1e6]
    return st.tuples(*[st.none() | st.sampled_from(near)] * 3)


def in_mm(units, table, missing=1.0):
    return np.array([missing if unit is None else table[unit] for unit in units])


def codes(volume):
    return [notice.code for notice in volume.warnings]


def missing_unit(units):
    return ["W-UNIT-MISSING"] * (None in units)


@FEW
@given(st.permutations("TCZ"), lengths, three(OME_XML), st.sampled_from(["u1", ">u2", "<f4", "<i4"]))
def test_ome_tiff(tmp_path_factory, order, sizes, units, dtype):
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path_factory.mktemp("ome") / "a.ome.tif"
    axes = "".join(order) + "YX"
    values = counting(tuple({"T": 2, "C": 2, "Z": 3, "Y": 4, "X": 5}[axis] for axis in axes), dtype)
    told = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", sizes, strict=True)}
    told |= {f"PhysicalSize{axis}Unit": unit for axis, unit in zip("XYZ", units, strict=True) if unit}
    tifffile.imwrite(path, values, metadata={"axes": axes, **told}, photometric="minisblack")
    volume = read(path, time="1", channel="0")
    expected = values.transpose([axes.index(axis) for axis in "TCZYX"])[1, 0]
    np.testing.assert_array_equal(volume.values, expected)
    np.testing.assert_allclose(volume.spacing, sizes * in_mm(units, OME_XML, missing=1e-3), rtol=1e-9)
    assert codes(volume) == []


ASCII = {unit: length for unit, length in SPELLINGS.items() if unit.isascii() and "\0" not in unit}


@FEW
@given(st.tuples(*[st.integers(1, 5000)] * 2), st.floats(0.01, 100), three(ASCII), places)
def test_imagej(tmp_path_factory, pixels, between, units, origin):
    """A resolution is a ratio of whole numbers; without a unit of their own y and z have that of x."""
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path_factory.mktemp("imagej") / "a.tif"
    told = {"axes": "ZYX", "spacing": between}
    told |= {key: unit for key, unit in zip(("unit", "yunit", "zunit"), units, strict=True) if unit}
    told |= {f"{axis}origin": place for axis, place in zip("xyz", origin, strict=True)}
    values = counting(SHAPE, "<u2")
    tifffile.imwrite(path, values, imagej=True, resolution=[(n, 7) for n in pixels], metadata=told)
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    own = [unit or units[0] for unit in units]
    sizes = np.array([7 / pixels[0], 7 / pixels[1], between]) * in_mm(own, ASCII)
    np.testing.assert_allclose(volume.spacing, sizes, rtol=1e-9)
    np.testing.assert_allclose(volume.affine[:3, 3], -np.array(origin) * sizes, rtol=1e-9, atol=1e-12)
    assert codes(volume) == missing_unit(own)


@FEW
@given(st.permutations("tczyx"), st.sampled_from([2, 3]), lengths, lengths, places, three(NGFF))
def test_ome_zarr(tmp_path_factory, order, version, sizes, factors, shifts, units):
    """Scale and translation of the level, then the scale of the image; 0.4 is version 2 of Zarr, 0.5 is 3."""
    zarr = pytest.importorskip("zarr", minversion="3")
    path, axes = tmp_path_factory.mktemp("zarr") / "a.zarr", "".join(order)
    values = counting(tuple({"t": 2, "c": 2, "z": 3, "y": 4, "x": 5}[axis] for axis in axes), "<i4")
    size_of, factor_of, shift_of = (dict(zip("xyz", each, strict=True)) for each in (sizes, factors, shifts))
    kinds = {"t": {"type": "time", "unit": "second"}, "c": {"type": "channel"}}
    for axis, unit in zip("xyz", units, strict=True):
        kinds[axis] = {"type": "space"} | ({"unit": unit} if unit else {})
    named = [{"name": axis, **kinds[axis]} for axis in axes]
    steps = [
        {"type": "scale", "scale": [size_of.get(axis, 1.0) for axis in axes]},
        {"type": "translation", "translation": [shift_of.get(axis, 0.0) for axis in axes]},
    ]
    image = {"axes": named, "datasets": [{"path": "0", "coordinateTransformations": steps}]}
    whole = {"type": "scale", "scale": [factor_of.get(axis, 0.5) for axis in axes]}
    image["coordinateTransformations"] = [whole]
    group = zarr.open_group(path, mode="w", zarr_format=version)
    group.attrs.update({"ome": {"multiscales": [image]}} if version == 3 else {"multiscales": [image]})
    group.create_array("0", shape=values.shape, chunks=(2, 2, 2, 2, 2), dtype=values.dtype)[...] = values
    volume = read(path, time="0", channel="1")
    expected = values.transpose([axes.index(axis) for axis in "tczyx"])[0, 1]
    np.testing.assert_array_equal(volume.values, expected)
    scale = in_mm(units, NGFF) * factors
    np.testing.assert_allclose(volume.spacing, sizes * scale, rtol=1e-9)
    np.testing.assert_allclose(volume.affine[:3, 3], shifts * scale, rtol=1e-9, atol=1e-12)
    assert codes(volume) == missing_unit(units)


@FEW
@given(
    kind=st.sampled_from([nib.Nifti1Image, nib.Nifti2Image]),
    form=st.sampled_from(["sform", "qform"]),
    unit=st.sampled_from([0, 1, 2, 3]),
    time_unit=st.sampled_from([0, 8, 16, 24, 32, 40, 48]),
    scale=st.sampled_from([(1, 0), (-2, 3), (0.5, -1024), (0, 0)]),
    dtype=st.sampled_from(["u1", ">i2", "<u4", "<f4", ">f8"]),
    seed=st.integers(0, 999),
)
def test_nifti(tmp_path_factory, kind, form, unit, time_unit, scale, dtype, seed):
    draws, path = np.random.default_rng(seed), tmp_path_factory.mktemp("nifti") / "a.nii"
    turned = np.linalg.qr(draws.normal(size=(3, 3)))[0] * draws.uniform(0.3, 4, 3)
    affine = np.vstack((np.column_stack((turned, draws.normal(size=3) * 50)), [0, 0, 0, 1]))
    values = counting((2, *SHAPE), dtype)
    header = kind.header_class(endianness="<" if seed % 2 else ">")
    image = kind(values.T, None, header)
    getattr(image, f"set_{form}")(affine, 1)
    image.header.set_zooms((*np.linalg.norm(turned, axis=0), 3.0))
    image.header["xyzt_units"] = unit | time_unit
    image.header["scl_slope"], image.header["scl_inter"] = scale
    nib.save(image, path)
    content = bytearray(path.read_bytes())  # nibabel resets the scale when it saves
    fields = np.frombuffer(content, image.header.template_dtype.newbyteorder(header.endianness), 1)
    fields["scl_slope"], fields["scl_inter"] = scale
    path.write_bytes(content)
    volume = read(path, time="1")
    slope, intercept = scale if scale[0] else (1, 0)
    np.testing.assert_allclose(physical(volume), slope * values[1].astype(float) + intercept)
    expected = affine.copy()
    expected[:3] *= {0: 1, 1: 1000, 2: 1, 3: 1e-3}[unit]
    np.testing.assert_allclose(volume.affine, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert volume.space == "RAS"
    assert codes(volume) == {0: ["W-UNIT-MISSING"], 1: ["W-UNIT-DOUBTFUL"], 2: [], 3: []}[unit]


ALIKE = {unit: length for unit, length in ASCII.items() if 0.01 <= length <= 100}
"""Units of which several in one world do not make it flat."""

SPACES = {
    "right-anterior-superior": LPS_OF_RAS,
    "left-posterior-superior": np.eye(4),
    "left-anterior-superior": np.diag([1.0, -1, 1, 1]),
    "RAS": LPS_OF_RAS,
    "LPS": np.eye(4),
}
"""Names of spaces, and what turns their coordinates into LPS."""


@FEW
@given(
    st.sampled_from([*SPACES]),
    st.sampled_from(["raw", "gzip"]),
    three(ALIKE),
    lengths,
    places,
    st.integers(0, 99),
)
def test_nrrd(tmp_path_factory, space, encoding, units, sizes, origin, seed):
    """Space units belong to the axes of the world, not to those of the grid; pynrrd writes them."""
    path = tmp_path_factory.mktemp("nrrd") / "a.nrrd"
    turned = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] * sizes
    told = {"space": space, "encoding": encoding, "space directions": turned.T, "space origin": origin}
    told |= {"space units": [(unit or "").strip('"') for unit in units]}
    values = counting(SHAPE, "<i2")
    nrrd.write(str(path), values, told, index_order="C")
    volume = read(path)
    np.testing.assert_array_equal(volume.values, values)
    expected = np.vstack((np.column_stack((turned, origin)), [0, 0, 0, 1]))
    expected[:3] *= in_mm(units, ASCII)[:, None]
    np.testing.assert_allclose(lps_affine(volume), SPACES[space] @ expected, rtol=1e-9)
    assert codes(volume) == missing_unit(units)


@FEW
@given(three(SPELLINGS), lengths, places, st.permutations("xyz"), st.tuples(*[st.sampled_from((1, -1))] * 3))
def test_nrrd_without_a_space(tmp_path_factory, units, sizes, mins, labels, signs):
    """Spacings with labels: axis mins are places of the first nodes, negative spacings run backwards."""
    path = tmp_path_factory.mktemp("nrrd") / "a.nrrd"
    spelled = [f'"{(unit or "???").strip(chr(34)).replace(chr(0), "")}"' for unit in units]
    steps = [size * sign for size, sign in zip(sizes, signs, strict=True)]
    fields = {
        **{"type": "short", "dimension": 3, "sizes": "5 4 3", "endian": "little", "encoding": "raw"},
        **{"spacings": " ".join(map(str, steps)), "axis mins": " ".join(map(str, mins))},
        **{"units": " ".join(spelled), "labels": " ".join(f'"{label}"' for label in labels)},
    }
    header = "NRRD0005\n" + "".join(f"{key}: {value}\n" for key, value in fields.items())
    path.write_bytes(f"{header}\n".encode() + counting(SHAPE).astype("<i2").tobytes())
    volume = read(path)
    scales = in_mm(units, SPELLINGS)
    for axis, label in enumerate(labels):
        column = np.zeros(3)
        column["xyz".index(label)] = steps[axis] * scales[axis]
        np.testing.assert_allclose(volume.affine[:3, axis], column, rtol=1e-9)
        place = volume.affine["xyz".index(label), 3]
        np.testing.assert_allclose(place, mins[axis] * scales[axis], rtol=1e-9)
    assert codes(volume) == missing_unit(units)


@FEW
@given(st.sampled_from([*SPELLINGS]), lengths, places, st.permutations(range(3)))
def test_metaimage(tmp_path_factory, unit, sizes, origin, order):
    path = tmp_path_factory.mktemp("meta") / "a.mha"
    matrix = np.eye(3)[list(order)]
    fields = {
        **{"ObjectType": "Image", "NDims": 3, "DimSize": "5 4 3", "ElementType": "MET_SHORT"},
        **{"ElementSpacing": " ".join(map(str, sizes)), "Offset": " ".join(map(str, origin))},
        **{"TransformMatrix": " ".join(map(str, matrix.ravel())), "DistanceUnits": unit},
    }
    header = "".join(f"{key} = {value}\n" for key, value in fields.items()) + "ElementDataFile = LOCAL\n"
    path.write_bytes(header.encode() + counting(SHAPE).astype("<i2").tobytes())
    volume = read(path)
    expected = np.column_stack((matrix.T * sizes, origin)) * SPELLINGS[unit]
    np.testing.assert_allclose(volume.affine[:3], expected, rtol=1e-9)
    assert codes(volume) == []


@FEW
@given(
    shapes=st.lists(st.lists(st.integers(2, 3), min_size=1, max_size=5), min_size=1, max_size=4),
    seed=st.integers(0, 99),
)
def test_npz(tmp_path_factory, shapes, seed):
    """Every array of three axes or more is offered, in the order of the file; others are passed over."""
    path = tmp_path_factory.mktemp("numpy") / "a.npz"
    draws = np.random.default_rng(seed)
    arrays = [draws.integers(0, 99, shape).astype(draws.choice(["<i2", ">f4", "u1"])) for shape in shapes]
    np.savez_compressed(path, *arrays)
    volumes = [v for array in arrays if array.ndim >= 3 for v in array.reshape(-1, *array.shape[-3:])]
    for index, values in enumerate(volumes):
        np.testing.assert_array_equal(read(path, volume_index=index).values, values)
