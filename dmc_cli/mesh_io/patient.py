"""Give coordinates in the one space that a format has: RAS, in millimetres."""

from collections.abc import Iterator

import numpy as np

from dmc_cli.array_types import Float32Array
from dmc_cli.mesh_io.mesh_file import MeshFile
from dmc_cli.mesh_io.text import chunks_of

LPS_TO_RAS = np.array([-1, -1, 1], np.float32)


def in_ras(mesh: MeshFile) -> Iterator[Float32Array]:
    """Yield the positions in RAS, or as they are where they have no space, in chunks.

    It is half a turn round z: no face is mirrored.
    """
    for points in chunks_of(mesh.points, np.float32):
        yield points * LPS_TO_RAS if mesh.space == "LPS" else points
