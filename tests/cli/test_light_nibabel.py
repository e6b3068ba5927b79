"""A process of the command's own imports of nibabel what it needs."""

import subprocess
import sys

import pytest

TELL = """
import sys
{before}
from dmc_cli.cli.light_nibabel import import_nibabel_lightly
import_nibabel_lightly()
import nibabel.{module}
{after}
print(*sorted(sys.modules))
"""


def imported(module, before="", after=""):
    script = TELL.format(module=module, before=before, after=after)
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return run.stdout.split()


@pytest.mark.parametrize(
    "module", ["nifti1", "nifti2", "spm2analyze", "freesurfer.mghformat", "brikhead", "parrec", "minc2"]
)
def test_a_header_comes_without_other_formats_and_pydicom(module):
    found = imported(module)
    assert f"nibabel.{module}" in found
    assert not {"pydicom", "nibabel.loadsave", "nibabel.gifti", "nibabel.streamlines"} & set(found)


def test_pydicom_is_there_for_everybody_else():
    assert "pydicom" in imported("nifti1", after="import pydicom")
    assert "pydicom" in imported("nifti1", before="import pydicom")


def test_a_package_that_is_there_already_is_left_as_it_is():
    assert "nibabel.loadsave" in imported("nifti1", before="import nibabel")


def test_the_command_imports_lightly(sample_data):
    words = ["info", str(sample_data / "nifti/fistula_mra.nii.gz")]
    script = f"import sys; sys.argv[1:] = {words}; from dmc_cli.cli import main; main()"
    words = [sys.executable, "-X", "importtime", "-c", script]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "nibabel.nifti1" in run.stderr
    assert "pydicom.config" not in run.stderr
    assert "nibabel.loadsave" not in run.stderr
