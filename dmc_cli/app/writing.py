"""Write what conversions made: the mesh, the halfedges, the reports."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dmc_cli.app.marked_faces import check_marked, write_marked
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.app.unmet_requirements import device_of, refuse_unmet
from dmc_cli.errors import RequirementError
from dmc_cli.files import check_output, write_output
from dmc_cli.mesh_io import (
    HalfedgeDump,
    MeshFile,
    check_dump_name,
    check_encoding,
    check_space,
    check_unit,
    check_values,
    choose_format,
    grouped,
    write_halfedges,
    write_mesh,
)
from dmc_cli.notices import warning_keys
from dmc_cli.printable import short_number
from dmc_cli.progress import Stopwatch
from dmc_cli.report import measure_memory, report_text
from dmc_cli.settings import ConvertSettings


@dataclass(frozen=True)
class Made:
    """What a conversion is about to write."""

    settings: ConvertSettings
    mesh: MeshFile
    dump: HalfedgeDump | None
    report: dict[str, Any]
    watch: Stopwatch


def check_outputs(settings: ConvertSettings) -> None:
    """Raise DmcError, before any work, if an output has a name or a place that will not do."""
    output = settings.output
    refuse_overlaps([settings])
    name = choose_format(output.path, output.output_format)
    check_encoding(name, ascii=output.ascii, element=output.element)
    check_unit(name, output.unit)
    check_space(name, output.space)
    check_values(name, output.values)
    check_output(output.path, force=output.force)
    check_marked(output.marked, force=output.force)
    if output.halfedges is not None:
        check_dump_name(output.halfedges)
    for path in (output.halfedges, output.report):
        if path is not None:
            check_output(path, force=output.force)


def finish(made: Sequence[Made]) -> None:
    """Check what is required, then write the mesh, in groups where there are several, and the reports.

    A report names what is not met.
    """
    for one in made:
        output, device = one.settings.output, device_of(one.report)
        if not output.dry_run:
            write_marked(output.marked, output.require, one.report, one.mesh, device, force=output.force)
        try:
            refuse_unmet(one.report, output.require, one.mesh, device)
        except RequirementError:
            _write_report(one)
            raise
    if not made[0].settings.output.dry_run:
        _write_files(made)
    for one in made:
        _write_report(one)


def _write_files(made: Sequence[Made]) -> None:
    """Write the mesh, and the halfedges where they are asked for."""
    output = made[0].settings.output
    mesh = made[0].mesh
    if len(made) > 1:
        mesh = grouped({_group_name(one): one.mesh for one in made})
    with made[0].watch.stage("write", "writing"):
        written = write_mesh(
            output.path,
            mesh,
            output_format=output.output_format,
            ascii=output.ascii,
            element=output.element,
            force=output.force,
        )
    for one in made:
        halfedges = one.settings.output.halfedges
        if halfedges is not None and one.dump is not None:
            with one.watch.stage("write", "writing"):
                write_halfedges(halfedges, one.dump, force=output.force)
        for key, told in warning_keys(written.warnings).items():
            one.report[key] += told


def _group_name(made: Made) -> str:
    """Return what a mesh's group is called: by its isovalue, and the words that chose it if there are any."""
    choice = made.report["surface"]["choice"]
    words = f"{choice['chosen']}_" if choice else ""
    isovalue = short_number(made.settings.surface.settled_isovalue)
    return f"isovalue_{words}{isovalue}" if not choice or choice["band"] is None else f"isovalue_{words[:-1]}"


def _write_report(made: Made) -> None:
    """Complete the report, and write it where it was asked for."""
    output, report, watch = made.settings.output, made.report, made.watch
    watch.total()
    report["timings_ms"] = {stage: round(ms, 3) for stage, ms in watch.milliseconds.items()}
    report["memory"] = measure_memory(report["settings"]["device"])
    if output.report is not None:
        write_output(output.report, [report_text(report).encode()], force=output.force)
