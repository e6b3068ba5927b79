"""Convert a volume to a mesh, stage by stage: the table of contents of the package.

    volume -> surface -> halfedges -> colors -> simplified mesh -> remeshed mesh -> decimated mesh
    -> relaxed mesh -> report -> files

Each stage is one call; its time goes to the report under its name. The volume is read by a thread while
kernels are loaded. Stages that not every run needs are imported where they are called: their kernels cost
as much to import as a small surface to extract.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

from dmc_cli.app.kept_volume import KeptVolume
from dmc_cli.app.memory_budget import MeshForecast, reserve_cells
from dmc_cli.app.mesh_stages import (
    Stages,
    decimate_stages,
    measure_size,
    relax_stages,
    repair_stages,
    simplify_stages,
    size_kernels,
)
from dmc_cli.app.mesh_values import list_values, value_kernels
from dmc_cli.app.no_surface import no_surface
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.app.preparation import Prepared, finds_components, is_settled, prepare, resolved_isovalue
from dmc_cli.app.read_ahead import ReadAhead
from dmc_cli.app.writing import Made, check_outputs, finish
from dmc_cli.contouring import (
    Surface,
    SurfaceCounts,
    color_faces,
    compute_normals,
    connect_faces,
    every_kernel_module,
    extract_surface,
    kernel_modules as surface_kernels,
    label_kernels,
    mesh_kernel_modules,
)
from dmc_cli.errors import DeviceError
from dmc_cli.field import DeviceVolume
from dmc_cli.measures import distance_kernels, kernel_modules as report_kernels, rounding_warnings
from dmc_cli.mesh import COLOR, COLOR24, Mesh, file_of_mesh, refuse_lost
from dmc_cli.mesh_io import (
    HalfedgeDump,
    MeshFile,
)
from dmc_cli.processing import kernel_modules as processing_kernels
from dmc_cli.progress import SILENT, Progress, Stopwatch
from dmc_cli.report import (
    Measures,
    RunFacts,
    build_report,
    collect_versions,
    measure_memory,
    measured_sections,
)
from dmc_cli.runtime import launch_kernels, load_kernels, select_device
from dmc_cli.settings import ConvertSettings, OutputUnit
from dmc_cli.volume import Volume, intact, output_affine, told_as_labels, volume_geometry


@dataclass(frozen=True)
class ConvertResult:
    """What a conversion leaves: the mesh as it was written, and the report."""

    mesh: MeshFile
    report: dict[str, Any]


def convert(
    settings: ConvertSettings,
    progress: Progress = SILENT,
    ahead: ReadAhead | None = None,
    kept: KeptVolume | None = None,
) -> ConvertResult:
    """Turn a volume into a mesh file, as `dmc convert` does.

    Args:
        settings: What to convert, and how.
        progress: Who is told the stages.
        ahead: The reading of the input where it has begun already.
        kept: The volume of the conversion before, of a list that this one is part of.

    Raises:
        DmcError: What went wrong, by class; nothing was written then but a report that was asked for
            together with `require`.
    """
    made = make_mesh(settings, progress, ahead, kept)
    finish([made])
    return ConvertResult(made.mesh, made.report)


def make_mesh(
    settings: ConvertSettings, progress: Progress, ahead: ReadAhead | None, kept: KeptVolume | None
) -> Made:
    """Return all that a conversion writes; nothing is written yet. The arguments are those of `convert`."""
    watch = Stopwatch(progress)
    check_outputs(settings)
    kept = kept or KeptVolume([settings])
    on_device = kept.at_hand(settings)
    if on_device is None:
        ahead = ahead or ReadAhead(settings)
    device = select_device(settings.device, settings.threads)
    if ahead is not None:
        ahead.check()
    with watch.stage("compile", "loading kernels"):
        load_kernels(device, _needed_kernels(settings, indexed=kept.is_shared(settings)), progress)
    if on_device is None:
        assert ahead is not None
        with watch.stage("read", "reading"):
            volume = ahead.result(progress)
        refuse_overlaps([settings], volume.files)
        on_device = kept.keep(settings, volume, device)
    geometry = volume_geometry(on_device.volume) if settings.output.space == "tkr" else None
    with intact(on_device.volume.values, settings.input):
        prepared = _prepared(settings, on_device, kept, watch)
        mesh, dump, report = _stages(prepared, watch)
    if geometry is not None:
        mesh = replace(mesh, geometry=geometry)
    return Made(prepared.settings, mesh, dump, report, watch)


def _prepared(
    settings: ConvertSettings, on_device: DeviceVolume, kept: KeptVolume, watch: Stopwatch
) -> Prepared:
    """Return what is contoured; where the settings leave nothing open it is the volume as it was read."""
    if is_settled(settings):
        return prepare(settings, on_device, kept.suggestions)
    with watch.stage("prepare", "preparing the volume"):
        return prepare(settings, on_device, kept.suggestions)


def _stages(prepared: Prepared, watch: Stopwatch) -> tuple[MeshFile, HalfedgeDump | None, dict[str, Any]]:
    """Return all that is written: the mesh, its halfedges if they are asked for, and the report."""
    settings, volume, device = prepared.settings, prepared.on_device.volume, prepared.on_device.device
    output = settings.output
    affine, space = output_affine(volume, output.space, output.unit)
    reserve_cells(volume, settings, prepared.beside)
    forecast = MeshForecast(volume, settings, prepared.beside)
    with watch.stage("surface", "extracting the surface"):
        surface = extract_surface(
            prepared.on_device,
            settings.surface,
            affine,
            even_slices=output.space == "voxel",
            reserve=forecast.hold,
        )
    if not surface.mesh.face_count and not output.allow_empty:
        otherwise = ", or allow an empty mesh with --allow-empty"
        raise no_surface(volume, settings.surface.settled_isovalue, otherwise=otherwise)
    if settings.needs_halfedges:
        surface = _connect(surface, settings, watch)
    stages, counts = Stages(surface.mesh, surface.placement), surface.counts
    del surface
    if settings.mesh.simplify != "none":
        before = _measure(stages, volume, settings, watch, is_last=False)
        simplify_stages(stages, settings.mesh, watch)
        stages.simplification["before"] = None if before is None else measured_sections(before)
    if settings.mesh.first_size is not None:
        to_mm = stages.to_millimetres(volume)
        decimate_stages(stages, settings.mesh, to_mm, watch, is_measured=output.is_measured)
    if output.halfedges is not None:  # the vertices' colours are those of the cells that they were made in
        from dmc_cli.contouring import color_vertices

        stages.vertex_color = color_vertices(stages.require_placement())
    if settings.mesh.relax:
        relax_stages(stages, settings.mesh.relax, watch)
    if settings.repairs_intersections:
        repair_stages(stages, watch)
    if settings.mesh.is_changed or stages.repair:
        refuse_lost(stages.require_placement().local.numpy())
    measure_size(stages, watch)
    device.let_go()
    normals = None
    if output.has_normals or output.halfedges is not None:
        with watch.stage("normals", "computing normals"):
            normals = compute_normals(stages.require_placement(), settings.surface)
    report = _make_report(prepared, stages, counts, watch)
    device.let_go()
    if output.check:
        from dmc_cli.mesh import check_mesh

        check_mesh(stages.mesh, stages.require_placement(), normals, report, settings)
    written_normals = normals if output.has_normals else None
    mesh = file_of_mesh(
        stages.mesh,
        written_normals,
        space,
        output.unit,
        **list_values(output.values, stages.mesh, stages.placement, volume, watch),
    )
    return mesh, None if output.halfedges is None else _dump(stages, normals, output.unit), report


def compile_kernels(progress: Progress = SILENT) -> None:
    """Compile every kernel for the CPU and, if there is one, for the first GPU."""
    names = {select_device("cpu").name, select_device("auto").name}
    for name in sorted(names):
        load_kernels(select_device(name), every_kernel(), progress)


def load_needed_kernels(
    items: Sequence[ConvertSettings], progress: Progress = SILENT, besides: Sequence[ModuleType] = ()
) -> None:
    """Load, and compile where the cache lacks them, the kernels of several runs at once, and others besides.

    A device that is missing is left to the runs that ask for it.
    """
    needed: dict[str, dict[str, ModuleType]] = {}
    for item in items:
        modules = {module.__name__: module for module in [*_needed_kernels(item), *besides]}
        needed.setdefault(item.device, {}).update(modules)
    for name, found in needed.items():
        with suppress(DeviceError):
            load_kernels(select_device(name), list(found.values()), progress)


def every_kernel() -> list[ModuleType]:
    """Return all modules with kernels, whatever a run needs of them."""
    processing = processing_kernels(simplify=True, relax=True, remesh=True, repair=True, decimate=True)
    every_measure = report_kernels(intersections=True, curvature=True, lists=True, thickness=True)
    every_measure += distance_kernels(proves=True)
    from dmc_cli.parts import kernel_modules as part_kernels

    parts = [*part_kernels(finds=True, reshapes=True, filters=True, labels=True), *label_kernels()]
    return [*launch_kernels(), *every_kernel_module(), *parts, *processing, *every_measure]


def _needed_kernels(settings: ConvertSettings, *, indexed: bool = False) -> list[ModuleType]:
    """Return the modules with kernels that a run needs, alone or as one of several of the same volume."""
    dumped, wanted = settings.output.halfedges is not None, settings.mesh.simplify != "none"
    has_normals = settings.output.has_normals or dumped
    modules = surface_kernels(settings.surface, normals_too=has_normals, indexed=indexed)
    part, finds = settings.part, finds_components(settings)
    finds, reshapes = finds or part.cut_table, part.changes_bits or part.cut_table
    if finds or part.filters:
        from dmc_cli.parts import kernel_modules as part_kernels

        modules += part_kernels(finds=finds, reshapes=reshapes, filters=part.filters)
    if settings.needs_halfedges:
        remeshed, relaxed = settings.mesh.remesh > 0, settings.mesh.relax > 0
        decimated = settings.mesh.first_size is not None
        modules += mesh_kernel_modules(settings.surface.method, colors=settings.needs_colors)
        modules += processing_kernels(simplify=wanted, relax=relaxed, remesh=remeshed, decimate=decimated)
    if settings.mesh.first_size is not None:
        modules += size_kernels(settings.mesh, is_measured=settings.output.is_measured)
    if settings.repairs_intersections:
        from dmc_cli.measures import finding_kernels

        modules += [*processing_kernels(repair=True), *finding_kernels()]
    modules += value_kernels(settings.output.values)
    if settings.output.is_measured:
        output = settings.output
        modules += report_kernels(
            intersections=output.finds_intersections,
            curvature=output.finds_curvature,
            thickness=output.measures_thickness,
        )
    return modules


def _connect(surface: Surface, settings: ConvertSettings, watch: Stopwatch) -> Surface:
    """Return the surface with halfedges, and with colours if a dump or the papers' rules need them."""
    with watch.stage("halfedges", "building the halfedges"):
        surface = connect_faces(surface)
    if settings.needs_colors:
        with watch.stage("coloring", "colouring"):
            surface = color_faces(surface)
    return surface


