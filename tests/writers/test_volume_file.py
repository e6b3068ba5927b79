"""Synthetic volumes are read back by ours and by independent readers."""

import gzip

import nibabel
import nrrd
import numpy as np
import pytest
import SimpleITK

from dmc_cli.errors import SettingsError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume.read import read_volume
from dmc_cli.writers.volume_file import choose_volume_format, write_volume

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
