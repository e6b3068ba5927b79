"""--space tkr: surfaces lie in FreeSurfer's tkrRAS of their volume, as nibabel has it, and come back."""

import nibabel
import numpy as np
import pytest

from dmc_cli import (
    ConvertSettings,
    OutputSettings,
    ReworkSettings,
    SurfaceSettings,
    convert,
    read_mesh,
    rework_file,
)
from dmc_cli.errors import SettingsError

LIA = np.array([[-1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""Columns: where the axes of FreeSurfer's own volumes point to."""

ORIENTATIONS = {"LIA": LIA, "RAS": np.eye(3), "LAS": np.diag([-1.0, 1, 1])}


def turned(axes):
    """The axes a little askew, as a patient lies."""
    a, b = 0.3, -0.2
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    z = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    return x @ z @ axes


@pytest.fixture(params=ORIENTATIONS)
def image(request, tmp_path):
    """A ball off the centre of a volume of odd sides and uneven spacing, turned, as .mgz."""
    shape, spacing = (21, 26, 17), np.array([1.0, 0.8, 1.5])
    affine = np.eye(4)
    affine[:3, :3] = turned(ORIENTATIONS[request.param]) * spacing
    affine[:3, 3] = [5, -18, 2] - affine[:3, :3] @ (np.array(shape) / 2)
    nodes = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) * spacing
    distance = np.linalg.norm(nodes - np.array([11.0, 9, 12]), axis=-1)
    found = nibabel.MGHImage((6 - distance).astype(np.float32), affine)
    nibabel.save(found, tmp_path / "T1.mgz")
    return nibabel.load(tmp_path / "T1.mgz")


def converted(image, name, space):
    path = image.file_map["image"].filename
    output = OutputSettings(path=path.replace("T1.mgz", name), space=space, normals=False)
    convert(ConvertSettings(input=path, surface=SurfaceSettings(isovalue=0.0), output=output))
    return output.path


def in_tkr(image, points):
    """The places in tkrRAS of points in RAS."""
    header = image.header
    to_tkr = header.get_vox2ras_tkr() @ np.linalg.inv(header.get_vox2ras())
    return nibabel.affines.apply_affine(to_tkr, points)


def signed_volume(points, triangles):
    return np.linalg.det(points[triangles].astype(float)).sum() / 6


@pytest.mark.parametrize("name", ["lh.pial", "lh.surf.gii"])
def test_surfaces_lie_in_the_tkrras_of_nibabel(image, name):
    path, plain = converted(image, name, "tkr"), read_mesh(converted(image, "a.ply", "ras"))
    if name.endswith("gii"):
        points, triangles = (nibabel.load(path).agg_data(kind) for kind in ("pointset", "triangle"))
    else:
        points, triangles = nibabel.freesurfer.read_geometry(path)
    np.testing.assert_allclose(points, in_tkr(image, plain.points), atol=1e-5)
    assert signed_volume(points, triangles) == pytest.approx(4 / 3 * np.pi * 6**3, rel=0.05)
    ours = read_mesh(path)
    assert ours.space == "RAS"
    np.testing.assert_allclose(ours.points, plain.points, atol=1e-5)
    assert signed_volume(ours.points, ours.faces[:, :3]) == pytest.approx(4 / 3 * np.pi * 6**3, rel=0.05)


def test_the_volume_is_told_as_the_header_of_the_volume_has_it(image):
    _, _, told = nibabel.freesurfer.read_geometry(converted(image, "lh.pial", "tkr"), read_metadata=True)
    header = image.header
    assert told["valid"].startswith("1")
    assert told["volume"].tolist() == list(header["dims"][:3])
    np.testing.assert_allclose(told["voxelsize"], header["delta"], rtol=1e-6)
    np.testing.assert_allclose(told["cras"], header["Pxyz_c"], atol=1e-5)
    axes = np.stack([told["xras"], told["yras"], told["zras"]])
    np.testing.assert_allclose(axes, header["Mdc"], atol=1e-6)


def test_gifti_tells_the_volume_and_no_scanner_space(image):
    (points,) = nibabel.load(converted(image, "a.gii", "tkr")).get_arrays_from_intent("pointset")
    assert points.coordsys.dataspace == 0
    header = image.header
    found = [float(points.meta[f"VolGeomC_{axis}"]) for axis in "RAS"]
    np.testing.assert_allclose(found, header["Pxyz_c"], atol=1e-5)
    assert [int(points.meta[f"VolGeom{side}"]) for side in ("Width", "Height", "Depth")] == [21, 26, 17]


@pytest.mark.parametrize("name", ["b.pial", "b.gii"])
def test_a_surface_in_tkrras_stays_so_when_it_is_reworked(image, name):
    path = converted(image, "lh.pial", "tkr")
    copy = path.replace("lh.pial", name)
    rework_file(ReworkSettings(mesh=path, path=copy))
    first, second = read_mesh(path), read_mesh(copy)
    np.testing.assert_allclose(second.points, first.points, atol=1e-5)
    np.testing.assert_array_equal(second.faces, first.faces)
    np.testing.assert_allclose(second.geometry.to_ras, first.geometry.to_ras, atol=1e-12)
    rework_file(ReworkSettings(mesh=path, path=copy, space="ras", force=True))
    assert read_mesh(copy).geometry is None
    np.testing.assert_allclose(read_mesh(copy).points, first.points, atol=1e-5)


def test_formats_that_tell_no_volume_are_refused(image):
    with pytest.raises(
        SettingsError, match=r"PLY files do not tell the volume.*expected one of gii, freesurfer"
    ):
        converted(image, "a.ply", "tkr")


def test_a_volume_without_a_space_is_refused(tmp_path):
    output = OutputSettings(path=str(tmp_path / "a.pial"), space="tkr")
    settings = ConvertSettings(input="synth:sphere:16", surface=SurfaceSettings(isovalue=0.0), output=output)
    with pytest.raises(SettingsError, match="does not say how its axes lie"):
        convert(settings)


def test_axes_that_are_not_at_right_angles_are_refused(tmp_path):
    affine = np.eye(4)
    affine[0, 1] = 0.3
    image = nibabel.Nifti1Image(np.random.default_rng(0).random((9, 9, 9)).astype(np.float32), affine)
    image.set_sform(affine, 1)
    nibabel.save(image, tmp_path / "a.nii")
    output = OutputSettings(path=str(tmp_path / "a.pial"), space="tkr")
    settings = ConvertSettings(
        input=str(tmp_path / "a.nii"), surface=SurfaceSettings(isovalue=0.5), output=output
    )
    with pytest.raises(SettingsError, match="not at right angles"):
        convert(settings)
    assert not (tmp_path / "a.pial").exists()
