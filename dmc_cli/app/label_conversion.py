"""Convert a label map to the surfaces of its labels: closed shells, or one mesh that they share.

volume -> labels -> part -> conforming net -> smooth net -> shells -> report -> files
"""

import math
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np

from dmc_cli.app.label_choice import Layer, choose_labels, read_layers
from dmc_cli.app.label_files import group_names, is_template
from dmc_cli.app.label_parts import take_part
from dmc_cli.app.label_report import LabelSurface, label_report, node_size
from dmc_cli.app.label_surfaces import (
    LabelMesh,
    Shell,
    corner_normals,
    list_shells,
    make_label_mesh,
    patch_volumes,
)
from dmc_cli.app.label_writing import checked_paths, write_files
from dmc_cli.app.memory_budget import held_bytes, reserve
from dmc_cli.array_types import Float64Array
from dmc_cli.contouring import label_kernels
from dmc_cli.errors import DeviceError, EmptySurfaceError, SettingsError
from dmc_cli.measures import finding_kernels, kernel_modules
from dmc_cli.mesh_formats import FORMATS
from dmc_cli.mesh_io import (
    LABELS,
    MeshFile,
    check_encoding,
    check_space,
    check_unit,
    choose_format,
    grouped,
)
from dmc_cli.progress import SILENT, Progress, Stopwatch
from dmc_cli.runtime import Device, load_kernels, select_device
from dmc_cli.settings import LabelSettings
from dmc_cli.volume import (
    Label,
    Space,
    Volume,
    forecasting,
    intact,
    output_affine,
    volume_geometry,
)

NODE_BYTES = 2 + 2
"""Bytes a node beside its value: its code; bits of crossed edges and active cells, and their ranks."""

QUAD_BYTES = 460
"""Bytes a quad with the vertex that there is for each: the net with its links, smoothing, shells, files."""


SIZE_BYTES = 900
"""Bytes a quad while its shell is given a size, beside those."""


@dataclass(frozen=True)
class LabelResult:
    """What a conversion of labels leaves: the meshes as they were written, by their files, and the report."""

    meshes: dict[str, MeshFile]
    report: dict[str, Any]


@dataclass(frozen=True)
class OutputFrame:
    """The output's coordinates, by the map from node indices, (4, 4), and their axes; where the work is done.

    `counts_slices` where they count slices, whatever the distances of these.
    """

    affine: Float64Array
    space: Space
    device: Device
    counts_slices: bool

    def to_millimetres(self, volume: Volume) -> Float64Array:
        """Return the map from differences of coordinates to millimetres, shape (3, 3).

        Raises:
            SettingsError: There is none.
        """
        from dmc_cli.app.fine_mesh import to_millimetres

        return to_millimetres(self.affine, volume, has_depths=not self.counts_slices)


def convert_labels(settings: LabelSettings, progress: Progress = SILENT) -> LabelResult:
    """Turn labels of a label map into mesh files, as `dmc convert --labels` does.

    Args:
        settings: Which labels of what, and where to.
        progress: Who is told the stages.

    Raises:
        DmcError: What went wrong, by class; nothing was written then but a report that was asked for
            together with `require`.
    """
    watch = Stopwatch(progress)
    output = settings.output
    name = choose_format(output.path, output.output_format)
    check_encoding(name, ascii=output.ascii, element=output.element)
    check_unit(name, output.unit)
    check_space(name, output.space)
    device = select_device(settings.device, settings.threads)
    with watch.stage("compile", "loading kernels"):
        load_kernels(device, _needed_kernels(settings), progress)
    with (
        watch.stage("read", "reading"),
        forecasting(lambda shape, size: _reserve_nodes(shape, size, settings)),
    ):
        volumes = read_layers(settings, progress)
    with ExitStack() as open_files:
        for volume in volumes:
            open_files.enter_context(intact(volume.values, settings.input))
        return _convert(settings, volumes, device, watch)


def load_label_kernels(items: Sequence[LabelSettings], progress: Progress = SILENT) -> None:
    """Load, and compile where the cache lacks them, the kernels of several runs at once.

    A device that is missing is left to the runs that ask for it.
    """
    for name in sorted({item.device for item in items}):
        asking = [item for item in items if item.device == name]
        needed = {module.__name__: module for item in asking for module in _needed_kernels(item)}
        with suppress(DeviceError):
            load_kernels(select_device(name), list(needed.values()), progress)


