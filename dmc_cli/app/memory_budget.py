"""Forecast the memory that a conversion needs, before it is taken.

A stage's arrays are counted in bytes per row, word of 32 nodes, listed cell, vertex and face (`Cost`); what a
method takes it declares (`methods.py`). The forecast is that of the largest stage. It is held against the
budget, or against what this process may still take (`memory_limits.py`), as soon as it can be known: the
nodes before values are read, vertices and faces when the method tells them. Python, Warp and its kernels take
some 200 MiB more. `tests/memory` holds it against what runs take.
"""

from dataclasses import dataclass, replace

from dmc_cli.errors import MemoryBudgetError
from dmc_cli.memory_limits import available_memory, total_memory
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io import choose_format
from dmc_cli.methods import Cost, method_named
from dmc_cli.runtime import SPARE_SHARE
from dmc_cli.settings import ConvertSettings, LabelSettings, OutputSettings
from dmc_cli.volume import Volume, available_bytes, mapped_file

MESH = Cost(vertex=12 + 12 + 8, face=16)
"""Position, local coordinates and cell; four corners."""

UNEVEN_SLICES = Cost(vertex=12)
"""Positions with even slices."""

TWINS = Cost(vertex=4 + 4, face=16 + 1)
"""A halfedge and the valence; twins and defect."""

COLORS = Cost(face=2)
MEASURES = Cost(vertex=15)
"""Degrees, starts and valences, what is wrong at a vertex; components take less, and earlier."""

INTERSECTIONS = Cost(face=38)
"""The tree of boxes, its order, and how quads are split; less and earlier what a report measures besides."""

WALLS = Cost(vertex=80, face=24)
"""Of measuring walls, beside the tree: points and directions of rays, and normals of faces, in doubles."""

REPAIRED = INTERSECTIONS + Cost(vertex=16)
"""Of pulling faces apart: finding them, and where vertices were, half of it, since most meshes have none."""

PATTERNS = Cost(vertex=1 + 4, face=2 + 3)
"""What has gone and who may go; lists of quads with a pattern."""

SPARE, SHAPES = Cost(vertex=12 + 8 + 12 + 12), Cost(vertex=12 + 22, face=4 + 1)
"""Of smoothing: all of a vertex with its normal, once more; normals, aims, shapes and flags."""

TRACKED = Cost(vertex=12 + 4 + 2, face=1)
"""Of remeshing: the vertices before it, each with its nearest quad; flags."""

DECIMATED = Cost(vertex=12 + 12 + 8 + 16 + 20, face=1 + 8 + 8 + 36 + 16)
"""Of taking quads away, beside a copy of the mesh without gaps: places and normals of the vertices before it,
and the lists that these and the regions' vertices are sorted in; refusals, what is listed, where all goes,
costs and regions, here and on the host, and the lists that they are sorted in."""

FINE = Cost(vertex=12, face=16)
"""The mesh before quads were taken away, which distances are measured from."""

BOUNDED = FINE + MESH + TWINS + Cost(vertex=4 + 1, face=1)
"""Of a bound on them: that mesh, and a copy to return to, which is the whole mesh at first."""

NORMALS = Cost(vertex=12)
VALUES = Cost(vertex=8, face=4)
"""Of the file: deviation and valence, quality."""

LISTED = Cost(vertex=8)
"""Deviations while they are listed."""

CHECKS = Cost(vertex=5, face=16)
"""Walks round vertices, and comparisons of the halfedges."""

WRITING = Cost(vertex=3)
"""Whether coordinates are finite."""

PAGE_WORDS = 1 << 17
"""Words whose ranks fill a huge page, which is there as a whole if one of them is."""

TEXT_ROW, SPLIT_ROW, ROWS = 240, 800, 1 << 15
"""Bytes of a row of text, or of a face that is split, on its way to a file, in all its stages, and rows that
are on their way together."""


@dataclass(frozen=True)
class Sizes:
    """What there is so far: bytes of values, words of nodes, those near the surface, ..., rows of nodes."""

    values: int
    words: int
    near: int
    cells: int = 0
    vertices: int = 0
    faces: int = 0
    rows: int = 0

    def bytes_of(self, cost: Cost) -> int:
        """Return what the values and a stage take together, with the memory that may be kept beside."""
        counts = (self.rows, self.words, self.near, self.cells, self.vertices, self.faces)
        costs = (cost.row, cost.word, cost.near, cost.cell, cost.vertex, cost.face)
        arrays = sum(count * size for count, size in zip(counts, costs, strict=True))
        return self.values + arrays + arrays // SPARE_SHARE


