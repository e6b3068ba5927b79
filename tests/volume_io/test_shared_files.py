"""Every file beside the checkout is read as an independent library reads it, or differs for a reason given.

A difference that is not listed fails, and so does a listed one that is none, and a file that nobody compares.
"""

import numpy as np
import pytest

from dmc_cli.errors import VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.conftest import ROOT
from tests.volume_io.independent import (
    Found,
    planes_with_pydicom,
    scaled,
    with_itk,
    with_nibabel,
    with_numpy,
    with_parts,
    with_pynrrd,
    with_slices,
    with_tifffile,
    with_zarr,
)
from tests.volume_io.reading import lps_affine, physical, read

SHARED = ROOT.parent / "shared"

READERS = {
    with_pynrrd: ("*_bz2.nrrd", "mini-*.nrrd"),
    with_parts: ("raw_headsq_slices/quarter.nhdr",),
    with_itk: (
        "nifti_zero_dim/*.nii",
        "nifti_sform_bogus/sform_zero*.nii",
        "*.nrrd",
        "*.nhdr",
        "*.mha",
        "*.mhd",
    ),
    with_nibabel: ("*.nii", "*.nii.gz", "*.hdr.gz"),
    with_numpy: ("*.npy", "*.npz"),
    with_tifffile: ("tiff_hyperstack/*.tif",),
    with_slices: ("tiff_folder_log/*", "cases/png_stack"),
    with_zarr: ("*.zarr",),
    planes_with_pydicom: (
        *("dicom_ge_tilt", "dicom_mr_pd_axial", "dicom_nonimage_mix", "dicom_compressed_4slices/*"),
        *("dicom_emri_syntaxes/*", "dicom_enhanced_*/*", "dicom_vhf_head.zip", "cases/dicom_*/*"),
        *("modality_lut/*", "cine_time/*", "enhanced_phases/*", "rtdose_offsets/*", "series_order_real/*"),
    ),
}
"""Independent readers, and the inputs that are theirs: the ends of their paths, files and folders.

The first reader counts.
"""

RAW = {
    "data/raw_engine/engine_256x256x110_uint8.raw": (256, 256, 110),
    "data/raw_microct_bone/trabecular_crop_128x128x128_uint8.raw": (128, 128, 128),
}
"""Files without a header, of uint8."""

NO_INPUT = (
    *("README*", "SOURCE.txt", "EXPECTED.txt", "LICENSE", "licences/*", "*.obj"),
    *("*.img.gz", "*.raw", "*.raw.gz", "*.ascii", "quarter.[0-9]*", "nrrd_odd/scan.AIM"),  # of headers
)
"""What lies beside the volumes."""

NO_Z = "no axis is z"
TIMES = "its frames are times of one plane"
NO_PLACE = "no position tells an order: it is to be told by --slice-order"
REFUSED = {
    **{f"cases/cine_time/{n}.dcm": TIMES for n in ("us_cine", "us_cine_regions", "xa_cine")},
    **{f"cases/tiff_hyperstack/{n}_imagej.tif": NO_Z for n in ("cyx", "tyx")},
    "cases/nifti_sform_bogus/sform_nan_qform_good.nii": "a sform that is not finite is damaged",
    "data/dicom_compressed_4slices/failing_missing_slice": "slices are missing",
    "data/dicom_emri_syntaxes/emri_small_jpeg_2k_lossless_too_short.dcm": "it is cut short",
    "data/nifti_mni_endian/not-nifti.nii": "it is no NIfTI",
    **{
        f"cases/dicom_gaps/{n}": "slices are missing"
        for n in (
            *("many_alternate_missing", "one_missing", "second_missing", "two_alternate_missing"),
            "two_consecutive_pairs",
        )
    },
    **{
        f"cases/dicom_no_position/{n}": NO_PLACE
        for n in ("ct_slicelocation", "imagerpixelspacing", "ipp_all_zero", "sc_instancenumber")
    },
}
"""Inputs that are refused, each with its reason."""

DIFFERENT = {
    "data/analyze_mni/avg152T1.hdr.gz": (
        ["affine of 0"],
        "programs disagree on the orientation of Analyze: it is told as missing, not guessed",
    ),
    "data/dicom_nonimage_mix": (
        ["2 planes left"],
        "two single images of other series are left out, and told",
    ),
}
"""Inputs that are read otherwise than by the independent library: what differs, and why."""


def reader_of(path):
    if any(path.match(kind) for kind in NO_INPUT):
        return None
    return next((r for r, kinds in READERS.items() if any(path.match(kind) for kind in kinds)), None)


