"""Write what was made of labels: the meshes, whose folders are made, and the report."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from dmc_cli.app.label_files import is_template, label_paths
from dmc_cli.app.label_report import require_of_labels
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.errors import RequirementError, SettingsError
from dmc_cli.files import check_output, write_error, write_output
from dmc_cli.mesh_io import MeshFile, choose_format, companion_path, write_mesh
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.progress import Stopwatch
from dmc_cli.report import measure_memory, report_text
from dmc_cli.settings import LabelSettings, OutputSettings
from dmc_cli.volume import Label, Volume


def checked_paths(settings: LabelSettings, volumes: Sequence[Volume], labels: Sequence[Label]) -> list[str]:
    """Return the file of each label, or of all, where nothing is in the way of writing it."""
    output = settings.output
    if settings.conforming:
        if is_template(output.path):
            raise SettingsError(
                f"{output.path} is a template, but a conforming mesh is one file for all labels; name one"
                " file, or leave --conforming out"
            )
        _check_labels_fit(labels)
    paths = [output.path] if settings.conforming else label_paths(output, settings.input, labels)
    distinct = list(dict.fromkeys(paths)) or [output.path]
    first, *others = distinct
    items = [replace(settings, output=replace(output, path=first))]
    items += [replace(settings, output=replace(output, path=path, report=None)) for path in others]
    refuse_overlaps(items, [file for volume in volumes for file in volume.files])
    beside = [companion_path(path, choose_format(path, output.output_format)) for path in distinct]
    has_colors = any(label.color is not None for label in labels)
    more = [path for path in (output.report, *(beside if has_colors else ())) if path is not None]
    for path in (*distinct, *more):
        if Path(path).parent.is_dir() or not is_template(output.path) or path == output.report:
            check_output(path, force=output.force)
    return paths or distinct


def write_files(
    settings: LabelSettings, files: dict[str, MeshFile], report: dict[str, Any], watch: Stopwatch
) -> None:
    """Check what is required, then write the meshes and the report, which names what is not met."""
    output = settings.output
    try:
        require_of_labels(report, output.require)
    except RequirementError:
        _write_report(settings, report, watch)
        raise
    told: list[Notice] = []
    if not output.dry_run:
        with watch.stage("write", "writing"):
            for path, file in files.items():
                _make_folder(path, output)
                written = write_mesh(
                    path,
                    file,
                    output_format=output.output_format,
                    ascii=output.ascii,
                    element=output.element,
                    force=output.force,
                )
                told += [notice for notice in written.warnings if notice not in told]
    for key, sentences in warning_keys(told).items():
        report[key] += sentences
    _write_report(settings, report, watch)


def _check_labels_fit(labels: Sequence[Label]) -> None:
    """Raise SettingsError if a label is too large for the numbers of 32 bits that a mesh's files have."""
    for label in labels:
        if abs(label.number) >= 2**31:
            raise SettingsError(
                f"label {label.number} is beyond 32 bits, in which files hold the labels of faces; leave"
                " --conforming out, or renumber the labels"
            )


def _make_folder(path: str, output: OutputSettings) -> None:
    """Make the folder of a file that a template names, if it is missing.

    Raises:
        WriteError: It cannot be made.
    """
    if is_template(output.path):
        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise write_error(path, error) from error


def _write_report(settings: LabelSettings, report: dict[str, Any], watch: Stopwatch) -> None:
    """Complete the report, and write it where it was asked for."""
    watch.total()
    report["timings_ms"] = {stage: round(ms, 3) for stage, ms in watch.milliseconds.items()}
    report["memory"] = measure_memory(report["settings"]["device"])
    output = settings.output
    if output.report is not None:
        write_output(output.report, [report_text(report).encode()], force=output.force)
