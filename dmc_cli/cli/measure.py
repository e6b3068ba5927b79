"""Measure a mesh file's topology, quality and deviation: `dmc measure`."""

from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.isovalue import missing_isovalue
from dmc_cli.cli.parameters import complete_files
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import measure_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.errors import RequirementError
from dmc_cli.printable import json_text
from dmc_cli.settings import MeasureSettings, ReadSettings


@click.command(cls=SectionedCommand)
@click.argument("mesh", shell_complete=complete_files)
@options.setting(
    MeasureSettings,
    "volume",
    section="Deviation",
    metavar="INPUT",
    shell_complete=complete_files,
    help="The volume that the mesh is an isosurface of; anything that `dmc convert` reads.",
)
@options.setting(
    MeasureSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Deviation",
    type=float,
    help="The level of the isosurface, in the volume's physical values.",
)
@options.setting(
    MeasureSettings,
    "inside",
    section="Deviation",
    help="The side that was the object, if the border was closed.",
)
@options.setting(
    MeasureSettings,
    "curvature",
    section="Curvature",
    is_flag=True,
    help="Measure the mean and the Gaussian curvature at the vertices.",
)
@options.setting(
    MeasureSettings,
    "thickness",
    section="Thickness",
    is_flag=True,
    help="Measure how thick the walls are, by rays from the vertices inward.",
)
@options.wall_option(MeasureSettings, "Thickness")
@options.setting(
    MeasureSettings,
    "against",
    section="Distance",
    metavar="MESH",
    shell_complete=complete_files,
    help="Another mesh; the distance is measured both ways.",
)
@options.setting(
    MeasureSettings,
    "density",
    section="Distance",
    type=float,
    metavar="N",
    help="Samples on a unit of area; without it, 250000 on the mesh with the larger area.",
)
@options.require_option(MeasureSettings, "End with status 6 unless the mesh is")
@options.marked_option(MeasureSettings)
@options.force_option
@options.read_options
@options.noise_options
@options.json_option
@options.device_option
@options.threads_option
@options.verbosity_options
def measure(as_json: bool, quiet: bool, verbose: int, **values: Any) -> None:
    """Measure the mesh file MESH: topology, quality, how far it is from an isosurface or another mesh.

    MESH holds quads or triangles, in a format that convert writes or one of meshio such as .med or .vol.

    \b
    Examples:
      dmc convert sample_data/nrrd/tooth.nrrd tooth.ply -i 500
      dmc measure tooth.ply
      dmc measure tooth.ply --volume sample_data/nrrd/tooth.nrrd -i 500 --json
      dmc convert sample_data/nrrd/tooth.nrrd coarse.ply -i 500 --simplify all
      dmc measure coarse.ply --against tooth.ply
      dmc measure tooth.ply --wall 1.5
    """
    read = options.gather(ReadSettings, values)
    settings = options.gather(MeasureSettings, values, read=read)
    if settings.volume is not None and settings.isovalue is None:
        raise missing_isovalue(settings.volume, read)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import measure_file
        failure = None
        try:
            report = measure_file(settings, progress)
        except RequirementError as error:
            report, failure = error.report, error
    if as_json:
        click.echo(json_text(report, indent=2))
    else:
        echo_lines(measure_lines(report))
    if failure is not None:
        raise failure
