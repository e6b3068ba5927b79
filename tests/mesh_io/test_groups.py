"""Parts of a mesh file stay parts: of every format that holds groups, and of files as others write them."""

import contextlib
import json
import locale
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io.grouping import by_sets, unique_names
from dmc_cli.mesh_io.mesh_file import MeshFile, grouped, linear, on_screen
from dmc_cli.mesh_io.numbered import solver_names
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh
from tests.mesh_io.layouts import LAYOUTS
from tests.mesh_io.test_damaged import damage

HOLDING = [(name, ascii) for name, ascii in LAYOUTS if FORMATS[name].holds_groups]
NAMES = st.sampled_from(
    ["skull", "left lung", "3", "Ä b", "a_1", "ungrouped", "mesh", "part_2", 'the "red" one']
)
COLORS = st.none() | st.tuples(*[st.integers(0, 255)] * 3)

NODES = [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (3, 1)]
"""Of a strip of three quads, left to right."""

STRIP = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7)]


@st.composite
def parts(draw):
    """Two to five parts of triangles and quads, each at a place of its own; values tell which it is."""
    found = {}
    for number, name in enumerate(draw(st.lists(NAMES, min_size=2, max_size=5, unique=True))):
        count = draw(st.integers(1, 4))
        points = np.array([[x + 10 * number, y, z] for z in range(count + 1) for x, y in ((0, 0), (1, 2))])
        faces = np.array([[2 * z, 2 * z + 1, 2 * z + 3, 2 * z + 2] for z in range(count)], np.int32)
        faces[draw(st.lists(st.integers(0, count - 1), max_size=2)), 3] = -1
        values = {"part": np.full(count, number, np.int32)}
        found[name] = MeshFile(
            points=points.astype(np.float32), faces=faces, face_values=values, color=draw(COLORS)
        )
    return grouped(found)


def area_by_group(mesh):
    """The area of each group, and where its middle lies, of all faces cut to triangles."""
    found, start = {}, 0
    for name, count in mesh.groups.items():
        faces = mesh.faces[start : start + count]
        quads = faces[faces[:, 3] >= 0]
        corners = mesh.points[np.concatenate([faces[:, :3], quads[:, [0, 2, 3]]])].astype(float)
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        found[name] = (areas.sum() / 2, corners[..., 0].min(), corners[..., 0].max())
        start += count
    return found


@pytest.mark.parametrize(("name", "ascii"), HOLDING)
@given(mesh=parts())
def test_groups_come_back_in_their_order(tmp_path_factory, name, ascii, mesh):
    path = tmp_path_factory.mktemp("groups") / f"mesh{FORMATS[name].suffix}"
    write_mesh(str(path), mesh, ascii=ascii)
    found = read_mesh(path)
    assert solver_names(list(found.groups)) == solver_names(list(mesh.groups))
    expected = list(area_by_group(mesh).values())
    np.testing.assert_allclose(list(area_by_group(found).values()), expected, rtol=1e-5)
    if FORMATS[name].holds_quads:
        assert list(found.groups.values()) == list(mesh.groups.values())
    if FORMATS[name].holds_face_values:
        np.testing.assert_array_equal(
            found.face_values["part"], np.repeat(np.arange(len(mesh.groups)), list(mesh.groups.values()))
        )
    if FORMATS[name].holds_colors:
        colors = dict(zip(found.groups, (mesh.colors.get(group) for group in mesh.groups), strict=True))
        for group, color in colors.items():
            assert color is None or found.colors[group] == color
    else:
        assert not found.colors


@pytest.mark.parametrize(("name", "ascii"), HOLDING)
def test_a_mesh_without_groups_has_none(tmp_path, cube, name, ascii):
    path = tmp_path / f"mesh{FORMATS[name].suffix}"
    color = (255, 16, 0) if FORMATS[name].holds_colors else None
    write_mesh(str(path), replace(cube, color=color, normals=None), ascii=ascii)
    found = read_mesh(path)
    assert (found.groups, found.colors, found.color) == ({}, {}, color)
    assert not found.warnings


