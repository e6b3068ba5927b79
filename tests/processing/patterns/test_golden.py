"""Meshes of small volumes after each stage are what they have always been, to the bit.

Numbers that were chosen, a weight or a limit, show nowhere else. The table is printed anew by `python -m
tests.processing.patterns.test_golden`; a change of it is a change of meshes.
"""

import hashlib
import platform

import numpy as np
import pytest

from dmc_cli.mesh.mesh import COLOR, COLOR24
from dmc_cli.processing.remeshing import remesh
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.fields import smooth_noise, volume_of, white_noise
from tests.mesh.meshes import colored, relaxed, simplified

MIRRORED = np.array([[0.5, 0.1, 0, -3], [0, -2, 0, 4], [0.2, 0, 1.25, 7], [0, 0, 0, 1.0]])


def with_holes():
    values = smooth_noise(16, 1.0, seed=3).values.copy()
    values[np.random.default_rng(4).random(values.shape) < 0.02] = np.nan
    return volume_of(values)


def uneven():
    depths = np.cumsum(np.random.default_rng(5).uniform(0.5, 2.0, 16))
    return volume_of(smooth_noise(16, 1.0, seed=6).values, slice_positions=depths - depths[0])


def whole_numbers():
    values = np.random.default_rng(7).integers(0, 5, (14, 14, 14)).astype(np.uint8)
    return volume_of(values, affine=MIRRORED)


VOLUMES = {
    "white": (lambda: white_noise(12, seed=1), {"border": "closed"}),
    "open": (lambda: smooth_noise(16, 1.0, seed=2), {"border": "open"}),
    "holes": (with_holes, {"border": "closed"}),
    "uneven": (uneven, {"border": "closed", "inside": "below"}),
    "whole numbers": (whole_numbers, {"isovalue": 2.0, "border": "closed", "orientation": "gradient"}),
}
KNOWN = {
    "white": {
        "paper": ("e084a92eae03", (114, 1, 316)),
        "safe": ("c6f7077fd483", (116, 312, 0)),
        "relaxed": ("4ac9a6aefef8", ()),
        "more": ("e91fbcd21269", (171,)),
    },
    "open": {
        "paper": ("a656db635b80", (65, 3, 32)),
        "safe": ("798422bde03b", (68, 32, 0)),
        "relaxed": ("662cdd7cf26e", ()),
        "more": ("3590a2a908df", (131,)),
    },
    "holes": {
        "paper": ("b0ea605100e1", (174, 12, 168)),
        "safe": ("717500c79319", (188, 168, 0)),
        "relaxed": ("daa7aa61738e", ()),
        "more": ("d59efbac842b", (378,)),
    },
    "uneven": {
        "paper": ("380b9998b328", (159, 9, 52)),
        "safe": ("cc0a39a42814", (171, 52, 0)),
        "relaxed": ("34bae9116ca5", ()),
        "more": ("cc769c4bcb25", (369,)),
    },
    "whole numbers": {
        "paper": ("29ac3a128928", (168, 2, 488)),
        "safe": ("2badcdc3369e", (173, 480, 1)),
        "relaxed": ("378f64d27ed0", ()),
        "more": ("af89890dcb0b", (194,)),
    },
}


def stages(name):
    """Yield what is left of a volume's mesh after each stage, and what was counted on the way."""
    make, settings = VOLUMES[name]
    mesh, bare = (
        colored(extract_on("cpu", make(), SurfaceSettings(**{"isovalue": 0.0, **settings}), threads=threads))
        for threads in (2, 1)
    )
    paper = simplified(bare, simplify_rules="paper", project=False)
    yield "paper", digest(paper), (*paper.removed_3x3y, paper.removed_3333)
    safe = simplified(mesh)
    yield "safe", digest(safe), (*safe.removed_3x3y, safe.removed_3333, safe.refused)
    yield "relaxed", digest(relaxed(safe, 3)), ()
    more = remesh(safe.mesh, safe.placement, 5)
    yield "more", digest(more), (more.operations,)


def digest(result):
    """Return a hash of vertices, quads, halfedges and colours."""
    halfedges, colors = result.mesh.halfedges, result.mesh.face_values
    found = [halfedges.twin, halfedges.vertex_halfedge, halfedges.valence, colors[COLOR], colors[COLOR24]]
    arrays = [*as_arrays(result).values(), *(array.numpy() for array in found)]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()[:12]


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"),
    reason="the hashes are those of x86-64 with fused multiply-add",
)
@pytest.mark.parametrize("name", VOLUMES)
def test_meshes_are_what_they_have_always_been(name):
    assert {stage: tuple(told) for stage, *told in stages(name)} == KNOWN[name]


if __name__ == "__main__":
    for each in VOLUMES:
        print(f"    {each!r}: { {stage: tuple(told) for stage, *told in stages(each)}!r},")
