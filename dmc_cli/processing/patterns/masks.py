"""Find the quads that have one of the papers' valence patterns, 32 at a time.

Four valences a quad are gathered from all over memory. In C++, with plain pointers and without a branch, the
compiler makes vector instructions of the loop; these are the only two places of simplification that look at
every quad.
"""

from typing import Any

import warp as wp

from dmc_cli.bits import ANY, VECTOR_FLAGS, WORDS_A_CHUNK, flagged, list_mask, mask_length
from dmc_cli.mesh import MeshArrays, WorkingMesh
from dmc_cli.runtime import native

wp.set_module_options(
    {"enable_backward": False, "fuse_fp": False, "max_unroll": 0, "cpu_compiler_flags": VECTOR_FLAGS}
)


def list_3x3y(mesh: WorkingMesh) -> Any:
    """Return the quads that are there and have the pattern 3-X-3-Y in ascending order, int32."""
    return _listed(mesh, all_three=False)


def list_3333(mesh: WorkingMesh) -> Any:
    """Return the quads that are there and whose vertices all have valence 3 in ascending order, int32."""
    return _listed(mesh, all_three=True)


def _listed(mesh: WorkingMesh, *, all_three: bool) -> Any:
    """Return the quads with one of the patterns."""
    mask = mesh.device.empty(mask_length(mesh.face_count), wp.uint32)
    mesh.device.launch(find_pattern_kernel, mask.shape[0], [mesh.arrays, all_three], [mask], WORDS_A_CHUNK)
    return list_mask(mesh.device, mask)


@wp.func_native(native(__file__, "find_pattern", ALL_THREE=0))
def word_3x3y(
    corners: wp.array(dtype=wp.int32), valence: wp.array(dtype=wp.int32), word: wp.int32, count: wp.int32
) -> wp.uint32:
    """Return a bit for each of the `count` quads from 32 `word` on, 32 at most: whether it has 3-X-3-Y."""
    ...


@wp.func_native(native(__file__, "find_pattern", ALL_THREE=1))
def word_3333(
    corners: wp.array(dtype=wp.int32), valence: wp.array(dtype=wp.int32), word: wp.int32, count: wp.int32
) -> wp.uint32:
    """Return a bit for each of the `count` quads from 32 `word` on, 32 at most: whether it has 3-3-3-3."""
    ...


@wp.kernel
def find_pattern_kernel(
    # In:
    first: wp.int32,
    mesh: MeshArrays,
    all_three: wp.bool,
    # Out:
    mask_out: wp.array(dtype=wp.uint32),
) -> None:
    """Find the quads with the pattern 3-3-3-3, else with 3-X-3-Y. One thread per 32 quads."""
    w = first + wp.tid()
    count = mesh.defect.shape[0] - 32 * w
    word = wp.uint32(0)
    if all_three:
        word = word_3333(mesh.corners, mesh.valence, w, count)
    else:
        word = word_3x3y(mesh.corners, mesh.valence, w, count)
    if word != wp.uint32(0):
        word &= ~flagged(mesh.face_gone, 32 * w, 32, ANY)
    mask_out[w] = word
