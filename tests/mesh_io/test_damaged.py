"""Files of ours that something has happened to: a mesh or a message, nothing else, and no warning."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import MeshFileError, UnsupportedFormatError
from dmc_cli.mesh_formats import FORMATS, function
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.read import read_mesh
from tests import shapes
from tests.mesh_io.layouts import LAYOUTS

WORDS = (
    "nan", "inf", "-1", "0", "2.5", "3", "4", "1e39", "1e300", "9" * 30, "list", "uchar", "double",
    "property", "element", "face", "vertex", "x", "a_0", "f", "v", "//", "OFF", "comment",
    "end_header\n", "\n", "\xff",
)  # fmt: skip


def content(name, ascii):
    """The bytes of a small mixed mesh with all that a file may have."""
    points, faces = shapes.house()
    mesh = MeshFile(
        points=points.astype(np.float32),
        faces=faces,
        normals=points.astype(np.float32),
        space="RAS",
        vertex_values={"a": points, "b": points[:, 0].astype(np.int16)},
        face_values={"labels": faces[:, :2].copy(), "c": faces[:, 0].astype(np.uint8)},
        groups={"left lung": 2, "b": len(faces) - 2},
        colors={"b": (255, 16, 0)},
    )
    return b"".join(function(FORMATS[name].encode)(mesh, ascii=ascii))


@st.composite
def damage(draw, data):
    """The bytes with a word replaced, a line repeated, a byte changed, some left out or the end cut off."""
    place = draw(st.integers(0, len(data) - 1))
    match draw(st.sampled_from(["word", "line", "byte", "gap", "end"])):
        case "word":
            words = data.split(b" ")
            words[place % len(words)] = draw(st.sampled_from(WORDS)).encode("latin-1")
            return b" ".join(words)
        case "line":
            lines = data.split(b"\n")
            lines.insert(draw(st.integers(0, len(lines))), lines[place % len(lines)])
            return b"\n".join(lines)
        case "byte":
            return data[:place] + bytes([draw(st.integers(0, 255))]) + data[place + 1 :]
        case "gap":
            return data[:place] + data[place + draw(st.integers(1, 30)) :]
    return data[:place]


@pytest.mark.parametrize(("name", "ascii"), LAYOUTS)
@given(data=st.data())
def test_damage_gives_a_message_or_a_mesh(tmp_path_factory, name, ascii, data):
    found = content(name, ascii)
    for _ in range(data.draw(st.integers(1, 3))):
        found = data.draw(damage(found)) or b"x"
    path = tmp_path_factory.mktemp("damaged") / f"mesh{FORMATS[name].suffix}"
    path.write_bytes(found)
    with contextlib.suppress(MeshFileError, UnsupportedFormatError):
        mesh = read_mesh(path)
        assert np.isfinite(mesh.points.astype(np.float32)).all()
