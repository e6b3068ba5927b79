"""One scan in every format gives the same mesh in space, where an independent reader says that it lies."""

import nibabel as nib
import numpy as np
import pydicom
import pytest
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
from nibabel.parrec import PARRECHeader
from scipy.spatial import cKDTree

from dmc_cli.app.conversion import convert
from dmc_cli.settings import ConvertSettings, OutputSettings, ReadSettings, SurfaceSettings
from tests.volume_io.afni_files import afni_header
from tests.volume_io.dicom.scanner import make_slice, save
from tests.volume_io.minc_files import hdf, netcdf
from tests.volume_io.par_files import par_header

LPS_OF_RAS = np.diag([-1.0, -1.0, 1.0])
SHAPE = (9, 10, 11)
SPACING = np.array([0.75, 0.5, 2.0])
ORIGIN = np.array([10.0, -20.0, 30.0])
ISOVALUE = 100.5


def solid():
    """A lopsided solid of integer values, well inside the grid."""
    k, j, i = np.indices(SHAPE) - np.array([4, 5, 4]).reshape(3, 1, 1, 1)
    return np.round(300 - 14 * (i**2 + 1.3 * j**2 + k**2 + 0.6 * i * j) + 20 * i).astype("<i2")


VALUES = solid()
OBLIQUE = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
OBLIQUE[:, 2] = np.cross(OBLIQUE[:, 0], OBLIQUE[:, 1])
DIRECTIONS = {
    "axial": np.eye(3),
    "oblique": OBLIQUE,
    "mirrored": np.diag([-1.0, 1.0, 1.0]),
    "oblique-mirrored": OBLIQUE * [1, 1, -1],
    "sagittal": np.eye(3)[:, [1, 2, 0]],
}


def image_of(directions):
    image = sitk.GetImageFromArray(VALUES)
    image.SetDirection(directions.ravel())
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    return image


def as_itk_file(suffix):
    def write(folder, directions):
        sitk.WriteImage(image_of(directions), str(folder / f"scan{suffix}"), True)
        return folder / f"scan{suffix}", {}

    write.__name__ = suffix
    return write


def ras_affine(directions):
    affine = np.eye(4)
    affine[:3, :3] = LPS_OF_RAS @ directions * SPACING
    affine[:3, 3] = LPS_OF_RAS @ ORIGIN
    return affine


def as_nibabel_file(folder, directions):
    nib.save(nib.Nifti1Image(VALUES.T, ras_affine(directions)), folder / "scan.nii")
    return folder / "scan.nii", {}


def as_mgh(folder, directions):
    (folder / "scan.mgh").write_bytes(nib.MGHImage(VALUES.T, ras_affine(directions)).to_bytes())
    return folder / "scan.mgh", {}


def as_minc(folder, directions, write=netcdf):
    """MINC 1; the directions are of the axes x, y, z, and the start is along them."""
    axes = LPS_OF_RAS @ directions
    start = np.linalg.solve(axes, LPS_OF_RAS @ ORIGIN)
    path = folder / f"{write.__name__}.mnc"
    told = {"step": SPACING, "start": start, "cosines": axes.T, "valid_range": (-32768, 32767)}
    return write(path, VALUES, -32768.0, 32767.0, **told), {}


def as_minc_2(folder, directions):
    return as_minc(folder, directions, hdf)


def as_afni(folder, directions):
    places = np.column_stack((directions * SPACING, ORIGIN)).ravel().tolist()
    header = afni_header(SHAPE[::-1], IJK_TO_DICOM_REAL=tuple(places))
    (folder / "scan+orig.HEAD").write_text(header)
    (folder / "scan+orig.BRIK").write_bytes(VALUES.tobytes())
    return folder / "scan+orig.HEAD", {}


def as_dicom(folder, directions):
    orientation = [float(f"{c:.9f}") for c in directions[:, :2].T.ravel()]
    for k in range(SHAPE[0]):
        position = [float(f"{c:.9f}") for c in ORIGIN + directions[:, 2] * SPACING[2] * k]
        dataset = make_slice(position, k, values=VALUES[k] + np.int16(1024), orientation=orientation)
        save(dataset, folder / "scan" / f"{k}.dcm")
    return folder / "scan", {}


WRITERS = [as_itk_file(".nrrd"), as_itk_file(".mha"), as_itk_file(".nii.gz"), as_nibabel_file, as_dicom]
WRITERS += [as_mgh, as_afni, as_minc, as_minc_2]


def mesh_of(path, folder, space, isovalue=ISOVALUE, **read):
    settings = ConvertSettings(
        input=str(path),
        read=ReadSettings(**read),
        surface=SurfaceSettings(isovalue=isovalue, border="closed"),
        output=OutputSettings(
            path=str(folder / "mesh.ply"), space=space, force=True, report=str(folder / "mesh.json")
        ),
    )
    result = convert(settings)
    return result.mesh, result.report


@pytest.mark.parametrize("directions", DIRECTIONS.values(), ids=DIRECTIONS)
@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_the_mesh_lies_where_an_independent_reader_puts_the_grid(tmp_path, write, directions):
    path, read = write(tmp_path, directions)
    image = image_of(directions)
    in_grid, _ = mesh_of(path, tmp_path, "voxel", **read)
    found, report = mesh_of(path, tmp_path, "ras", **read)
    grid = in_grid.points.astype(float)
    if write is as_dicom and np.linalg.det(directions) < 0:
        grid[:, 2] = SHAPE[0] - 1 - grid[:, 2]  # slices are sorted along the normal of their plane
    placed = [image.TransformContinuousIndexToPhysicalPoint(index) for index in grid]
    np.testing.assert_allclose(found.points, np.array(placed) @ LPS_OF_RAS, atol=2e-5)
    assert report["topology"]["components"] == 1
    inside = np.count_nonzero(VALUES > ISOVALUE) * np.prod(SPACING)
    assert report["mesh"]["volume"] == pytest.approx(inside, rel=0.12)  # on so coarse a grid


