"""Put a hand-made mesh on the bench of remeshing, and run one device function at a time on it."""

import numpy as np
import warp as wp

from dmc_cli.mesh.working import MeshArrays
from dmc_cli.processing.remeshing.chains import (
    allowance,
    collapse_cost,
    distance_change,
    link,
    next_rotation,
    rotation_cost,
    scrambled,
)
from dmc_cli.processing.remeshing.checks import (
    PatchMeasures,
    gather_patch,
    irregularity_change,
    is_core_sound,
    is_sound,
    quads_removed,
)
from dmc_cli.processing.remeshing.mend import Limits, Measures, is_better
from dmc_cli.processing.remeshing.operations import collapse_quad, doublet_of, rotate_edge, split_vertex
from dmc_cli.processing.remeshing.sweep import choice, is_worse
from dmc_cli.processing.remeshing.work import (
    CORE,
    FAILED,
    JOURNAL,
    LINKS,
    PATCH,
    PATCHED,
    SPARE_QUAD,
    SPARE_VERTEX,
    TALLIES,
    VALENCE,
    Work,
    begin,
    put,
    redo,
    touch,
    undo,
)
from tests.mesh.hand_made import working

PRICE_OF_WARP = wp.constant(10.0)

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

SPARE = 2
ROTATE, COLLAPSE, SPLIT = 0, 1, 2


