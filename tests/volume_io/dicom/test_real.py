"""Real DICOM series lie where their slices say, and where an independent reader puts them."""

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so

from dmc_cli.errors import (
    AmbiguousVolumeError,
)
from tests.volume_io.reading import physical, read, world


def read_series_with_itk(folder):
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    image = reader.Execute()
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return sitk.GetArrayFromImage(image), affine


def test_the_sample_head_agrees_with_simpleitk(sample_data):
    volume = read(sample_data / "dicom/head_ct")
    values, affine = read_series_with_itk(sample_data / "dicom/head_ct")
    np.testing.assert_array_equal(physical(volume), values)
    np.testing.assert_allclose(volume.affine, affine)


@pytest.mark.parametrize(
    "name",
    [
        "dicom_enhanced_nema/BRTUM014",
        "dicom_enhanced_xa30/0001_1.3.12.2.1107.5.2.43.67093.2022071112080825794102791.dcm",
    ],
)
def test_frames_of_enhanced_files_lie_where_their_groups_say(shared_data, name):
    dataset = pydicom.dcmread(shared_data / name)
    volume = read(shared_data / name)
    frames = [
        g.PlanePositionSequence[0].ImagePositionPatient for g in dataset.PerFrameFunctionalGroupsSequence
    ]
    found = np.array([world(volume, k) for k in range(volume.shape[2])])
    pixels = dataset.pixel_array
    for position, plane in zip(frames, pixels, strict=True):
        k = np.linalg.norm(found - np.array(position, float), axis=1).argmin()
        np.testing.assert_allclose(found[k], np.array(position, float), atol=1e-2)
        np.testing.assert_array_equal(volume.values[k], plane)


def test_the_tilted_uneven_head_lies_where_its_slices_say(shared_data):
    folder = shared_data / "dicom_ge_tilt"
    volume = read(folder)
    datasets = sorted(
        (pydicom.dcmread(p) for p in folder.glob("*.dcm")), key=lambda d: d.ImagePositionPatient[2]
    )
    assert volume.shape == (512, 512, 28)
    assert volume.padding == (-1500, -1500)
    for k, dataset in enumerate(datasets):
        position = np.array(dataset.ImagePositionPatient, float)
        rows = np.array(dataset.ImageOrientationPatient, float)
        np.testing.assert_allclose(world(volume, k), position, atol=2e-3)
        far = position + rows[:3] * 511 * dataset.PixelSpacing[1] + rows[3:] * 511 * dataset.PixelSpacing[0]
        np.testing.assert_allclose(world(volume, k, 511, 511), far, atol=2e-3)
        np.testing.assert_array_equal(volume.values[k], dataset.pixel_array)


def test_the_oblique_mr_with_jitter(shared_data):
    volume = read(shared_data / "dicom_mr_pd_axial")
    datasets = [pydicom.dcmread(p) for p in (shared_data / "dicom_mr_pd_axial").glob("*.dcm")]
    found = np.array([world(volume, k) for k in range(20)])
    for dataset in datasets:
        distances = np.linalg.norm(found - np.array(dataset.ImagePositionPatient, float), axis=1)
        assert distances.min() < 0.1
        np.testing.assert_array_equal(volume.values[distances.argmin()], dataset.pixel_array)


def test_a_folder_with_plans_and_reports_has_one_volume(shared_data):
    volume = read(shared_data / "dicom_nonimage_mix")
    assert volume.shape == (512, 512, 2)


def test_a_real_missing_slice(shared_data):
    folder = shared_data / "dicom_compressed_4slices/failing_missing_slice"
    with pytest.raises(AmbiguousVolumeError, match=r"10\.000 mm between .*0009.*0010"):
        read(folder)
    assert read(folder, slice_gaps="keep").slice_positions == pytest.approx([0, 5, 10, 20])


@pytest.mark.slow
def test_the_zip_of_the_whole_head(shared_data):
    volume = read(shared_data / "dicom_vhf_head.zip")
    assert volume.shape == (512, 512, 234)
    np.testing.assert_array_equal(volume.affine[:3, 3], [0, 0, 1500])
