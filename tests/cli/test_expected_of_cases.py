"""The right answers of shared/cases/*/EXPECTED.txt, by the whole program: status, codes, place, size.

Volumes and bounds there are those of marching cubes or of the program before; quads of so coarse balls hold
up to 1.5 % less. What only a reader tells (axes, lists of volumes, values) is held beside the readers.
"""

import json

import numpy as np
import pytest

from tests.cases import case

MESHES = [
    # input, options, codes of the warnings, volume in mm3, its relative tolerance, bounds of x, y, z
    ("dicom_microct_5um/um5", "-i 0", "", 0.00026498, 0.015,
     ([0.04658, 0.04259, 0.03001], [0.17851, 0.14248, 0.11248])),
    ("tiff_hyperstack/zcyx_imagej.tif", "-i 1000 --channel 0", "", 1.8952e-6, 0.01,
     ([0.006201, 0.004604, 0.012015], [0.0237983, 0.0173933, 0.044975])),
    ("tiff_hyperstack/zcyx_ome.ome.tif", "-i 1000 --channel 0", "", 1.8952e-6, 0.01,
     ([0.006201, 0.004604, 0.012015], [0.0237983, 0.0173933, 0.044975])),
    ("tiff_hyperstack/czyx_ome.ome.tif", "-i 1000 --volume-index 0", "", 1.8952e-6, 0.01,
     ([0.006201, 0.004604, 0.012015], [0.0237983, 0.0173933, 0.044975])),
    ("zarr_units/nanometer.zarr", "-i 0", "", 1.37776e-13, 0.02, None),
    ("zarr_units/nounit.zarr", "-i 0", "W-UNIT-MISSING", 137776, 0.02, None),
    ("npz_nnunet/case_001.npz", "-i 0 --volume-index 0", "W-SPACING-MISSING", 5053.86, 0.01, None),
    ("npz_nnunet/case_v1.npz", "-i 0 --volume-index 0", "W-AXES-MISSING W-SPACING-MISSING", 5053.86, 0.01,
     None),
    ("dicom_two_factors/echo_component", "-i 400 --series 1", "", 6042.1, 1e-4, None),
    ("dicom_two_factors/echo_component_unpadded", "-i 400 --series 1", "", 6042.1, 1e-4, None),
    # relative to 2047.5 of the lookup table, which falls: the object is the low side
    ("modality_lut/lut", "-i 2047.5 --inside below", "", None, None, None),
]  # fmt: skip


@pytest.fixture
def convert(tmp_path, run):
    """Convert a case; return the result and the report."""

    def call(name, *options):
        report = tmp_path / "r.json"
        result = run("convert", case(name), tmp_path / "a.ply", "--report", report, *options)
        assert result.exit_code == 0 or not (tmp_path / "a.ply").exists()
        return result, json.loads(report.read_text()) if report.exists() else None

    return call


@pytest.mark.parametrize(
    ("name", "options", "codes", "volume", "tolerance", "bounds"), MESHES, ids=[row[0] for row in MESHES]
)
def test_meshes(convert, name, options, codes, volume, tolerance, bounds):
    result, report = convert(name, *options.split())
    assert result.exit_code == 0, result.stderr
    assert report["warning_codes"] == codes.split()
    mesh = report["mesh"]
    assert mesh["unit"] == "mm"
    assert mesh["volume"] > 0
    if volume is not None:
        assert mesh["volume"] == pytest.approx(volume, rel=tolerance)
    if bounds is not None:
        spacing = np.array(report["input"]["spacing_mm"])
        assert np.all(np.abs(np.array(mesh["bounds"]) - bounds) < 0.15 * spacing)