@pytest.mark.parametrize(("name", "ascii"), HOLDING)
def test_one_group_of_a_name_that_tells_something_stays(tmp_path, cube, name, ascii):
    path = tmp_path / f"mesh{FORMATS[name].suffix}"
    write_mesh(str(path), replace(cube, groups={"enamel": 6}), ascii=ascii)
    assert list(read_mesh(path).groups) == ["enamel"]


@pytest.mark.parametrize("name", FORMATS)
def test_groups_of_every_format_go_to_every_other_or_are_told(tmp_path, cube, name):
    write_mesh(str(tmp_path / "a.msh"), grouped({"a": cube, "b": cube}))
    written = write_mesh(str(tmp_path / f"b{FORMATS[name].suffix}"), read_mesh(tmp_path / "a.msh"))
    told = [notice.sentence for notice in written.warnings if notice.code == "W-GROUPS-LEFT-OUT"]
    assert bool(told) == (not FORMATS[name].holds_groups)
    assert all(sentence.endswith("left out: a, b") for sentence in told)


def columns(mesh):
    """Where the faces of each group begin, from left to right."""
    starts = np.cumsum([0, *mesh.groups.values()])
    lefts = mesh.points[mesh.faces].min(axis=1)[:, 0].astype(int).tolist()
    spans = zip(mesh.groups, starts[:-1], starts[1:], strict=True)
    return {name: lefts[start:stop] for name, start, stop in spans}


