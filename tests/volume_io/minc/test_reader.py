import gzip
import os
import sys
import warnings

import nibabel as nib
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import map_file
from dmc_cli.volume_io.read import list_volumes
from dmc_cli.volume_io.slices import stack_slices
from tests.volume_io.minc_files import AXES, hdf, netcdf
from tests.volume_io.reading import counting, nibabels_own, physical, read

h5py = pytest.importorskip("h5py")

KINDS = {"1": (netcdf, nib.Minc1Image), "2": (hdf, nib.Minc2Image)}
TURNED = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def assert_same(volume, image, index=()):
    """Compare with a whole image of nibabel's, whose first axis is the slowest one."""
    np.testing.assert_allclose(physical(volume), image.get_fdata()[index], rtol=2e-6, atol=1e-6)
    np.testing.assert_allclose(volume.affine, image.affine[:, [2, 1, 0, 3]], atol=1e-12)
    assert (volume.space, volume.format) == ("RAS", "minc")


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


@pytest.mark.parametrize("dtype", ["u1", "i1", ">i2", ">u2", ">i4", ">f4", ">f8"])
def test_one_scale_keeps_the_stored_values(tmp_path, kind, dtype):
    write, load = kind
    values = counting((3, 4, 5), dtype)
    path = write(tmp_path / "a.mnc", values, -4.0, 11.0, cosines=TURNED, start=(5, -6, 7), step=(1, -2, 3))
    volume = read(path)
    assert_same(volume, load.load(path))
    np.testing.assert_array_equal(volume.values, values)
    assert volume.values.dtype == np.dtype(dtype).newbyteorder("=")
    assert (volume.slope == 1) == (values.dtype.kind == "f")


@given(
    shape=st.tuples(st.integers(1, 3), *[st.integers(2, 5)] * 3),
    dtype=st.sampled_from(["u1", ">i2", ">i4"]),
    along=st.integers(0, 2),
    seed=st.integers(0, 999),
)
@pytest.mark.parametrize("version", KINDS)
def test_slices_have_scales_of_their_own(tmp_path_factory, version, shape, dtype, along, seed):
    write, load = KINDS[version]
    draws = np.random.default_rng(seed)
    values = draws.integers(0, 120, shape).astype(dtype)
    least = draws.normal(size=shape[:along])
    most = least + draws.uniform(0, 9, shape[:along])
    ends = (least, most) if along else (float(least), float(most))
    path = tmp_path_factory.mktemp("minc") / "a.mnc"
    write(path, values, *ends, along=AXES[:along], valid_range=(10, 100))
    image = load.load(path)
    for index in range(shape[0]):
        volume = read(path, volume_index=index)
        assert_same(volume, image, index)
        is_one = along < 2
        physical_type = np.float64 if dtype == ">i4" else np.float32
        assert volume.values.dtype == (np.dtype(dtype).newbyteorder("=") if is_one else physical_type)


def test_a_slice_of_one_value_is_no_error(tmp_path, kind):
    write, load = kind
    ends = (np.array([0.0, 5, 0]), np.array([0.0, 9, 7]))
    path = write(tmp_path / "a.mnc", counting((3, 4, 5), "u1"), *ends, along=("zspace",))
    assert_same(read(path), load.load(path))


@pytest.mark.parametrize("axes", [("xspace", "zspace", "yspace"), ("yspace", "zspace", "xspace")])
def test_axes_in_any_order(tmp_path, kind, axes):
    write, load = kind
    path = write(tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0, axes=axes, cosines=TURNED)
    assert_same(read(path), load.load(path))


def test_several_volumes_are_listed_and_chosen_from(tmp_path, kind):
    path = kind[0](tmp_path / "a.mnc", counting((3, 2, 4, 5), "u1"), 0.0, 1.0)
    with pytest.raises(AmbiguousVolumeError, match="3 volumes found"):
        read(path)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.description == "minc, 3 volumes (--volume-index 0 to 2)"
    assert entry.volumes[1] == "time 1, 5 x 4 x 2"
    np.testing.assert_array_equal(read(path, time="1").values, read(path, volume_index=1).values)
    with pytest.raises(SettingsError, match="has no such axis"):
        read(path, channel="1")
    assert entry.size == (5, 4, 2)