def _convert(
    settings: LabelSettings, volumes: Sequence[Volume], device: Device, watch: Stopwatch
) -> LabelResult:
    """Make the surfaces of the labels of a volume, or of several layers, and write them."""
    layers, told = choose_labels(settings, volumes)
    labels = [label for layer in layers for label in layer.labels]
    if not labels and not settings.output.allow_empty:
        raise EmptySurfaceError(
            f"{settings.input} has no label: every node is background (0); check that the right file was"
            " read, or allow an empty mesh with --allow-empty"
        )
    _check_layers(settings, layers)
    if not settings.part.is_whole:
        with watch.stage("prepare", "taking the part"):
            part = take_part(settings, layers, device)
        layers, told = part.layers, (*told, *part.notices)
        labels = [label for layer in layers for label in layer.labels]
    paths = checked_paths(settings, volumes, labels)
    affine, space = output_affine(layers[0].volume, settings.output.space, settings.output.unit)
    frame = OutputFrame(affine, space, device, counts_slices=settings.output.space == "voxel")
    geometry = volume_geometry(volumes[0]) if settings.output.space == "tkr" else None
    meshes, surfaces = [], []
    for layer in layers:
        if not layer.labels and len(layers) > 1:
            continue
        mesh = _layer_mesh(settings, layer, affine, device, watch)
        meshes.append(mesh)
        surfaces += [
            _surface_of(settings, layer, n, shell, frame, watch)
            for n, shell in enumerate(list_shells(mesh, len(layer.labels)))
        ]
    if settings.mesh.first_size is not None:
        from dmc_cli.app.label_sizes import tell_of_gaps

        told = (*told, *tell_of_gaps(meshes), *(notice for surface in surfaces for notice in surface.notices))
    files = _files(settings, meshes, surfaces, paths, space)
    if geometry is not None:
        files = {path: replace(file, geometry=geometry) for path, file in files.items()}
    report = label_report(settings, volumes[0], surfaces, meshes, paths, told, device, watch)
    write_files(settings, files, report, watch)
    return LabelResult(files, report)


def _layer_mesh(
    settings: LabelSettings, layer: Layer, affine: Float64Array, device: Device, watch: Stopwatch
) -> LabelMesh:
    """Return the mesh of a layer's labels."""
    return make_label_mesh(
        layer.volume,
        layer.stored,
        affine,
        device,
        watch,
        even_slices=settings.output.space == "voxel",
        reserve=lambda quads: _reserve_mesh(layer.volume, quads, settings),
    )


def _check_layers(settings: LabelSettings, layers: Sequence[Layer]) -> None:
    """Raise SettingsError if a mesh is to be shared by labels of several layers, which may overlap."""
    used = [layer for layer in layers if layer.labels]
    if not settings.conforming or len(used) < 2:
        return
    told = "; ".join(", ".join(str(label.number) for label in layer.labels) for layer in used)
    raise SettingsError(
        f"the labels of {settings.input} lie in {len(used)} layers, and may overlap: {told}; a conforming"
        " mesh needs those of one; choose them with --labels, or leave --conforming out"
    )


def _files(
    settings: LabelSettings,
    meshes: Sequence[LabelMesh],
    surfaces: Sequence[LabelSurface],
    paths: Sequence[str],
    space: Space,
) -> dict[str, MeshFile]:
    """Return what each file holds: the mesh that all share, one shell, or all shells as groups."""
    labels = [surface.label for surface in surfaces]
    if settings.conforming:
        return {paths[0]: _conforming(settings, meshes[0], labels, space)}
    if len(set(paths)) == len(surfaces):
        return {path: surface.file for path, surface in zip(paths, surfaces, strict=True)}
    if surfaces:
        names = group_names(labels)
        return {paths[0]: grouped({n: s.file for n, s in zip(names, surfaces, strict=True)})}
    if is_template(paths[0]):
        return {}
    nothing = np.zeros((0, 3), np.float32), np.zeros((0, 4), np.int32)
    return {paths[0]: MeshFile(points=nothing[0], faces=nothing[1], space=space, unit=settings.output.unit)}