def read(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return read_mesh(path)


def test_faces_of_gmsh_that_alternate_are_sorted_with_their_values(tmp_path):
    nodes = "".join(f"{n} {x} {y} 0\n" for n, (x, y) in enumerate(NODES, 1))
    tags = ("7 1", "4 1", "7 2")
    elements = "".join(
        f"{n} 3 2 {tag} {' '.join(map(str, face))}\n"
        for n, (tag, face) in enumerate(zip(tags, STRIP, strict=True), 1)
    )
    text = (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
        '$PhysicalNames\n2\n1 7 "rim"\n2 7 "outer wall"\n$EndPhysicalNames\n'
        f"$Nodes\n8\n{nodes}$EndNodes\n$Elements\n3\n{elements}$EndElements\n"
        '$ElementData\n1\n"heat"\n1\n0\n3\n0\n1\n3\n1 10\n2 20\n3 30\n$EndElementData\n'
    )
    mesh = read(tmp_path, "a.msh", text)
    assert columns(mesh) == {"surface_4": [1], "outer wall": [0, 2]}
    assert mesh.face_values["heat"].tolist() == [20, 10, 30]
    assert columns(read(tmp_path, "b.msh", text.replace("3 3 2 7 2", "3 3 2 0 2"))) == {
        "surface_4": [1],
        "outer wall": [0],
        "ungrouped": [2],
    }


ENTITIES = {
    "4.1": "$Entities\n1 1 2 0\n1 0 0 0 1 9\n1 0 0 0 1 0 0 1 9 2 1 -1\n",
    "4.0": "$Entities\n1 1 2 0\n1 0 0 0 0 0 0 1 9\n1 0 0 0 1 0 0 1 9 2 1 -1\n",
}
"""A point and a curve of physical group 9, each of its own dimension; then there are two surfaces."""


def gmsh(version):
    """The strip as two surfaces, both of the physical group 5, the left one of 9, too."""
    is_new = version == "4.1"
    points = [f"{x} {y} 0" for x, y in NODES]
    numbers = range(1, 9)
    nodes = (
        "1 8 1 8\n2 1 0 8\n" + "".join(f"{line}\n" for line in (*numbers, *points))
        if is_new
        else "1 8\n1 2 0 8\n" + "".join(f"{n} {line}\n" for n, line in zip(numbers, points, strict=True))
    )
    rows = [f"{n} {' '.join(map(str, face))}\n" for n, face in enumerate(STRIP, 1)]
    heads = ("2 1 3 2", "2 2 3 1") if is_new else ("1 2 3 2", "2 2 3 1")
    counts = "2 3 1 3" if is_new else "2 3"
    return (
        f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n{ENTITIES[version]}"
        f"1 0 0 0 2 1 0 2 5 -9 1 1\n2 2 0 0 3 1 0 1 5 1 1\n$EndEntities\n"
        f'$PhysicalNames\n2\n2 5 "all"\n2 9 "left"\n$EndPhysicalNames\n'
        f"$Nodes\n{nodes}$EndNodes\n$Elements\n{counts}\n{heads[0]}\n{rows[0]}{rows[1]}{heads[1]}\n{rows[2]}$EndElements\n"
    )


@pytest.mark.parametrize("version", ENTITIES)
def test_physical_surfaces_of_gmsh_that_overlap_are_told(tmp_path, version):
    mesh = read(tmp_path, "a.msh", gmsh(version))
    assert columns(mesh) == {"left": [0, 1], "all": [2]}
    assert [(notice.code, notice.sentence) for notice in mesh.warnings] == [
        ("W-GROUPS-OVERLAP", "a.msh: 2 faces are in several groups; each stays in the first of left, all")
    ]


def test_entities_of_gmsh_that_are_more_than_announced_are_refused(tmp_path):
    with pytest.raises(MeshFileError, match=r"\$Entities is damaged: it holds more than it announces"):
        read(tmp_path, "a.msh", gmsh("4.1").replace("$EndEntities", "3\n$EndEntities"))


def abaqus(*more, elset=""):
    nodes = "".join(f"{n}, {x}., {y}., 0.\n" for n, (x, y) in enumerate(NODES, 1))
    elements = "".join(f"{10 * n}, {', '.join(map(str, face))}\n" for n, face in enumerate(STRIP, 1))
    return f"*NODE\n{nodes}*ELEMENT, TYPE=S4{elset}\n{elements}" + "".join(more)


OUTER = "*ELSET, ELSET=Outer, GENERATE\n10, 30, 20\n*Elset, elset=Inner\n20,\n"
OVERLAP = "*ELSET, ELSET=b, GENERATE\n10, 20,10\n*ELSET, ELSET=a\nB, 30\n"
FIRST = {"a": [0], "ungrouped": [1, 2]}


@pytest.mark.parametrize(
    ("more", "groups", "told"),
    [
        (OUTER, {"Outer": [0, 2], "Inner": [1]}, ""),
        ("*ELSET, ELSET=b\n30\n*ELSET, ELSET=a\n10\n", {"b": [2], "a": [0], "ungrouped": [1]}, ""),
        (OVERLAP, {"b": [0, 1], "a": [2]}, "2 faces are in several groups; each stays in the first of b"),
        ("*ELSET, ELSET=a\n10, 99\n", FIRST, "1 elements that are no faces in the sets a"),
        ("*ELSET, ELSET=a, GENERATE\n10, 13\n", FIRST, "3 elements that are no faces in the sets a"),
        ("*ELSET, ELSET=a\n10, lost\n", FIRST, "the set LOST in the set a, which is none"),
        ("*ELSET, ELSET=a\n10, a\n", FIRST, ""),
        ("*ELSET, ELSET=a\n10\n*ELSET, ELSET=_Picked, INTERNAL\n20\n", FIRST, ""),
    ],
)
def test_sets_of_abaqus_are_groups(tmp_path, more, groups, told):
    mesh = read(tmp_path, "a.inp", abaqus(more))
    assert columns(mesh) == groups
    assert len(mesh.warnings) == bool(told)
    assert all(told in notice.sentence for notice in mesh.warnings)


def test_a_set_of_all_elements_comes_after_those_of_some(tmp_path):
    mesh = read(tmp_path, "a.inp", abaqus("*ELSET, ELSET=Right\n30\n", elset=", ELSET=EALL"))
    assert columns(mesh) == {"Right": [2], "EALL": [0, 1]}
    assert [notice.code for notice in mesh.warnings] == ["W-GROUPS-OVERLAP"]


@pytest.mark.parametrize(
    "more",
    [
        "*ELSET\n10\n",
        "*ELSET, ELSET=a\n1.5\n",
        "*ELSET, ELSET=a, GENERATE\n30, 10\n",
        "*ELSET, ELSET=a, GENERATE\n10, 30, -1\n",
        "*ELSET, ELSET=a, GENERATE\n10\n",
    ],
)
def test_sets_that_are_none_are_refused(tmp_path, more):
    with pytest.raises(MeshFileError, match="expected"):
        read(tmp_path, "a.inp", abaqus(more))


def assembly(part):
    """A part and two instances of it, of one of which there is a set."""
    return (
        f"*PART, NAME=P\n{part}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=Near, PART=P\n*END INSTANCE\n"
        "*INSTANCE, NAME=Far, PART=P\n100., 0., 0.\n*END INSTANCE\n"
        "*ELSET, ELSET=Tip, INSTANCE=Far\n30\n*END ASSEMBLY\n"
    )


def test_instances_of_abaqus_are_groups_with_their_sets(tmp_path):
    """Two instances of one part, whose set both have; and one that the assembly takes of one of them."""
    part = abaqus("*ELSET, ELSET=Left\n10\n")
    text = assembly(part)
    assert columns(read(tmp_path, "a.inp", text)) == {
        "Near.Left": [0],
        "Near": [1, 2],
        "Far.Left": [100],
        "Tip": [102],
        "Far": [101],
    }
    plain = text.replace("*ELSET, ELSET=Left\n10\n", "").replace("*ELSET, ELSET=Tip, INSTANCE=Far\n30\n", "")
    assert list(read(tmp_path, "b.inp", plain).groups) == ["Near", "Far"]


def obj(*lines, material=""):
    nodes = "".join(f"v {x} {y} 0\n" for x, y in NODES)
    faces = [f"f {' '.join(map(str, face))}" for face in STRIP]
    words = [line if isinstance(line, str) else faces[line] for line in lines]
    return f"{material}{nodes}" + "\n".join(words) + "\n"


@pytest.mark.parametrize(
    ("lines", "groups"),
    [
        (("g b", 0, "g a", 1, "g b", 2), {"b": [0, 2], "a": [1]}),
        ((0, "g left lung", 1, "g", 2), {"left lung": [1], "ungrouped": [0, 2]}),
        (("o one", 0, "o two", 1, 2), {"one": [0], "two": [1, 2]}),
        (("o one", "g a", 0, "o two", "g b", 1, 2), {"a": [0], "b": [1, 2]}),
        (("usemtl red", 0, 2, "usemtl blue", 1), {"red": [0, 2], "blue": [1]}),
        (("g a", "usemtl red", 0, "usemtl blue", 1, "g b", 2), {"a_red": [0], "a_blue": [1], "b": [2]}),
        (("  g\ta  ", 0, "g b", 1, 2), {"a": [0], "b": [1, 2]}),
        (("g default", 0, 1, 2), {}),
        ((0, 1, 2), {}),
    ],
)
def test_lines_of_an_obj_that_alternate_make_groups(tmp_path, lines, groups):
    mesh = read(tmp_path, "a.obj", obj(*lines))
    assert columns(mesh) == groups
    assert mesh.warnings == ()


def test_materials_of_an_obj_colour_its_groups(tmp_path):
    (tmp_path / "m.mtl").write_text(
        "newmtl red\nKd 1 0 0\nnewmtl blue\n  Kd 0 0.5 1\nmap_Kd a.png\nnewmtl odd\nKd spectral a.rfl\n"
    )
    lines = ("g a", "usemtl red", 0, "g b", "usemtl blue", 1, "g c", "usemtl odd", 2)
    mesh = read(tmp_path, "a.obj", obj(*lines, material="mtllib m.mtl\n"))
    assert mesh.colors == {"a": (255, 0, 0), "b": (0, 128, 255)}
    assert [notice.sentence for notice in mesh.warnings] == ["a.obj: not read and not used: textures"]
    mesh = read(tmp_path, "b.obj", obj(*lines, material="mtllib gone.mtl\n"))
    assert (list(mesh.groups), mesh.colors) == (["a", "b", "c"], {})
    assert mesh.warnings[0].sentence.endswith("materials of gone.mtl, a file that is not there")


@pytest.mark.parametrize("shares", ["0.5 0.5", "1 2 0", "0 -1 0", "0 nan 0", "1 0 0 0", ""])
def test_colours_that_are_none_are_left_out(tmp_path, shares):
    (tmp_path / "m.mtl").write_text(f"newmtl red\nKd {shares}\nnewmtl blue\nKd 0 0 1\n")
    lines = ("g a", "usemtl red", 0, "g b", "usemtl blue", 1, 2)
    assert read(tmp_path, "a.obj", obj(*lines, material="mtllib m.mtl\n")).colors == {"b": (0, 0, 255)}


def test_materials_that_no_face_has_are_not_missed(tmp_path):
    assert read(tmp_path, "a.obj", obj("g a", 0, "g b", 1, 2, material="mtllib gone.mtl\n")).warnings == ()


def test_colours_of_vertices_that_materials_do_not_tell_are_told(tmp_path, cube):
    write_mesh(str(tmp_path / "a.obj"), grouped({"a": replace(cube, color=(1, 2, 3), normals=None)}))
    assert read_mesh(tmp_path / "a.obj").warnings == ()
    lines = (tmp_path / "a.obj").read_text().splitlines(keepends=True)
    first = next(number for number, line in enumerate(lines) if line.startswith("v "))
    lines[first] = "v -1 -1 -1 0.5 0 0\n"
    text = "".join(lines)
    assert read(tmp_path, "b.obj", text).warnings[0].sentence.endswith("not used: colours")


def test_materials_of_one_node_of_a_glb_part_it(tmp_path, cube):
    red, blue = (255, 0, 0), (0, 0, 255)
    write_mesh(
        str(tmp_path / "a.glb"), grouped({"a": replace(cube, color=red), "b": replace(cube, color=blue)})
    )
    data = (tmp_path / "a.glb").read_bytes()
    end = 20 + int.from_bytes(data[12:16], "little")
    document = json.loads(data[20:end])
    document["meshes"][0]["primitives"] += document["meshes"].pop()["primitives"]
    document["nodes"] = [{"name": "head", "mesh": 0}, {"mesh": 0}]
    del document["scenes"], document["scene"]
    document["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = data[:8] + (len(data) + len(text) + 20 - end).to_bytes(4, "little")
    (tmp_path / "b.glb").write_bytes(head + len(text).to_bytes(4, "little") + data[16:20] + text + data[end:])
    mesh = read_mesh(tmp_path / "b.glb")
    assert mesh.groups == {"head_a": 6, "head_b": 6, "a_a": 6, "a_b": 6}
    assert mesh.colors == {"head_a": red, "head_b": blue, "a_a": red, "a_b": blue}
    assert [notice.sentence for notice in mesh.warnings] == ["b.glb: not read and not used: textures"]


def test_properties_of_nastran_are_groups(tmp_path):
    nodes = "".join(f"GRID    {n:8}        {x:8.1f}{y:8.1f}{0:8.1f}\n" for n, (x, y) in enumerate(NODES, 1))
    rows = [
        f"CQUAD4  {n:8}{part:8}{''.join(f'{node:8}' for node in face)}\n"
        for n, (part, face) in enumerate(zip((30, 2, 30), STRIP, strict=True), 1)
    ]
    text = f"BEGIN BULK\n{nodes}{''.join(rows)}ENDDATA\n"
    assert columns(read(tmp_path, "a.nas", text)) == {"property_2": [1], "property_30": [0, 2]}
    named = read(tmp_path, "b.nas", f"$ property 30: bone\n{text}")
    assert columns(named) == {"property_2": [1], "bone": [0, 2]}
    bare = text.replace(f"{2:8}{2:8}", f"{2:8}{'':8}")
    mesh = read(tmp_path, "c.nas", bare)
    assert (len(mesh.faces), mesh.groups) == (3, {})
    assert mesh.warnings[0].sentence.endswith("numbers of parts, which some elements lack")


def test_parts_of_ls_dyna_are_groups(tmp_path):
    nodes = "".join(f"{n:8}{x:16.1f}{y:16.1f}{0:16.1f}\n" for n, (x, y) in enumerate(NODES, 1))
    shells = "".join(
        "".join(f"{number:8}" for number in (n, part, *face)) + "\n"
        for n, (part, face) in enumerate(zip((3, 1, 3), STRIP, strict=True), 1)
    )
    parts = (
        "*PART\n$ title\nouter wall\n         3         1         1\nlid\n         9\n*PART\nodd\nno number\n"
    )
    text = f"*KEYWORD\n{parts}*NODE\n{nodes}*ELEMENT_SHELL\n{shells}*END\n"
    assert columns(read(tmp_path, "a.k", text)) == {"part_1": [1], "outer wall": [0, 2]}


def test_references_of_medit_are_groups(tmp_path):
    nodes = "".join(f"{x} {y} 0 0\n" for x, y in NODES)
    faces = "".join(f"{' '.join(map(str, face))} {n}\n" for n, face in zip((5, 0, 5), STRIP, strict=True))
    text = f"MeshVersionFormatted 1\nDimension 3\nVertices\n8\n{nodes}Quadrilaterals\n3\n{faces}End\n"
    assert columns(read(tmp_path, "a.mesh", text)) == {"reference_5": [0, 2], "ungrouped": [1]}
    assert read(tmp_path, "b.mesh", text.replace(" 5\n", " 0\n")).groups == {}


WHOLE = {
    "a.inp": assembly(abaqus("*ELSET, ELSET=b, GENERATE\n10, 30, 10\n*ELSET, ELSET=c\nb, 20\n")),
    "new.msh": gmsh("4.1"),
    "old.msh": gmsh("4.0"),
    "a.obj": obj("g a", "usemtl red", 0, "o b", 1, "g c", "usemtl d", 2, material="mtllib a.obj\n"),
}


@pytest.mark.parametrize("name", WHOLE)
@given(data=st.data())
def test_damaged_groups_give_a_message_or_a_mesh(tmp_path_factory, name, data):
    found = WHOLE[name].encode()
    for _ in range(data.draw(st.integers(1, 3))):
        found = data.draw(damage(found)) or b"x"
    path = tmp_path_factory.mktemp("damaged") / name
    path.write_bytes(found)
    with contextlib.suppress(MeshFileError, UnsupportedFormatError):
        mesh = read_mesh(path)
        assert sum(mesh.groups.values()) in (0, len(mesh.faces))


def test_the_first_of_several_sets_counts_but_one_of_all():
    found = by_sets("a", 4, {"all": np.arange(4), "b": np.array([1, 2]), "a": np.array([2, 2, 3])})
    assert (list(found.names), found.numbers.tolist()) == (["b", "a", "all"], [2, 0, 0, 1])
    assert "4 faces are in several groups" not in found.notices[0].sentence
    assert by_sets("a", 2, {"a": np.array([0])}).notices == ()


def test_equal_names_are_told_apart():
    assert unique_names(["a", "a_2", "a", "a", "b"]) == ["a", "a_2", "a_3", "a_4", "b"]


@given(color=st.tuples(*[st.integers(0, 255)] * 3))
def test_light_comes_back_as_the_colour_of_a_screen(color):
    assert on_screen(linear(color)) == color
    assert on_screen([2.0, 0, 0]) is None


@pytest.mark.parametrize(("name", "ascii"), HOLDING)
def test_names_come_back_where_a_library_has_set_the_locale(tmp_path, name, ascii):
    one = MeshFile(
        points=np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), faces=np.int32([[0, 1, 2, 3]])
    )
    path, before = tmp_path / f"mesh{FORMATS[name].suffix}", locale.setlocale(locale.LC_CTYPE)
    names = ["Ä b", "skull"]
    try:
        locale.setlocale(locale.LC_CTYPE, "C")
        write_mesh(str(path), grouped(dict.fromkeys(names, one)), ascii=ascii)
        found = read_mesh(path)
    finally:
        locale.setlocale(locale.LC_CTYPE, before)
    assert solver_names(list(found.groups)) == solver_names(names)
