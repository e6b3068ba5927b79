"""Hypothesis: meshes of quads and triangles, with or without normals, values and a space."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dmc_cli.mesh_io.mesh_file import LABELS, VALUE_TYPES, MeshFile

coordinates = st.floats(allow_nan=False, allow_infinity=False, width=32)
names = st.sampled_from(["quality", "labels", "red", "a_0", "b_1", "c", "c_", "_0", "number", "faces"])


def value(count):
    """A number or a vector an item, of any type; floats may be NaN or infinite."""
    return arrays(st.sampled_from(VALUE_TYPES), st.sampled_from([(count,), (count, 2), (count, 3)]))


@st.composite
def faces_of(draw, vertex_count, most=30):
    """One to so many faces, in any order; a triangle's fourth corner is -1."""
    count = draw(st.integers(1, most))
    faces = draw(arrays(np.int32, (count, 4), elements=st.integers(0, vertex_count - 1)))
    faces[draw(arrays(bool, count)), 3] = -1
    return faces


@st.composite
def mixed_meshes(draw, with_values=False):
    """A mesh of up to 400 vertices."""
    points = np.resize(draw(arrays(np.float32, (7, 3), elements=coordinates)), (draw(st.integers(4, 400)), 3))
    normals = draw(st.none() | st.just(np.roll(points, 1, axis=1)))
    faces = draw(faces_of(len(points)))
    vertex_values, face_values = {}, {}
    if with_values:
        vertex_values = draw(st.dictionaries(names, value(len(points)), max_size=3))
        face_values = draw(st.dictionaries(names, value(len(faces)), max_size=3))
        if draw(st.booleans()):
            face_values[LABELS] = draw(arrays(np.int32, (len(faces), 2)))
    return MeshFile(
        points=points.astype(draw(st.sampled_from(["f4", "f8"]))),
        faces=faces,
        normals=normals,
        space=draw(st.sampled_from(["RAS", "LPS", "none"])),
        vertex_values=vertex_values,
        face_values=face_values,
    )
