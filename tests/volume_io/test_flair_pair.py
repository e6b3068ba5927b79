"""A real scan as NIfTI and as NRRD, from the demo images of niivue (BSD-2-Clause)."""

import nibabel as nib
import numpy as np
import pytest

from tests.conftest import ROOT
from tests.volume_io.reading import LPS_OF_RAS, lps_affine, physical, read

FOLDER = ROOT.parent / "shared" / "cases" / "flair_pair_real"


@pytest.mark.skipif(not FOLDER.is_dir(), reason=f"{FOLDER} is not on this machine")
def test_case_of_one_scan_in_two_formats():
    image = nib.load(FOLDER / "FLAIR.nii.gz")
    first, second = read(FOLDER / "FLAIR.nii.gz"), read(FOLDER / "FLAIR.nrrd")
    assert first.shape == second.shape == image.shape
    np.testing.assert_allclose(lps_affine(first), LPS_OF_RAS @ image.affine, atol=1e-4)
    np.testing.assert_allclose(lps_affine(second), lps_affine(first), atol=1e-3)
    for k in range(0, image.shape[2], 7):
        expected = np.asanyarray(image.dataobj[..., k]).T
        np.testing.assert_allclose(first.slope * first.values[k] + first.intercept, expected, rtol=1e-6)
    np.testing.assert_allclose(physical(second), physical(first), rtol=1e-6)