def stage_costs(settings: ConvertSettings, *, even_slices: bool = True) -> dict[str, Cost]:
    """Return what each stage of a run takes beside the values, everything that is alive then counted in."""
    mesh, output = settings.mesh, settings.output
    method = method_named(settings.surface.method).memory
    surface = MESH if even_slices else MESH + UNEVEN_SLICES
    stages = {"surface": method.cells + method.extracting + surface}
    alive = MESH
    if settings.needs_halfedges:
        colors = COLORS if settings.needs_colors else Cost()
        alive = MESH + TWINS + colors
        stages["halfedges"] = method.connecting + alive
        if mesh.simplify != "none":
            measures = INTERSECTIONS if output.report is not None else MEASURES
            stages["simplify"] = alive + (measures if output.is_measured else PATTERNS)
        if mesh.remesh:
            stages["remesh"] = alive + TRACKED + SHAPES + SPARE + SPARE
        if mesh.first_size is not None:
            stages["size"] = alive + TRACKED + DECIMATED + MESH + TWINS
            if mesh.max_error is not None:
                stages["size"] += BOUNDED + INTERSECTIONS
            elif output.is_measured:
                stages["size"] += FINE
        if mesh.relax:
            spares = SPARE if mesh.relax == 1 else SPARE + SPARE
            stages["relax"] = alive + SHAPES + spares
    if settings.repairs_intersections:
        stages["repair"] = alive + REPAIRED
    if output.has_normals or output.halfedges is not None:
        alive += NORMALS
        stages["normals"] = alive
    if output.values:
        alive += VALUES
        stages["values"] = alive + LISTED
    if output.is_measured:
        has_tree = output.finds_intersections or output.measures_thickness
        walls = WALLS if output.measures_thickness else Cost()
        stages["report"] = alive + (INTERSECTIONS if has_tree else MEASURES) + walls
    if output.check:
        stages["check"] = alive + CHECKS
    stages["write"] = alive + WRITING
    return stages


def forecast(sizes: Sizes, settings: ConvertSettings, *, even_slices: bool = True) -> dict[str, int]:
    """Return the bytes that each stage of a run takes, the values counted in."""
    costs = stage_costs(settings, even_slices=even_slices)
    stages = {stage: sizes.bytes_of(cost) for stage, cost in costs.items()}
    stages["write"] += _row_bytes(settings.output) * min(max(sizes.vertices, sizes.faces), ROWS)
    return stages


def _row_bytes(output: OutputSettings) -> int:
    """Return what a row takes on its way to the file of the mesh, or of its halfedges."""
    if output.dry_run:
        return 0
    mesh_format = FORMATS[choose_format(output.path, output.output_format)]
    if not mesh_format.holds_quads or mesh_format.encoding == "binary":
        return SPLIT_ROW
    is_text = mesh_format.encoding == "text" or output.ascii
    has_text_dump = output.halfedges is not None and not output.halfedges.lower().endswith(".npz")
    return TEXT_ROW if is_text or has_text_dump else 0


def reserve_values(shape: tuple[int, int, int], value_bytes: int, settings: ConvertSettings) -> None:
    """Raise MemoryBudgetError unless a volume fits, before its values are read."""
    free = _free(settings)
    if settings.output.memory is None and free is not None and value_bytes > free // settings.share.jobs:
        raise _too_much(f"the volume needs {_readable(value_bytes)}", free, settings)
    words = words_of(shape, settings)
    sizes = Sizes(value_bytes, words, words, rows=rows_of(shape, settings))
    reserve({"cells": sizes.bytes_of(_cells_cost(settings))}, 0, settings, "the volume and its cells")


def reserve_cells(volume: Volume, settings: ConvertSettings, beside: int = 0) -> None:
    """Raise MemoryBudgetError unless the bits of the volume's nodes and cells fit, so many bytes beside."""
    sizes = sizes_of(volume, settings, beside)
    reserve(
        {"cells": sizes.bytes_of(_cells_cost(settings))},
        held_bytes(volume) + beside,
        settings,
        "the volume and its cells",
    )


def reserve_beside(volume: Volume, more: int, settings: ConvertSettings, what: str) -> None:
    """Raise MemoryBudgetError unless so many bytes fit beside a volume that is there.

    Args:
        volume: The volume as it was read.
        more: Bytes that are to be taken.
        settings: The conversion.
        what: What they are for, in words.
    """
    held = held_bytes(volume)
    reserve({"prepare": held + more}, held, settings, f"the volume and {what}")