def _needed_kernels(settings: LabelSettings) -> list[ModuleType]:
    """Return the modules with kernels that a run needs."""
    modules, part = label_kernels() + finding_kernels(), settings.part
    if not part.is_whole:
        from dmc_cli.parts import kernel_modules as part_kernels

        filters = part.resample is not None
        modules += part_kernels(
            labels=part.selects, finds=part.selects, reshapes=part.changes_bits, filters=filters
        )
    is_measured = settings.output.is_measured
    if settings.mesh.first_size is not None:
        from dmc_cli.app.mesh_stages import size_kernels
        from dmc_cli.mesh import connecting_kernels
        from dmc_cli.processing import kernel_modules as processing_kernels

        modules += connecting_kernels() + processing_kernels(decimate=True, repair=True)
        modules += size_kernels(settings.mesh, is_measured=is_measured)
    return modules + kernel_modules(intersections=False) if is_measured else modules


def _surface_of(
    settings: LabelSettings, layer: Layer, n: int, shell: Shell, frame: OutputFrame, watch: Stopwatch
) -> LabelSurface:
    """Return the shell of the layer's label number `n` as a file has it, of the size that is asked for."""
    output, label = settings.output, layer.labels[n]
    resized = None
    if settings.mesh.first_size is not None:
        from dmc_cli.app.label_sizes import resize_shell

        resized = resize_shell(
            shell, label, settings, frame.to_millimetres(layer.volume), frame.device, watch
        )
        shell = resized.shell
    file = MeshFile(
        points=shell.points,
        faces=shell.faces,
        normals=corner_normals(shell) if output.has_normals and not settings.conforming else None,
        space=frame.space,
        unit=output.unit,
        color=label.color,
    )
    node_volume, count = node_size(layer.volume, frame.affine, output.space), int(layer.counts[n])
    return LabelSurface(
        label=label,
        nodes=count,
        file=file,
        node_volume=None if node_volume is None else count * node_volume,
        volume=float(patch_volumes(shell.points, shell.faces).sum()),
        part=layer.parts[n] if layer.parts else None,
        size=resized.size if resized else None,
        repair=resized.repair if resized else None,
        notices=resized.notices if resized else (),
    )


def _conforming(settings: LabelSettings, mesh: LabelMesh, labels: Sequence[Label], space: Space) -> MeshFile:
    """Return the mesh that all labels share, with the labels of its faces, in groups where there may be."""
    output = settings.output
    numbers = np.array([0, *[label.number for label in labels]], np.int64).astype(np.int32)
    known = FORMATS[choose_format(output.path, output.output_format)]
    faces, sides = mesh.faces, mesh.sides
    groups: dict[str, int] = {}
    if known.holds_groups:
        order = np.lexsort((sides[:, 1], sides[:, 0]))
        faces, sides = np.ascontiguousarray(faces[order]), sides[order]
        pairs, pair_counts = np.unique(sides, axis=0, return_counts=True)
        names = ["background", *group_names(labels)]
        groups = {
            f"{names[a]}--{names[b]}": int(count)
            for (a, b), count in zip(pairs.tolist(), pair_counts.tolist(), strict=True)
        }
    has_values = known.holds_face_values or not known.holds_groups
    return MeshFile(
        points=mesh.points,
        faces=faces,
        space=space,
        unit=output.unit,
        face_values={LABELS: numbers[sides]} if has_values else {},
        groups=groups,
    )


def _reserve_nodes(shape: tuple[int, int, int], size: int, settings: LabelSettings) -> None:
    """Raise MemoryBudgetError unless a label map fits, before its values are read."""
    needed = size + NODE_BYTES * math.prod(n + 2 for n in shape)
    reserve({"codes": needed}, 0, settings, "the label map and its codes")


def _reserve_mesh(volume: Volume, quads: int, settings: LabelSettings) -> None:
    """Raise MemoryBudgetError unless a mesh of so many quads fits beside the label map."""
    taken = held_bytes(volume) + NODE_BYTES * math.prod(n + 2 for n in volume.shape)
    more = SIZE_BYTES if settings.mesh.first_size is not None else 0
    stages = {"surface": taken + (QUAD_BYTES + more) * quads}
    reserve(stages, taken, settings, f"the label map and a mesh of {quads} quads")
