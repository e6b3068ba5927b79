"""Faces that are to blame where a mesh is not as required."""

import numpy as np
import pytest

from dmc_cli.app.measurement import measure_mesh
from dmc_cli.app.unmet_requirements import refuse_unmet
from dmc_cli.errors import RequirementError
from dmc_cli.measures import list_elements
from dmc_cli.mesh import connect, mesh_of_file
from dmc_cli.mesh_io import MeshFile, read_mesh, write_mesh
from dmc_cli.report.blamed_faces import blamed_faces
from dmc_cli.report.requirements import MOST_FACES
from dmc_cli.requirements import MEASURE_FIGURES, parse_requirement
from dmc_cli.runtime.device import Device
from tests import shapes

DEVICE = Device("cpu", 1)


def file_of(mesh, drop=()):
    """A mesh of `tests.shapes` as a file's, without some of its faces."""
    points, faces = mesh[0], np.asarray(mesh[1], np.int32)
    return MeshFile(points=np.asarray(points, np.float32), faces=np.delete(faces, list(drop), axis=0))


def blamed(file, text):
    """The numbers of the faces to blame; None if none can be."""
    mask = blamed_faces(connect(mesh_of_file(file, DEVICE)), parse_requirement(text, MEASURE_FIGURES))
    return None if mask is None else np.flatnonzero(mask).tolist()


def verdicts(file, *required, **measured):
    """The verdicts in the report on a mesh, met or not."""
    report = measure_mesh(DEVICE, file, **measured)
    try:
        refuse_unmet(report, required, file, DEVICE)
    except RequirementError as error:
        assert error.report is report
    return report["requirements"]


def crossing():
    return shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (0.5, 0.5, 0.5)))


def far(count):
    return shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (9.0, 0.0, 0.0)))


def test_faces_beside_a_hole_are_to_blame_that_a_mesh_is_open():
    assert blamed(file_of(shapes.cube()), "closed") == []
    found = blamed(file_of(shapes.cube(), drop=[0]), "closed")
    assert len(found) == 4  # all but the one opposite


def test_faces_that_intersect_are_to_blame():
    file = file_of(crossing())
    found = blamed(file, "no-self-intersections")
    assert len(found) == 6
    assert found == blamed(file, "self_intersections<=0") == blamed(file, "self_intersections=0")


def test_triangles_are_to_blame():
    file = file_of(shapes.house())
    assert blamed(file, "all-quads") == np.flatnonzero(file.faces[:, 3] < 0).tolist() != []


def test_smaller_components_are_to_blame_for_their_number():
    file = file_of(shapes.joined(shapes.cube(), shapes.moved(shapes.cube(), (9.0, 0.0, 0.0))), drop=[1])
    assert blamed(file, "components<=1") == [0, 1, 2, 3, 4]  # of the open cube
    assert blamed(file, "components<2") == [0, 1, 2, 3, 4]
    assert blamed(file, "components<=2") == []
    assert blamed(file, "components>=3") is None


def test_faces_at_an_edge_of_three_and_at_a_vertex_of_two_fans_are_to_blame():
    cube = shapes.cube()
    points = np.asarray(cube[0], np.float32)
    faces = np.asarray(cube[1], np.int32)
    fin = [*faces[0, :2][::-1], len(points), len(points) + 1]
    file = MeshFile(
        points=np.vstack([points, [[5, 5, 5], [5, 6, 5]]]).astype(np.float32),
        faces=np.vstack([faces, [fin]]).astype(np.int32),
    )
    neighbour = next(n for n in range(1, 6) if {*faces[0, :2].tolist()} <= {*faces[n].tolist()})
    assert {0, neighbour, 6} <= set(blamed(file, "manifold"))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("text", "name", "worst"),
    [
        ("shape_min>=0.7", "shape", np.less),
        ("min_angle>=50", "min_angle", np.less),
        ("max_angle<120", "max_angle", np.greater_equal),
        ("warpage_max<=20", "warpage", np.greater),
        ("aspect_ratio_max<=1.4", "aspect_ratio", np.greater),
    ],
)
def test_faces_beyond_a_limit_are_to_blame(text, name, worst, seed):
    random = np.random.default_rng(seed)
    count = 40
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    points = (
        corners + random.normal(0, 0.2, (count, 4, 3)) + [[[9 * n, 0, 0]] for n in range(count)]
    ).reshape(-1, 3)
    file = MeshFile(
        points=points.astype(np.float32), faces=np.arange(4 * count, dtype=np.int32).reshape(-1, 4)
    )
    values = list_elements(mesh_of_file(file, DEVICE))[name]
    limit = parse_requirement(text, MEASURE_FIGURES).limit
    expected = np.flatnonzero(worst(values, limit)).tolist()
    assert blamed(file, text) == expected
    assert 0 < len(expected) < count