@dataclass
class MeshForecast:
    """Holds the forecast for a volume's mesh against the budget as its counts become known.

    `near` and `cells` are the words near the surface and the listed cells, once they are known; `beside` are
    the bytes of a volume that this one was made of, and which is kept.
    """

    volume: Volume
    settings: ConvertSettings
    beside: int = 0
    near: int | None = None
    cells: int = 0

    def hold(self, vertices: int, faces: int, *, near: int | None = None, cells: int | None = None) -> None:
        """Raise MemoryBudgetError unless the mesh fits beside the volume; a method calls it (`Reserve`)."""
        if cells is not None:
            self.near, self.cells = near, cells
        found = sizes_of(self.volume, self.settings, self.beside)
        pages = found.words if self.near is None else -(-self.near // PAGE_WORDS) * PAGE_WORDS
        near = min(pages, found.words)
        sizes = replace(found, near=near, cells=self.cells, vertices=vertices, faces=faces)
        is_even = self.volume.slice_positions is None or self.settings.output.space == "voxel"
        stages = forecast(sizes, self.settings, even_slices=is_even)
        bits = replace(_cells_cost(self.settings), cell=0)
        kind = method_named(self.settings.surface.method).faces
        what = f"the volume and a mesh of {faces} {kind}"
        reserve(stages, sizes.bytes_of(bits), self.settings, what)


def _cells_cost(settings: ConvertSettings) -> Cost:
    """Return what the method keeps of nodes and cells."""
    return method_named(settings.surface.method).memory.cells


def sizes_of(volume: Volume, settings: ConvertSettings, beside: int = 0) -> Sizes:
    """Return the sizes of a volume, with bytes that are kept beside it.

    64-bit integers are counted twice, since they become shorter numbers.
    """
    values = held_bytes(volume) + beside
    if volume.values.dtype.kind in "iu" and volume.values.dtype.itemsize == 8:
        values += volume.values.nbytes // 2
    words = words_of(volume.shape, settings)
    return Sizes(values, words, words, rows=rows_of(volume.shape, settings))


def words_of(shape: tuple[int, int, int], settings: ConvertSettings) -> int:
    """Return the words of a volume's nodes; half of the bits' planes has a layer of zeros on both sides."""
    border = 2 * (settings.surface.border == "closed")
    nx, ny, nz = (n + border for n in shape)
    layer = -(-nx // 32) * ny
    return layer * nz + layer


def rows_of(shape: tuple[int, int, int], settings: ConvertSettings) -> int:
    """Return the rows of a volume's nodes."""
    border = 2 * (settings.surface.border == "closed")
    return (shape[1] + border) * (shape[2] + border)


def held_bytes(volume: Volume) -> int:
    """Return the bytes of a volume's values, none if a file that is mapped holds them."""
    return volume.values.nbytes if mapped_file(volume.values) is None else 0


def reserve(stages: dict[str, int], taken: int, settings: ConvertSettings | LabelSettings, what: str) -> None:
    """Raise MemoryBudgetError unless the largest stage fits; so many bytes of it are taken already."""
    needed, budget, jobs = max(stages.values()), settings.output.memory, settings.share.jobs
    if budget is not None:
        if needed > budget // jobs:
            each = f"{_readable(budget // jobs)} that each of {jobs} jobs has of the " if jobs > 1 else ""
            raise MemoryBudgetError(
                f"{what} need {_readable(needed)}, more than the {each}{_readable(budget)} of --memory; raise"
                f" it, {_fewer(jobs)}or crop or downsample the volume"
            )
        return
    free = _free(settings)
    more = needed - taken if jobs == 1 else needed
    if free is not None and more > free // jobs:
        besides = " more" if more < needed else ""
        raise _too_much(f"{what} need {_readable(more)}{besides}", free, settings)
    present = total_memory()
    if present is not None and needed > present // jobs:
        raise MemoryBudgetError(
            f"{what} need {_readable(needed)}, but this machine has {_readable(present)} of memory"
            f"{_for_each(present, jobs)}; {_fewer(jobs)}crop or downsample the volume, or force it with"
            " --memory"
        )


def _free(settings: ConvertSettings | LabelSettings) -> int | None:
    """Return what can still be had, for all jobs together."""
    return available_bytes() if settings.share.jobs == 1 else settings.share.free


def _too_much(what: str, free: int, settings: ConvertSettings | LabelSettings) -> MemoryBudgetError:
    """Return the error that says what is free, why no more, and what would help."""
    jobs, found = settings.share.jobs, available_memory()
    limit = found.limit if found is not None else ""
    why = f" ({limit})" if limit else ""
    end = "raise that limit" if limit else "end other programs"
    return MemoryBudgetError(
        f"{what}, but {_readable(free)} of memory are free{_for_each(free, jobs)}{why}; {end},"
        f" {_fewer(jobs)}crop or downsample the volume, or force it with --memory"
    )


def _for_each(size: int, jobs: int) -> str:
    """Tell what a job has of memory that several share."""
    return f", {_readable(size // jobs)} for each of {jobs} jobs" if jobs > 1 else ""


def _fewer(jobs: int) -> str:
    """Tell what may help where several jobs share the memory."""
    return "take fewer --jobs, " if jobs > 1 else ""


def _readable(size: int) -> str:
    return f"{size / 2**30:.2f} GiB" if size >= 2**28 else f"{size / 2**20:.1f} MiB"