def _dump(stages: Stages, normals: Any, unit: OutputUnit) -> HalfedgeDump:
    """Return the tables of the halfedge dump."""
    mesh, halfedges = stages.mesh, stages.mesh.require_halfedges()
    return HalfedgeDump(
        vertices=mesh.positions.numpy(),
        normals=normals.numpy(),
        quads=mesh.faces.numpy(),
        twin=halfedges.twin.numpy(),
        vertex_halfedge=halfedges.vertex_halfedge.numpy(),
        vertex_color=stages.vertex_color.numpy(),
        face_color=_host_values(mesh, COLOR),
        face_color24=_host_values(mesh, COLOR24),
        unit=unit,
    )


def _host_values(mesh: Mesh, name: str) -> Any:
    """Return values of faces on the host; None if the mesh has none of that name."""
    return mesh.face_values[name].numpy() if name in mesh.face_values else None


def _measure(
    stages: Stages, volume: Volume, settings: ConvertSettings, watch: Stopwatch, *, is_last: bool = True
) -> Measures | None:
    """Return topology, quality and deviation, if a report, a requirement or a check asks for them.

    What a report does not tell of a mesh before the last one is left out.
    """
    if not settings.output.is_measured:
        return None
    from dmc_cli.report import measure_surface

    with watch.stage("report", "measuring"):
        output = settings.output
        return measure_surface(
            stages.mesh,
            stages.require_placement(),
            volume,
            intersections=output.finds_intersections and (is_last or output.report is not None),
            known_intersections=stages.repair.get("pairs_after"),
            curvature=is_last and output.finds_curvature,
            components=is_last and output.report is not None,
            thickness=is_last and output.measures_thickness,
            wall=output.wall,
        )


