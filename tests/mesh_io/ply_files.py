"""Hand-made files of meshes for the readers' tests, most of them PLY with more in it than a mesh."""

import numpy as np

PLY_HEAD = """ply
format {format} 1.0
comment SPACE=RAS
obj_info made by hand
element vertex 4
property uchar red
property double x
property double y
property double z
element edge 1
property int a
property int b
element face {faces}
property uchar flag
property list uchar uint vertex_index
property float weight
end_header
"""


def binary_ply(order, faces):
    vertices = np.array(
        [(7, i, i + 1, i + 2) for i in range(4)], dtype=[("r", "u1"), *((a, order + "f8") for a in "xyz")]
    )
    body = vertices.tobytes() + np.array([1, 2], dtype=order + "i4").tobytes()
    for face in faces:
        body += bytes([9, len(face)]) + np.array(face, dtype=order + "u4").tobytes()
        body += np.array([0.5], dtype=order + "f4").tobytes()
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    return PLY_HEAD.format(format=name, faces=len(faces)).encode() + body


FACES = [[0, 1, 2], [0, 1, 2, 3], [3, 2, 1, 0], *[[1, 2, 3]] * 300, [0, 2, 3, 1]]


def head(properties="x y z", vertices=1, faces=1):
    """The header of a PLY file in text."""
    lines = [f"element vertex {vertices}", *(f"property float {name}" for name in properties.split())]
    lines += [f"element face {faces}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(["ply", "format ascii 1.0", *lines])


def save(tmp_path, name, text):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
