"""Synthetic volumes are read back by ours and by independent readers."""

import gzip

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK

from dmc_cli.errors import SettingsError, WriteError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from dmc_cli.volume_io.volume_file import choose_volume_format, write_volume

SUFFIXES = [".nii", ".nii.gz", ".nrrd", ".mha"]


@pytest.fixture
def volume():
    return read_volume("synth:noise:9", ReadSettings(seed=3))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_we_read_back_values_and_affine(tmp_path, volume, suffix):
    path = str(tmp_path / f"noise{suffix}")
    write_volume(path, volume)
    back = read_volume(path, ReadSettings())
    np.testing.assert_array_equal(back.values, volume.values)
    np.testing.assert_allclose(back.affine, volume.affine, atol=1e-7)


def test_every_field_of_the_nifti_header(tmp_path, volume):
    write_volume(str(tmp_path / "noise.nii"), volume)
    content = (tmp_path / "noise.nii").read_bytes()
    header = nibabel.Nifti1Header(content[:348])
    told = {name: header[name].tolist() for name in header if header[name].any()}
    assert told == {
        "sizeof_hdr": 348,
        "dim": [3, 9, 9, 9, 1, 1, 1, 1],
        "datatype": 16,
        "bitpix": 32,
        "pixdim": [1, 0.25, 0.25, 0.25, 0, 0, 0, 0],
        "vox_offset": 352,
        "scl_slope": 1,
        "xyzt_units": 2,
        "sform_code": 2,
        "srow_x": [0.25, 0, 0, -1],
        "srow_y": [0, 0.25, 0, -1],
        "srow_z": [0, 0, 0.25, -1],
        "magic": b"n+1",
    }
    assert content[348:] == bytes(4) + volume.values.astype("<f4").tobytes()


TEXT_HEADERS = {
    ".nrrd": """NRRD0005
type: float
dimension: 3
space dimension: 3
sizes: 9 9 9
space directions: (0.25,0.0,0.0) (0.0,0.25,0.0) (0.0,0.0,0.25)
space origin: (-1.0,-1.0,-1.0)
endian: little
encoding: raw

""",
    ".mha": """ObjectType = Image
NDims = 3
BinaryData = True
BinaryDataByteOrderMSB = False
CompressedData = False
TransformMatrix = 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0
Offset = -1.0 -1.0 -1.0
ElementSpacing = 0.25 0.25 0.25
DimSize = 9 9 9
ElementType = MET_FLOAT
ElementDataFile = LOCAL
""",
}


@pytest.mark.parametrize("suffix", TEXT_HEADERS)
def test_headers_that_are_text(tmp_path, volume, suffix):
    write_volume(str(tmp_path / f"noise{suffix}"), volume)
    expected = TEXT_HEADERS[suffix].encode() + volume.values.astype("<f4").tobytes()
    assert (tmp_path / f"noise{suffix}").read_bytes() == expected


def test_standard_output_and_files_are_written_with_force_only(tmp_path, volume, capsysbinary):
    path = tmp_path / "noise.raw"
    path.write_bytes(b"old")
    with pytest.raises(WriteError, match="exists already"):
        write_volume(str(path), volume)
    assert write_volume(str(path), volume, force=True) == path.stat().st_size == 9**3 * 4
    write_volume("-", volume, output_format="raw")
    assert capsysbinary.readouterr().out == path.read_bytes()


def test_raw_is_the_values_and_nothing_else(tmp_path, volume):
    path = tmp_path / "noise.raw"
    assert write_volume(str(path), volume) == 9**3 * 4
    np.testing.assert_array_equal(np.fromfile(path, "<f4"), volume.values.ravel())


def test_nibabel_reads_nifti(tmp_path, volume):
    write_volume(str(tmp_path / "noise.nii.gz"), volume)
    image = nibabel.load(tmp_path / "noise.nii.gz")
    np.testing.assert_array_equal(np.asarray(image.dataobj).T, volume.values)
    np.testing.assert_allclose(image.affine, volume.affine, atol=1e-7)


def test_pynrrd_reads_nrrd(tmp_path, volume):
    write_volume(str(tmp_path / "noise.nrrd"), volume)
    values, header = nrrd.read(str(tmp_path / "noise.nrrd"), index_order="C")
    np.testing.assert_array_equal(values, volume.values)
    np.testing.assert_array_equal(header["space directions"].T, volume.affine[:3, :3])
    assert "space" not in header


@pytest.mark.parametrize("suffix", [".nrrd", ".mha"])
def test_simpleitk_reads_the_geometry(tmp_path, volume, suffix):
    path = str(tmp_path / f"noise{suffix}")
    write_volume(path, volume)
    image = SimpleITK.ReadImage(path)
    assert image.GetSpacing() == pytest.approx(volume.spacing)
    assert image.GetOrigin() == pytest.approx((-1, -1, -1))
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(image), volume.values)


def test_compressed_files_are_the_same_on_every_run(tmp_path, volume):
    for name in ("a.nii.gz", "b.nii.gz"):
        write_volume(str(tmp_path / name), volume)
    assert (tmp_path / "a.nii.gz").read_bytes() == (tmp_path / "b.nii.gz").read_bytes()
    assert len(gzip.decompress((tmp_path / "a.nii.gz").read_bytes())) == 352 + 9**3 * 4


def test_the_format_is_the_suffix_or_the_one_asked_for():
    assert choose_volume_format("a.NII.GZ") == "nifti"
    assert choose_volume_format("a.dat", "raw") == "raw"
    with pytest.raises(SettingsError, match=r"a\.dat has no suffix that is known; expected one of \.nii"):
        choose_volume_format("a.dat")
    with pytest.raises(SettingsError, match=r"standard output has no suffix; expected one of \.nii"):
        choose_volume_format("-")