def test_all_formats_give_one_mesh(tmp_path):
    meshes = {}
    for write in WRITERS:
        folder = tmp_path / write.__name__
        folder.mkdir()
        path, read = write(folder, OBLIQUE)
        meshes[write.__name__] = mesh_of(path, folder, "ras", **read)[0]
    first = meshes[".nrrd"]
    for name, mesh in meshes.items():
        np.testing.assert_array_equal(mesh.faces, first.faces, err_msg=name)
        np.testing.assert_allclose(mesh.points, first.points, atol=2e-5, err_msg=name)
        np.testing.assert_allclose(mesh.normals, first.normals, atol=1e-4, err_msg=name)


def test_ras_and_lps_differ_by_two_signs(tmp_path):
    path, _ = as_nibabel_file(tmp_path, OBLIQUE)
    ras, lps = (mesh_of(path, tmp_path, space)[0] for space in ("ras", "lps"))
    np.testing.assert_array_equal(ras.faces, lps.faces)
    np.testing.assert_array_equal(ras.points @ LPS_OF_RAS.astype(np.float32), lps.points)


def test_a_raw_file_gives_the_mesh_of_the_grid_it_is_told(tmp_path):
    (tmp_path / "scan.raw").write_bytes(VALUES.tobytes())
    told = {"shape": SHAPE[::-1], "dtype": "int16", "spacing": tuple(SPACING), "origin": tuple(ORIGIN)}
    raw, _ = mesh_of(tmp_path / "scan.raw", tmp_path, "native", **told)
    path, _ = as_itk_file(".mha")(tmp_path, np.eye(3))
    meta, _ = mesh_of(path, tmp_path, "native")
    np.testing.assert_array_equal(raw.faces, meta.faces)
    np.testing.assert_array_equal(raw.points, meta.points)


@pytest.mark.parametrize("step", [0, 3], ids=["one-scale", "a-scale-a-slice"])
def test_a_philips_pair_gives_the_mesh_of_its_values_as_nifti(tmp_path, step):
    shifts = 5000 + step * np.arange(SHAPE[0])
    (tmp_path / "scan.REC").write_bytes((VALUES + shifts[:, None, None]).astype("<u2").tobytes())
    header = par_header(SHAPE[::-1], [[[1, -shift] for shift in shifts]], tuple(SPACING))
    (tmp_path / "scan.PAR").write_text(header)
    with (tmp_path / "scan.PAR").open() as file:
        affine = PARRECHeader.from_fileobj(file).get_affine()
    nib.save(nib.Nifti1Image(VALUES.T, affine), tmp_path / "scan.nii")
    one, other = (mesh_of(tmp_path / name, tmp_path, "ras")[0] for name in ("scan.REC", "scan.nii"))
    np.testing.assert_array_equal(one.faces, other.faces)
    np.testing.assert_allclose(one.points, other.points, atol=2e-5)


def test_the_sample_fistula_has_one_mesh_in_both_formats(tmp_path, sample_data):
    pairs = [
        mesh_of(sample_data / name, tmp_path, "lps")
        for name in ("nrrd/fistula_mra.nrrd", "nifti/fistula_mra.nii.gz")
    ]
    (one, first), (other, second) = pairs
    assert first["mesh"]["volume"] > 0
    assert first["mesh"]["volume"] == pytest.approx(second["mesh"]["volume"], rel=1e-4)
    assert first["mesh"]["quads"] == pytest.approx(second["mesh"]["quads"], rel=2e-3)
    np.testing.assert_allclose(first["mesh"]["bounds"], second["mesh"]["bounds"], atol=2e-4)
    distances, _ = cKDTree(other.points).query(one.points)
    assert np.quantile(distances, 0.99) < 2e-3  # the grid's axes are turned, and ties with them


def test_the_vertices_of_a_tilted_uneven_head_lie_between_its_slices(tmp_path, shared_data):
    folder = shared_data / "dicom_ge_tilt"
    datasets = [pydicom.dcmread(path, stop_before_pixels=True) for path in folder.glob("*.dcm")]
    datasets.sort(key=lambda dataset: dataset.ImagePositionPatient[2])
    corners = np.array([dataset.ImagePositionPatient for dataset in datasets], float)
    along_row, along_column = np.array(datasets[0].ImageOrientationPatient, float).reshape(2, 3)
    down, across = (float(spacing) for spacing in datasets[0].PixelSpacing)
    in_grid, _ = mesh_of(folder, tmp_path, "voxel", isovalue=300.0)
    found, _ = mesh_of(folder, tmp_path, "lps", isovalue=300.0)
    i, j, k = in_grid.points.T.astype(float)
    # the closed border's caps lie half a slice outside, as far as the slices beside them are apart
    below = np.clip(np.floor(k).astype(int), 0, len(corners) - 2)
    corner = corners[below] + (k - below)[:, None] * (corners[below + 1] - corners[below])
    expected = corner + np.outer(i, along_row * across) + np.outer(j, along_column * down)
    np.testing.assert_allclose(found.points, expected, atol=3e-3)
    assert np.ptp(np.diff(corners[:, 2])) > 5