def test_the_content_tells_the_format(tmp_path, kind):
    path = kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0)
    assert read(path.rename(tmp_path / "a.bin")).format == "minc"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"axes": ("yspace", "xspace", "time")}, "MINC image|axes yspace, xspace, time found"),
        ({"axes": ("zspace", "yspace", "wspace")}, "MINC image|axes zspace"),
        ({"valid_range": (5, 5)}, "valid range from 5 to 5"),
        ({"valid_range": (0, 1e9)}, "valid range from 0 to 1e"),
        ({"valid_range": (float("nan"), 1)}, "valid range from nan"),
        ({"spacing": "irregular"}, "Irregular spacing"),
        ({"most": float("nan")}, "slope nan"),
        ({"most": 0.0}, "slope 0"),
        ({"step": (0, 1, 1)}, "span the space"),
        ({"step": (float("inf"), 1, 1)}, "not finite"),
        (
            {"along": ("yspace",), "least": np.zeros(4), "most": np.ones(4)},
            "expected them along|along different axes",
        ),
    ],
    ids=str,
)
def test_headers_that_cannot_be(tmp_path, kind, changes, told):
    arguments = {"least": 0.0, "most": 1.0} | changes
    with pytest.raises(VolumeError, match=told) as caught:
        read(kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), **arguments))
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("kept", [2, 8, 60, 400, 900, -60, -1])
def test_a_truncated_file_is_refused(tmp_path, kind, kept):
    values = np.random.default_rng(0).integers(0, 99, (9, 9, 9)).astype("u1")
    path = kind[0](tmp_path / "a.mnc", values, 0.0, 1.0)
    content = path.read_bytes()
    path.write_bytes(content[:kept])
    with pytest.raises(VolumeError):
        read(path, input_format="minc")


def test_a_gzipped_file_is_read(tmp_path, kind):
    path = kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0)
    (tmp_path / "a.mnc.gz").write_bytes(gzip.compress(path.read_bytes()))
    np.testing.assert_array_equal(read(tmp_path / "a.mnc.gz").values, read(path).values)


@pytest.mark.parametrize("content", [b"something else" * 99, b"CDF\1" + bytes(99), b"\x89HDF" + bytes(999)])
def test_what_is_no_minc_is_refused(tmp_path, content):
    (tmp_path / "a.mnc").write_bytes(content)
    with pytest.raises((UnsupportedFormatError, DamagedVolumeError), match="MINC"):
        read(tmp_path / "a.mnc")


def test_a_header_of_attributes_without_end_is_refused(tmp_path):
    """A gigabyte of them would be parsed for minutes."""
    start = b"CDF\1" + bytes(4) + bytes(8) + b"\0\0\0\x0c" + b"\x7f\xff\xff\xff"
    with (tmp_path / "a.mnc").open("wb") as file:
        file.write(start + (b"\0\0\0\4abcd" + b"\0\0\0\1" + bytes(4)) * 300_000)
    with pytest.raises(DamagedVolumeError, match="header of more than"):
        read(tmp_path / "a.mnc")


@pytest.mark.parametrize(
    "storage",
    [
        {"chunks": (1, 4, 5)},
        {"chunks": (2, 3, 2), "compression": "gzip"},
        {"chunks": (3, 4, 5), "compression": "gzip", "shuffle": True, "fletcher32": True},
        {"chunks": True, "maxshape": (None, None, None), "compression": "gzip"},
    ],
    ids=str,
)
def test_chunks_of_any_shape(tmp_path, storage):
    ends = (np.arange(5.0), np.arange(5.0) + 2)
    path = hdf(tmp_path / "a.mnc", counting((5, 4, 5), "<i2"), *ends, along=("zspace",), storage=storage)
    assert_same(read(path), nib.load(path))


def test_other_packings_are_refused(tmp_path):
    path = hdf(tmp_path / "a.mnc", counting((3, 4, 5)), 0.0, 1.0, storage={"compression": "lzf"})
    with pytest.raises(UnsupportedFormatError, match=r"filters \[32000\] found; expected gzip"):
        read(path)


def without_image(path):
    """Write a MINC 2 file and open it to give it another image."""
    hdf(path, counting((3, 4, 5), "u1"), 0.0, 1.0)
    file = h5py.File(path, "a")
    del file["minc-2.0/image/0/image"]
    return file, file["minc-2.0/image/0"]