def test_no_face_is_to_blame_for_what_is_of_the_whole():
    file = file_of(shapes.cube())
    for text in ("on-surface", "area<=1", "genus=1", "shape_mean>=1", "quads>=7", "shape_min<=0.1"):
        assert blamed(file, text) is None


def test_limits_of_triangles_do_not_count_where_there_are_none():
    (found,) = verdicts(file_of(shapes.cube()), "fe")
    assert (found["require"], found["found"], found["met"]) == ("fe", 0, True)
    assert len(found["parts"]) == 5
    assert not any("triangle" in part["require"] for part in found["parts"])
    (found,) = verdicts(file_of(shapes.house()), "fe")
    assert len(found["parts"]) == 7


def test_a_sheared_box_is_none_for_finite_elements():
    points = np.asarray(shapes.cube()[0], np.float64)
    points[:, 0] += 3 * points[:, 1]
    (found,) = verdicts(file_of((points, shapes.cube()[1])), "fe")
    unmet = [part["require"] for part in found["parts"] if not part["met"]]
    assert unmet[:2] == ["min_angle>=25", "max_angle<=155"]  # 18.4 and 161.6 degrees
    assert found["found"] == len(unmet)
    assert found["face_count"] == len(found["faces"]) == 2  # those that lie in the plane of the shear


def test_what_is_to_be_printed_is_one_closed_piece_unless_told():
    (found,) = verdicts(file_of(shapes.cube()), "print")
    assert [part["require"] for part in found["parts"]] == [
        *("closed", "manifold", "no-self-intersections", "components<=1")
    ]
    assert found["met"]
    two = file_of(far(2))
    (found,) = verdicts(two, "print")
    assert (found["found"], found["met"], found["face_count"]) == (1, False, 6)
    assert [one["met"] for one in verdicts(two, "print", "components<=2")] == [True, True]
    assert [one["met"] for one in verdicts(two, "components<=1", "print")] == [False, True]


def test_walls_that_were_measured_against_a_length_are_part_of_print():
    cube = file_of(shapes.cube())
    size = float(np.ptp(cube.points[:, 0]))
    for wall, met in ((0.5 * size, True), (2 * size, False)):
        (found,) = verdicts(cube, "print", thickness=True, wall=wall)
        assert found["parts"][-1]["require"] == f"thickness.min>={wall:.12g}"
        assert found["met"] is met


def test_the_first_faces_are_named_and_all_are_counted():
    count = 2 * MOST_FACES
    points = np.zeros((4 * count, 3), np.float32)
    points[:, 0], points[:, 1] = np.arange(4 * count), np.tile([0, 0, 1, 1], count)
    file = MeshFile(points=points, faces=np.arange(4 * count, dtype=np.int32).reshape(-1, 4))
    (found,) = verdicts(file, "closed")
    assert (found["face_count"], found["faces"]) == (count, list(range(MOST_FACES)))


@pytest.mark.parametrize("suffix", [".ply", ".vtp"])
def test_faces_are_marked_by_how_much_they_are_to_blame_for(run, tmp_path, suffix):
    path, marked = tmp_path / "two.ply", tmp_path / f"marked{suffix}"
    write_mesh(str(path), file_of(far(2), drop=[1]))
    words = ("measure", path, "--require", "closed,components<=1", "--marked", marked)
    assert run(*words).exit_code == 6
    found = read_mesh(str(marked))
    unmet = found.face_values["unmet"]
    assert unmet.tolist()[5:] == [0] * 6  # the closed one
    assert sorted(unmet.tolist()[:5]) == [1, 2, 2, 2, 2]  # of another component, and beside the hole
    assert run(*words).exit_code == 9
    assert run(*words, "--force").exit_code == 6
    assert run("measure", path, "--require", "components<=2", "--marked", marked, "--force").exit_code == 0
    assert not read_mesh(str(marked)).face_values["unmet"].any()


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("--require", "closed", "--marked", "a.obj"), 2),
        (("--require", "closed", "--marked", "two.ply", "--force"), 2),
        (("--require", "closed", "--marked", "-"), 2),
        (("--marked", "a.ply"), 2),
        (("--require", "closed", "--marked", "no/a.ply"), 9),
    ],
)
def test_marks_need_a_requirement_a_place_and_a_format(run, tmp_path, monkeypatch, words, status):
    monkeypatch.chdir(tmp_path)
    write_mesh("two.ply", file_of(far(2)))
    before = (tmp_path / "two.ply").read_bytes()
    result = run("measure", "two.ply", *words)
    assert (result.exit_code, result.stdout) == (status, "")
    assert [path.name for path in tmp_path.iterdir()] == ["two.ply"]
    assert (tmp_path / "two.ply").read_bytes() == before
