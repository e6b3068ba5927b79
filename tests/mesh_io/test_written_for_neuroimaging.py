"""GIfTI and FreeSurfer surfaces are read back by nibabel, and those that it writes by us."""

from dataclasses import replace

import nibabel
import numpy as np
import pytest

from dmc_cli.errors import MeshFileError
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests import shapes


def written(folder, mesh, name, **options):
    path = str(folder / name)
    return path, write_mesh(path, mesh, **options)


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("space", ["RAS", "LPS", "none"])
def test_nibabel_reads_the_same_surface_of_gifti(tmp_path, grid, space, ascii):
    path, told = written(tmp_path, replace(grid, space=space), "lh.surf.gii", ascii=ascii)
    assert [notice.code for notice in told.warnings] == [
        *["W-SPACE-TURNED"] * (space == "LPS"),
        "W-QUADS-SPLIT",
        "W-NORMALS-LEFT-OUT",
    ]
    image = nibabel.load(path)
    points, triangles = image.agg_data("pointset"), image.agg_data("triangle")
    assert (points.dtype, triangles.dtype) == (np.float32, np.int32)
    np.testing.assert_array_equal(
        points, grid.points * np.float32([-1, -1, 1] if space == "LPS" else [1, 1, 1])
    )
    assert len(triangles) == 2 * len(grid.faces)
    ours = read_mesh(path)
    np.testing.assert_array_equal(ours.faces[:, :3], triangles)
    system = image.get_arrays_from_intent("NIFTI_INTENT_POINTSET")[0].coordsys
    assert system.dataspace == (0 if space == "none" else 1)
    np.testing.assert_array_equal(system.xform.reshape(4, 4), np.eye(4))


@pytest.mark.parametrize("space", ["RAS", "LPS", "none"])
@pytest.mark.parametrize("name", ["lh.pial", "rh.white", "lh.inflated", "a.surf"])
def test_nibabel_reads_the_same_surface_of_freesurfer(tmp_path, grid, name, space):
    path, _ = written(tmp_path, replace(grid, space=space), name)
    points, triangles, volume = nibabel.freesurfer.read_geometry(path, read_metadata=True)
    np.testing.assert_array_equal(
        points, grid.points * np.float32([-1, -1, 1] if space == "LPS" else [1, 1, 1])
    )
    np.testing.assert_array_equal(read_mesh(path).faces[:, :3], triangles)
    assert volume["valid"].startswith("0" if space == "none" else "1")
    assert volume["cras"].tolist() == [0, 0, 0]
    assert volume["head"].tolist() == [2, 0, 20]
    assert [volume[axis].tolist() for axis in ("xras", "yras", "zras")] == [[-1, 0, 0], [0, 0, -1], [0, 1, 0]]


def house():
    points, faces = shapes.tetrahedron()
    return points.astype(np.float32), faces[:, :3].astype(np.int32)


@pytest.mark.parametrize("encoding", ["ASCII", "B64BIN", "B64GZ"])
def test_gifti_of_nibabel_is_read(tmp_path, encoding):
    points, faces = house()
    arrays = [
        nibabel.gifti.GiftiDataArray(array, intent=intent, encoding=f"GIFTI_ENCODING_{encoding}")
        for array, intent in ((faces, "triangle"), (points, "pointset"), (points[:, 0], "shape"))
    ]
    nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), tmp_path / "a.gii")
    mesh = read_mesh(tmp_path / "a.gii")
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.faces[:, :3], faces)
    assert mesh.warnings[0].sentence == "a.gii: not read and not used: 1 arrays of values"


def test_gifti_without_a_surface_is_refused(tmp_path):
    array = nibabel.gifti.GiftiDataArray(np.float32([1, 2]), intent="shape")
    nibabel.save(nibabel.gifti.GiftiImage(darrays=[array]), tmp_path / "a.gii")
    with pytest.raises(MeshFileError, match="no array of the intent 1008 was found"):
        read_mesh(tmp_path / "a.gii")
    (tmp_path / "b.gii").write_text("<GIFTI")
    with pytest.raises(MeshFileError, match="nibabel cannot read it"):
        read_mesh(tmp_path / "b.gii")


def test_freesurfer_of_nibabel_is_put_into_ras(tmp_path):
    points, faces = house()
    volume = {
        "head": np.array([2, 0, 20]), "valid": "1  # volume info valid", "filename": "orig.mgz",
        "volume": np.array([256, 256, 256]), "voxelsize": np.ones(3), "xras": np.array([-1.0, 0, 0]),
        "yras": np.array([0, 0, -1.0]), "zras": np.array([0, 1.0, 0]), "cras": np.array([5.0, -18, 2]),
    }  # fmt: skip
    nibabel.freesurfer.write_geometry(tmp_path / "lh.pial", points, faces, volume_info=volume)
    mesh = read_mesh(tmp_path / "lh.pial")
    np.testing.assert_allclose(mesh.points, points + np.array([5, -18, 2]))
    np.testing.assert_array_equal(mesh.faces[:, :3], faces)
    assert mesh.space == "RAS"
    volume |= {"xras": np.array([0, -1.0, 0]), "zras": np.array([1.0, 0, 0])}  # a volume that was turned
    nibabel.freesurfer.write_geometry(tmp_path / "rh.pial", points, faces, volume_info=volume)
    turned = read_mesh(tmp_path / "rh.pial").points - [5, -18, 2]
    np.testing.assert_allclose(turned, np.stack([points[:, 1], points[:, 0], points[:, 2]], axis=1))
    nibabel.freesurfer.write_geometry(tmp_path / "a.surf", points, faces)
    assert read_mesh(tmp_path / "a.surf").space == "none"


@pytest.mark.parametrize(
    ("data", "told"), [(b"solid", "it begins otherwise"), (b"\xff\xff\xfea\n\n" + b"\1" * 8, "cut off")]
)
def test_what_is_no_surface_of_freesurfer_is_refused(tmp_path, data, told):
    (tmp_path / "a.pial").write_bytes(data)
    with pytest.raises(MeshFileError, match=told):
        read_mesh(tmp_path / "a.pial")