class Bench:
    """A shape with room for two vertices and quads more, all in one region, and what became of it."""

    def __init__(self, shape):
        mesh = working(shape).arrays
        self.quads, self.vertices = mesh.twin.shape[0] // 4, mesh.valence.shape[0]
        work = Work()
        work.mesh = MeshArrays()
        for name, size in (("corners", 4), ("twin", 4), ("vertex_halfedge", 1), ("valence", 1)):
            setattr(work.mesh, name, longer(getattr(mesh, name), size * SPARE, -1))
        for name in ("face_gone", "vertex_gone"):
            setattr(work.mesh, name, longer(getattr(mesh, name), SPARE, 1))
        work.vertex_region = wp.zeros(self.vertices + SPARE, dtype=wp.int32)
        work.journal_place = wp.zeros((1, JOURNAL), dtype=wp.int64)
        work.journal_value = wp.zeros((1, JOURNAL), dtype=wp.int32)
        work.core, work.core_valence = (wp.zeros((1, CORE), dtype=wp.int32) for _ in range(2))
        work.patch = wp.zeros((1, PATCH), dtype=wp.int32)
        work.chain, work.tally = wp.zeros((1, LINKS), dtype=wp.int32), wp.zeros((1, TALLIES), dtype=wp.int32)
        work.tally.numpy()[0, [SPARE_VERTEX, SPARE_QUAD]] = self.vertices, self.quads
        self.work = work

    def arrays(self):
        """Copies of what operations change."""
        names = ("corners", "twin", "vertex_halfedge", "valence", "face_gone", "vertex_gone")
        return {name: getattr(self.work.mesh, name).numpy().copy() for name in names}

    def do(self, kind, h, detail=0, spare=SPARE):
        """Return what an operation adds to irregularity, quads that go, if all is sound; None if it fails."""
        told = wp.zeros(4, dtype=wp.int32)
        last = wp.vec2i(self.vertices + spare, self.quads + spare)
        wp.launch(operate_kernel, 1, [self.work, kind, h, detail, last, told], device="cpu")
        done, change, taken, sound = told.numpy().tolist()
        return (change, taken, bool(sound)) if done else None

    def filled(self, entries, vertices):
        """Return 1 for what fails, else 0: `entries` of the journal, one more; `vertices`, one more."""
        told = wp.zeros(4, dtype=wp.int32)
        wp.launch(fill_kernel, 1, [self.work, entries, vertices, told], device="cpu")
        return told.numpy().tolist()

    def patch(self, vertices):
        """Return the quads round vertices, each once, as they are listed, and whether the list is full."""
        told = wp.zeros(1, dtype=wp.int32)
        touched = wp.array(np.array(vertices, dtype=np.int32), dtype=wp.int32)
        wp.launch(patch_kernel, 1, [self.work, touched, told], device="cpu")
        return self.work.patch.numpy()[0, : self.work.tally.numpy()[0, PATCHED]].tolist(), bool(
            told.numpy()[0]
        )

    def costs(self, h):
        """Return what rotations of an edge, either way, and the collapse of a diagonal would cost."""
        told = wp.zeros(3, dtype=wp.int32)
        wp.launch(cost_kernel, 1, [self.work, h, told], device="cpu")
        return told.numpy().tolist()

    def again(self, *, back):
        """Take back what was done, or do it again."""
        wp.launch(again_kernel, 1, [self.work, back], device="cpu")

    def sound(self):
        """For each vertex whether it is sound."""
        told = wp.zeros(self.vertices + SPARE, dtype=wp.int32)
        wp.launch(sound_kernel, len(told), [self.work, told], device="cpu")
        return told.numpy()[self.work.mesh.vertex_gone.numpy() == 0].astype(bool)

    def next_link(self, vertices, chain=(), number=1):
        """Return the halfedge, and whether forward, of the next rotation from touched vertices, or None."""
        told = wp.zeros(1, dtype=wp.int32)
        lists = [wp.array(np.array(v, dtype=np.int32), dtype=wp.int32) for v in (vertices, chain)]
        wp.launch(next_kernel, 1, [self.work, *lists, number, told], device="cpu")
        found = int(told.numpy()[0])
        return None if found < 0 else (found // 2, found % 2 == 1)


def longer(array, more, value):
    host = np.concatenate([array.numpy(), np.full(more, value, array.numpy().dtype)])
    return wp.array(host, dtype=array.dtype, device="cpu")


@wp.kernel
def operate_kernel(
    work: Work, kind: wp.int32, h: wp.int32, detail: wp.int32, last: wp.vec2i, told: wp.array(dtype=wp.int32)
):
    begin(work, 0)
    if kind == ROTATE:
        rotate_edge(work, 0, h, detail == 1)
    elif kind == COLLAPSE:
        collapse_quad(work, 0, h)
    else:
        split_vertex(work, 0, h, detail, last[0], last[1])
    if work.tally[0, FAILED] != 0:
        undo(work, 0)
    else:
        told[0] = 1
        told[1] = irregularity_change(work, 0)
        told[2] = quads_removed(work, 0)
        told[3] = wp.where(is_core_sound(work, 0) and doublet_of(work, 0, CORE - 30) < 0, 1, 0)


@wp.kernel
def fill_kernel(work: Work, entries: wp.int32, vertices: wp.int32, told: wp.array(dtype=wp.int32)):
    begin(work, 0)
    for n in range(entries + 1):
        if n == entries:
            told[0] = work.tally[0, FAILED]
        put(work, 0, VALENCE, 1, n)
    told[1] = work.tally[0, FAILED]
    undo(work, 0)
    begin(work, 0)
    for v in range(vertices + 1):
        if v == vertices:
            told[2] = work.tally[0, FAILED]
        touch(work, 0, v)
        touch(work, 0, v)
    told[3] = work.tally[0, FAILED]


@wp.kernel
def patch_kernel(work: Work, vertices: wp.array(dtype=wp.int32), told: wp.array(dtype=wp.int32)):
    begin(work, 0)
    for n in range(vertices.shape[0]):
        touch(work, 0, vertices[n])
    gather_patch(work, 0)
    gather_patch(work, 0)
    told[0] = work.tally[0, FAILED]


@wp.kernel
def cost_kernel(work: Work, h: wp.int32, told: wp.array(dtype=wp.int32)):
    told[0] = rotation_cost(work, 0, h, False)
    told[1] = rotation_cost(work, 0, h, True)
    told[2] = collapse_cost(work, h)


@wp.kernel
def again_kernel(work: Work, back: wp.bool):
    if back:
        undo(work, 0)
    else:
        redo(work, 0)


@wp.kernel
def sound_kernel(work: Work, told: wp.array(dtype=wp.int32)):
    v = wp.tid()
    if work.mesh.vertex_gone[v] == wp.uint8(0):
        told[v] = wp.where(is_sound(work, v), 1, 0)


@wp.kernel
def next_kernel(
    work: Work,
    vertices: wp.array(dtype=wp.int32),
    chain: wp.array(dtype=wp.int32),
    number: wp.int32,
    told: wp.array(dtype=wp.int32),
):
    begin(work, 0)
    for n in range(vertices.shape[0]):
        touch(work, 0, vertices[n])
    for n in range(chain.shape[0]):
        link(work, 0, chain[n])
    told[0] = next_rotation(work, 0, wp.uint32(number))


@wp.kernel
def worse_kernel(
    after: wp.array2d(dtype=wp.float32),
    before: wp.array2d(dtype=wp.float32),
    budget: wp.float32,
    told: wp.array(dtype=wp.int32),
):
    n = wp.tid()
    told[n] = wp.where(is_worse(patch_of(after, n), patch_of(before, n), budget, PRICE_OF_WARP), 1, 0)


@wp.func
def patch_of(numbers: wp.array2d(dtype=wp.float32), n: wp.int32) -> PatchMeasures:
    patch = PatchMeasures()
    patch.cost = numbers[n, 0]
    patch.least = numbers[n, 1]
    patch.inverted = wp.int32(numbers[n, 2])
    patch.warped = wp.int32(numbers[n, 3])
    patch.warp_excess = wp.int32(numbers[n, 4])
    patch.severe = wp.int32(numbers[n, 5])
    patch.warp_cosine = numbers[n, 6]
    return patch


@wp.func
def ring_of(numbers: wp.array2d(dtype=wp.float32), n: wp.int32) -> Measures:
    ring = Measures()
    ring.patch.least = numbers[n, 0]
    ring.patch.inverted = wp.int32(numbers[n, 1])
    ring.patch.folds = wp.int32(numbers[n, 2])
    ring.height = numbers[n, 3]
    ring.excess = numbers[n, 4]
    ring.patch.warped = wp.int32(numbers[n, 5])
    ring.patch.warp_cosine = numbers[n, 6]
    return ring


@wp.kernel
def better_kernel(
    after: wp.array2d(dtype=wp.float32),
    before: wp.array2d(dtype=wp.float32),
    may_fold: wp.array(dtype=wp.int32),
    told: wp.array(dtype=wp.int32),
):
    n = wp.tid()
    limits = Limits()
    limits.height = 0.35
    limits.warp_cosine = 0.2
    limits.may_fold = may_fold[n]
    told[n] = wp.where(is_better(ring_of(after, n), ring_of(before, n), limits), 1, 0)


@wp.kernel
def chance_kernel(
    numbers: wp.array(dtype=wp.uint32),
    choices: wp.array2d(dtype=wp.int32),
    scrambled_out: wp.array(dtype=wp.uint32),
    allowed: wp.array(dtype=wp.float32),
    changes: wp.array2d(dtype=wp.int32),
):
    n = wp.tid()
    for shift in range(4):
        choices[n, shift] = choice(numbers[n], 8 * shift, 10)
    scrambled_out[n] = scrambled(numbers[n])
    allowed[n] = allowance(2.0, numbers[n])
    for more in range(-1, 2):
        changes[n, more + 1] = distance_change(n, more)