def _make_report(
    prepared: Prepared, stages: Stages, counts: SurfaceCounts, watch: Stopwatch
) -> dict[str, Any]:
    """Return the report, with the mesh's measures if they are needed."""
    settings, volume = prepared.settings, prepared.on_device.volume
    measures = _measure(stages, volume, settings, watch)
    device = stages.mesh.device
    facts = RunFacts(
        volume=prepared.source,
        settings=settings,
        resolved={
            "normals": settings.output.has_normals,
            "device": device.name,
            "threads": device.threads,
            **resolved_isovalue(prepared.choice),
        },
        choice=prepared.choice,
        part=prepared.part,
        stored_isovalue=stages.require_placement().frame.stored_isovalue,
        counts=counts,
        vertex_count=stages.mesh.vertex_count,
        quad_count=stages.mesh.face_count - stages.mesh.triangle_count,
        triangle_count=stages.mesh.triangle_count,
        measures=measures,
        warnings=(
            *told_as_labels(prepared.source),
            *stages.warnings,
            *rounding_warnings(stages.mesh, stages.require_placement(), volume),
        ),
        simplification=stages.simplification or None,
        repair=stages.repair or None,
        size=stages.size or None,
        timings_ms=watch.milliseconds,
        memory=measure_memory(device.name),
        versions=collect_versions(device.name),
    )
    return build_report(facts)
