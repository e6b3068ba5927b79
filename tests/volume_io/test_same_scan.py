"""One scan in every format lies in the same place with the same values."""

import nibabel as nib
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so

from tests.volume_io.dicom.scanner import make_slice, save
from tests.volume_io.reading import LPS_OF_RAS, lps_affine, physical, read

SHAPE = (5, 6, 7)
ROTATION = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
SPACING = np.array([0.75, 0.5, 2.0])
ORIGIN = np.array([10.0, -20.0, 30.0])
VALUES = np.random.default_rng(6).integers(-1000, 2000, SHAPE).astype("<i2")

AFFINE = np.eye(4)
ROTATION[:, 2] = np.cross(ROTATION[:, 0], ROTATION[:, 1])
AFFINE[:3, :3] = ROTATION * SPACING
AFFINE[:3, 3] = ORIGIN


def with_itk(path):
    image = sitk.GetImageFromArray(VALUES)
    image.SetDirection(ROTATION.ravel())
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    sitk.WriteImage(image, str(path))


def as_nifti(folder):
    nib.save(nib.Nifti1Image(VALUES.T, LPS_OF_RAS @ AFFINE), folder / "a.nii.gz")
    return folder / "a.nii.gz"


def as_nrrd(folder):
    with_itk(folder / "a.nrrd")
    return folder / "a.nrrd"


def as_metaimage(folder):
    with_itk(folder / "a.mha")
    return folder / "a.mha"


def as_dicom(folder):
    orientation = [float(f"{c:.9f}") for c in ROTATION[:, :2].T.ravel()]
    for k in range(SHAPE[0]):
        position = [float(f"{c:.9f}") for c in (AFFINE @ [0, 0, k, 1])[:3]]
        dataset = make_slice(position, k, values=VALUES[k] + 1024, orientation=orientation)
        save(dataset, folder / "dicom" / f"{k}.dcm")
    return folder / "dicom"


@pytest.mark.parametrize("write", [as_nifti, as_nrrd, as_metaimage, as_dicom])
def test_every_format_lies_in_the_same_place(tmp_path, write):
    volume = read(write(tmp_path))
    np.testing.assert_array_equal(physical(volume), VALUES)
    np.testing.assert_allclose(lps_affine(volume), AFFINE, atol=1e-5)


def test_the_sample_fistula_agrees_in_the_world(sample_data):
    one, two = read(sample_data / "nrrd/fistula_mra.nrrd"), read(sample_data / "nifti/fistula_mra.nii.gz")
    assert (one.space, two.space) == ("LPS", "RAS")
    one_to_two = np.round(np.linalg.inv(lps_affine(two)) @ lps_affine(one)).astype(int)
    k, j, i = np.indices(one.values.shape).reshape(3, -1)
    x, y, z, _ = one_to_two @ np.array([i, j, k, np.ones_like(i)])
    np.testing.assert_array_equal(one.values.ravel(), two.values[z, y, x])
    np.testing.assert_allclose(lps_affine(two) @ one_to_two, lps_affine(one), atol=1e-4)
