"""Share with the readers' tests small volumes, an independent reader, hand-written headers."""

from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume

LPS_OF_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


NIBABEL_DATA = Path(nib.__file__).parent / "tests" / "data"


def nibabels_own(name):
    """A file that nibabel brings along for its own tests."""
    path = NIBABEL_DATA / name
    if not path.exists():
        pytest.skip("this nibabel brings no files along")
    return path


def assert_same_as_nibabel(volume, image, index=None):
    """Compare with a whole image of nibabel's, axes x, y, z, or with one of its volumes."""
    values = image.get_fdata() if index is None else image.get_fdata()[..., index]
    np.testing.assert_allclose(physical(volume), values.T, rtol=1e-6)
    np.testing.assert_allclose(volume.affine, image.affine, atol=1e-5)
    assert volume.space == "RAS"


def read(path, **settings):
    return read_volume(str(path), ReadSettings(**settings))


def physical(volume):
    return volume.slope * volume.values.astype(np.float64) + volume.intercept


def lps_affine(volume):
    return LPS_OF_RAS @ volume.affine if volume.space == "RAS" else volume.affine


def read_with_itk(path):
    """Values [k, j, i] and LPS affine, as SimpleITK reads them."""
    image = sitk.ReadImage(str(path))
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return sitk.GetArrayFromImage(image), affine


def assert_same_as_itk(volume, path, atol=1e-6):
    values, affine = read_with_itk(path)
    assert volume.values.shape == values.shape
    np.testing.assert_allclose(physical(volume), values, rtol=1e-6)
    np.testing.assert_allclose(lps_affine(volume), affine, atol=atol)


def counting(shape, dtype="<i2"):
    """Values that are all different where the type allows it; shape is (nz, ny, nx)."""
    return np.arange(np.prod(shape)).reshape(shape).astype(dtype)


def world(volume, k, i=0, j=0):
    """Where node (i, j, k) lies, by the definition of `Volume.slice_positions`."""
    if volume.slice_positions is not None:
        k = volume.slice_positions[k] / volume.spacing[2]
    return (volume.affine @ [i, j, k, 1])[:3]