@pytest.mark.parametrize(
    ("name", "options", "status", "words"),
    [
        ("tiff_hyperstack/zcyx_imagej.tif", "", 4, "2 volumes found (channel 0 to 1)"),
        ("tiff_hyperstack/tzcyx_imagej.tif", "", 4, "6 volumes found (time 0 to 2; channel 0 to 1)"),
        ("tiff_hyperstack/tyx_imagej.tif", "", 3, "time 40"),
        ("tiff_hyperstack/cyx_imagej.tif", "", 3, "channel 5"),
        ("cine_time/xa_cine.dcm", "", 3, "20 frames are times of one plane (FrameTime)"),
        ("cine_time/us_cine.dcm", "", 3, "20 frames are times of one plane (FrameTimeVector)"),
        ("cine_time/us_cine_regions.dcm", "", 3, "20 frames are times of one plane (FrameTimeVector)"),
        ("cine_time/cbct_multiframe_ct.dcm", "--strict", 4, "W-POSITION-MISSING"),
        ("dicom_gaps/one_missing", "", 4, "1 missing slice found"),
        ("dicom_gaps/second_missing", "", 4, "1 missing slice found"),
        ("dicom_gaps/two_alternate_missing", "", 4, "2 missing slices found"),
        ("dicom_gaps/many_alternate_missing", "", 4, "7 missing slices found"),
        ("dicom_gaps/two_consecutive_pairs", "", 4, "missing slices found: 3.000 mm"),
        ("dicom_two_factors/echo_component", "", 4, "--series 4"),
        ("dicom_two_factors/dwi_directions", "", 4, "--series 7"),
        ("dicom_two_factors/echo_component_unpadded", "--duplicates first", 4, "--series 4"),
        ("dicom_no_position/ct_slicelocation", "", 3, "--slice-order instance, location or filename"),
        ("dicom_no_position/sc_instancenumber", "", 3, "--slice-order instance, location or filename"),
        ("dicom_no_position/ipp_all_zero", "", 3, "--slice-order instance, location or filename"),
        ("dicom_no_position/imagerpixelspacing", "", 3, "--spacing X,Y,Z gives it"),
        ("enhanced_phases/cardiac.dcm", "", 4, "--series 3"),
        ("series_order_real/3000.dcm", "", 4, "--series 13"),
        ("nifti_sform_bogus/sform_nan_qform_good.nii", "", 3, "not finite"),
        ("nifti_sform_bogus/sform_zero_qform_good.nii", "--strict", 4, "W-GEOMETRY-CONTRADICTED"),
        ("nifti_sform_bogus/sform_unit_pixdim_other.nii", "--strict", 4, "W-GEOMETRY-CONTRADICTED"),
        ("npz_nnunet/case_001.npz", "", 4, "2 volumes found"),
        ("nrrd_odd/seg_layers.seg.nrrd", "", 4, "2 volumes found"),
        ("nrrd_odd/nan_direction.nrrd", "", 4, "2 volumes found"),
        ("zarr_units/nounit.zarr", "--strict", 4, "W-UNIT-MISSING"),
        ("zarr_old_versions/v0.3_zyx.zarr", "--strict", 4, "W-SPACING-MISSING"),
        ("png_stack", "--strict", 4, "W-SPACING-MISSING"),
        ("tiff_folder_log/thumbs", "--strict", 4, "W-SPACING-MISSING"),
    ],
)
def test_refusals(convert, name, options, status, words):
    result, report = convert(name, "-i", "0.5", *options.split())
    assert (result.exit_code, report) == (status, None)
    assert words in result.stderr


@pytest.mark.parametrize(
    ("name", "z"),
    [
        ("relative", (-50, -17)),
        ("absolute", (-50, -17)),
        ("relative_negative", (-83, -50)),
    ],
)
def test_doses(convert, name, z):
    result, report = convert(f"rtdose_offsets/{name}.dcm", "-i", "1")
    assert (result.exit_code, report["warning_codes"]) == (0, [])
    affine, slices = np.array(report["input"]["affine"]), report["input"]["shape"][2]
    ends = [affine[2, 3], affine[2, 3] + affine[2, 2] * (slices - 1)]
    assert sorted(ends) == pytest.approx(z)


def test_a_modality_lut_gives_the_values(run):
    for name in ("lut", "lut_and_rescale"):
        result = run("info", case(f"modality_lut/{name}"), "--json")
        assert json.loads(result.stdout)["value_range"] == [95, 4095]


@pytest.mark.slow
def test_real_scans(convert):
    counts = {}
    for name in ("FLAIR.nii.gz", "FLAIR.nrrd"):
        result, report = convert(f"flair_pair_real/{name}", "-i", "60", "--space", "ras", "--force")
        assert (result.exit_code, report["warning_codes"]) == (0, [])
        counts[name] = report["mesh"]["vertices"]
    assert set(counts.values()) == {220204}  # 220206 in EXPECTED.txt
    result, report = convert("nifti_shear_real/shear.nii.gz", "-i", "300", "--border", "closed", "--force")
    assert (result.exit_code, report["warning_codes"]) == (0, [])
    assert report["mesh"]["volume"] == pytest.approx(209213, abs=1)
    assert report["topology"]["components"] == 65


def test_a_mesh_file_with_negative_indices(run):
    result = run("measure", case("measure_obj/three_cubes_negative.obj"), "--json")
    found = json.loads(result.stdout)["mesh"]
    assert (found["vertices"], found["quads"], found["area"]) == (24, 18, 18)
    assert found["volume"] == pytest.approx(3)