def inputs_of(folder):
    """Return the inputs below a folder, and the files that are none and belong to none."""
    inputs, others = [], []
    for path in sorted(folder.iterdir()):
        if reader_of(path) or name_of(path) in RAW:
            inputs.append(path)
        elif path.is_dir():
            found = inputs_of(path)
            inputs += found[0]
            others += found[1]
        elif not any(path.match(kind) for kind in NO_INPUT):
            others.append(path)
    return inputs, others


def all_inputs():
    if not SHARED.is_dir():
        return [pytest.param(None, marks=pytest.mark.skip(f"{SHARED} is not on this machine"))], []
    found = [inputs_of(SHARED / name) for name in ("data", "cases")]
    inputs = [path for part, _ in found for path in part]
    return [_param(path) for path in inputs], [path for _, part in found for path in part]


def _param(path):
    files = [path] if path.is_file() else path.iterdir()
    is_large = sum(file.stat().st_size for file in files) > 1_500_000
    return pytest.param(name_of(path), marks=[pytest.mark.slow] if is_large else [])


def name_of(path):
    return path.relative_to(SHARED).as_posix()


INPUTS, FORGOTTEN = all_inputs()


def test_no_file_is_forgotten():
    assert FORGOTTEN == []
    names = {param.values[0] for param in INPUTS}
    assert not names or names == {None} or not (set(REFUSED) | set(DIFFERENT)) - names


@pytest.mark.parametrize("name", INPUTS)
def test_a_file_is_read_as_an_independent_library_reads_it(name):
    path = SHARED / name
    if name in REFUSED:
        with pytest.raises(VolumeError):
            ours_of(path)
        return
    assert list(differences(path)) == DIFFERENT.get(name, ([],))[0]


def ours_of(path):
    """Return all volumes of an input, in the order in which they are listed."""
    if (shape := RAW.get(name_of(path))) is not None:
        return [read(path, shape=shape, dtype="uint8", spacing=(1.0, 1.0, 1.0))]
    volumes = []
    for entry in list_volumes(str(path), ReadSettings()):
        series = str(entry.number) if reader_of(path) is planes_with_pydicom else None
        for index in range(max(len(entry.volumes), 1)):
            volumes.append(read(path, series=series, volume_index=index if entry.volumes else None))
    return volumes


def differences(path):
    """Yield in a word each what differs between our volumes and those of an independent library."""
    ours, reader = ours_of(path), reader_of(path)
    if reader is planes_with_pydicom:
        yield from plane_differences(ours, path)
        return
    theirs = raw(path) if reader is None else list(reader(path))
    if len(ours) != len(theirs):
        yield f"{len(ours)} volumes, not {len(theirs)}"
        return
    for number, (our, their) in enumerate(zip(ours, theirs, strict=True)):
        if our.values.shape != their.values.shape:
            yield f"shape of {number}: {our.shape}"
        elif not np.allclose(physical(our), their.values, rtol=1e-6, atol=0, equal_nan=True):
            yield f"values of {number}"
        step = np.linalg.norm(their.affine[:3, :3], axis=0).min()
        if not np.allclose(lps_affine(our), their.affine, rtol=1e-6, atol=1e-5 * step):
            yield f"affine of {number}"


def raw(path):
    x, y, z = RAW[name_of(path)]
    return [Found(np.fromfile(path, np.uint8).reshape(z, y, x), scaled((1, 1, 1)))]


def plane_differences(ours, path):
    left = list(planes_with_pydicom(path))
    for number, volume in enumerate(ours):
        affine = lps_affine(volume)
        step = np.linalg.norm(affine[:3, 2])
        for k, values in enumerate(volume.values):
            slice_values = volume.slope * values.astype(np.float64) + volume.intercept
            place = affine[:3, 3] + affine[:3, 2] * (
                k if volume.slice_positions is None else volume.slice_positions[k] / step
            )
            edges, tolerance = None if volume.space == "none" else affine[:3, :2].T, 0.02 * step
            fitting = [n for n, p in enumerate(left) if plane_fits(p, slice_values, place, edges, tolerance)]
            if not fitting:
                yield f"slice {k} of {number}"
            for n in fitting[:1]:
                del left[n]
    if left:
        yield f"{len(left)} planes left"


def plane_fits(plane, values, place, edges, tolerance):
    """Return whether a DICOM plane has these values, and lies there if it lies anywhere."""
    if (plane.corner is None) != (edges is None) or plane.values.shape != values.shape:
        return False
    if edges is not None:
        lengths = np.array(values.shape[::-1])[:, None]
        apart = [plane.corner - place, *((plane.edges - edges) * lengths)]
        if np.abs(apart).max() > tolerance:
            return False
    return np.allclose(plane.values, values, rtol=1e-6, atol=1e-9)