def told(image):
    image.attrs["dimorder"] = np.bytes_("zspace,yspace,xspace")


def test_links_to_other_files_are_refused(tmp_path):
    hdf(tmp_path / "other.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0)
    file, folder = without_image(tmp_path / "a.mnc")
    folder["image"] = h5py.ExternalLink("other.mnc", "/minc-2.0/image/0/image")
    file.close()
    with pytest.raises(UnsupportedFormatError, match="holds a link, 'image'"):
        read(tmp_path / "a.mnc")


def test_values_in_other_files_are_refused(tmp_path):
    (tmp_path / "secret").write_bytes(bytes(60))
    file, folder = without_image(tmp_path / "a.mnc")
    outside = [(str(tmp_path / "secret"), 0, 60)]
    told(folder.create_dataset("image", (3, 4, 5), "u1", external=outside))
    file.close()
    with pytest.raises(UnsupportedFormatError, match="found in other files"):
        read(tmp_path / "a.mnc")


def test_a_virtual_image_is_refused(tmp_path):
    hdf(tmp_path / "other.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0)
    file, folder = without_image(tmp_path / "a.mnc")
    layout = h5py.VirtualLayout((3, 4, 5), "u1")
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.mnc"), "minc-2.0/image/0/image", (3, 4, 5))
    told(folder.create_virtual_dataset("image", layout))
    file.close()
    with pytest.raises(UnsupportedFormatError, match="found in other files"):
        read(tmp_path / "a.mnc")


@pytest.mark.parametrize(
    "options",
    [
        {"shape": (9999, 9999, 9999), "chunks": (9999, 99, 99), "compression": "gzip"},
        {"shape": (9999, 9999, 9999)},
        {"shape": (4, 4, 4), "chunks": (1000, 1000, 1000), "maxshape": (None,) * 3, "compression": "gzip"},
    ],
    ids=["packed", "plain", "chunk"],
)
def test_an_image_that_is_not_there_is_refused_at_once(tmp_path, options):
    file, folder = without_image(tmp_path / "a.mnc")
    told(folder.create_dataset("image", dtype="u1", **options))
    file.close()
    with pytest.raises(DamagedVolumeError, match="bytes found for an image"):
        read(tmp_path / "a.mnc")


def test_a_chunk_that_unpacks_to_far_more_is_refused(tmp_path):
    import zlib

    file, folder = without_image(tmp_path / "a.mnc")
    image = folder.create_dataset("image", (3, 4, 5), "u1", chunks=(3, 4, 5), compression="gzip")
    told(image)
    image.id.write_direct_chunk((0, 0, 0), zlib.compress(bytes(200 << 20)))
    file.close()
    with pytest.raises(DamagedVolumeError, match="unpack to more than the 60 of a chunk"):
        read(tmp_path / "a.mnc")


def test_without_h5py_it_is_told_how_to_get_it(tmp_path, monkeypatch):
    path = hdf(tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UnsupportedFormatError, match=r'h5py is not installed; pip install "dmc-cli\[minc\]"'):
        read(path)


@pytest.mark.parametrize(
    "name",
    [
        "tiny.mnc",
        "minc1_1_scale.mnc",
        "minc1_4d.mnc",
        "minc1-no-att.mnc",
        "small.mnc",
        "minc2_1_scale.mnc",
        "minc2_4d.mnc",
        "minc2-4d-d.mnc",
        "minc2-no-att.mnc",
        "minc2_baddim.mnc",
    ],
)
def test_nibabels_own_files(name):
    path = nibabels_own(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nibabel's word on a spacing that is neither regular nor irregular
        image = nib.load(path)
    for index in range(image.shape[0] if image.ndim == 4 else 1):
        assert_same(read(path, volume_index=index), image, index if image.ndim == 4 else ())


@pytest.mark.parametrize("left", [0, 4096, 5 * 4096 + 7])
def test_minc_1_that_shrinks_while_it_is_read_is_told(tmp_path, monkeypatch, left):
    path = netcdf(tmp_path / "a.mnc", counting((20, 40, 50), "u1"), -4.0, 11.0)

    def shrunk(*words):
        os.truncate(path, left)
        return stack_slices(*words)

    monkeypatch.setattr("dmc_cli.volume_io.minc.reader.stack_slices", shrunk)
    with pytest.raises(DamagedVolumeError, match="became shorter, or could not be read, while it was in use"):
        read(path)


def test_minc_1_that_loses_its_scales_is_told(tmp_path, monkeypatch):
    """They lie behind the values here, and are read first."""
    ends = np.linspace(0, 1, 20), np.linspace(2, 3, 20)
    path = netcdf(tmp_path / "a.mnc", counting((20, 40, 50), "u1"), *ends, along=("zspace",))

    def shrunk(file):
        mapping = map_file(file)
        os.truncate(path, 4096)
        return mapping

    monkeypatch.setattr("dmc_cli.volume_io.minc.netcdf.map_file", shrunk)
    with pytest.raises(DamagedVolumeError, match="became shorter"):
        read(path)


def test_minc_1_that_cannot_be_mapped_is_refused(tmp_path, monkeypatch):
    path = netcdf(tmp_path / "a.mnc", counting((3, 4, 5), "u1"), -4.0, 11.0)
    monkeypatch.setattr("dmc_cli.volume_io.minc.netcdf.map_file", lambda file: None)
    with pytest.raises(DamagedVolumeError, match=r"a\.mnc: no MINC image .* cannot be mapped into memory"):
        read(path)


@pytest.mark.parametrize(
    ("unit", "scale", "codes"),
    [("mm", 1, []), ("um", 1e-3, []), ("pixel", 1, ["W-UNIT-UNKNOWN"]), ("???", 1, ["W-UNIT-MISSING"])],
)
def test_the_unit_of_the_axes(tmp_path, kind, unit, scale, codes):
    write, load = kind
    path = write(tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0, start=(5, -6, 7), units=unit)
    volume = read(path)
    expected = load.load(path).affine[:, [2, 1, 0, 3]]
    np.testing.assert_allclose(volume.affine[:3], expected[:3] * scale, rtol=1e-12)
    assert [notice.code for notice in volume.warnings] == codes
    assert read(path, spacing=(1, 2, 3)).spacing == pytest.approx((1, 2, 3) if codes else volume.spacing)


def test_a_time_is_no_length(tmp_path, kind):
    path = kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0, units="s")
    with pytest.raises(UnsupportedFormatError, match="a time is no length"):
        read(path)


@pytest.mark.parametrize(
    ("told", "spacing", "origin", "codes"),
    [
        ({"without": ["direction_cosines"]}, (2, 3, 4), (2, 3, 4), []),
        ({"without": ["step"]}, (1, 1, 1), (2, 3, 4), ["W-SPACING-MISSING"]),
        ({"without": ["step"], "units": "um"}, (1e-3,) * 3, (2e-3, 3e-3, 4e-3), ["W-SPACING-MISSING"]),
        ({"without": ["start"]}, (2, 3, 4), (0, 0, 0), ["W-POSITION-MISSING"]),
        ({"cosines": np.diag([2, 1, 1.1])}, (2, 3, 4), (2, 3, 4), ["W-ORIENTATION-ROUNDED"] * 2),
        ({"cosines": np.diag([1.00001, 1, 1])}, (2, 3, 4), (2, 3, 4), []),
        ({"alignment": "centre"}, (2, 3, 4), (2, 3, 4), []),
        ({"alignment": "start_"}, (2, 3, 4), (2, 3, 4), ["W-GEOMETRY-CONTRADICTED"]),
    ],
    ids=str,
)
def test_what_an_axis_leaves_open_is_told(tmp_path, kind, told, spacing, origin, codes):
    volume = read(kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0, **told))
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-4)
    np.testing.assert_allclose(volume.affine[:3, 3], origin, rtol=1e-4)
    assert [notice.code for notice in volume.warnings] == codes


def test_options_tell_what_a_header_lacks(tmp_path, kind):
    path = kind[0](tmp_path / "a.mnc", counting((3, 4, 5), "u1"), 0.0, 1.0, without=["step", "start"])
    volume = read(path, spacing=(1, 2, 3), origin=(4, 5, 6))
    np.testing.assert_allclose(volume.affine, [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1]])
    assert volume.warnings == ()
