"""Rework a mesh file: parts, formats, units, and relaxation on its volume: `dmc mesh`."""

from typing import Any, get_args

import click

from dmc_cli import mesh_formats
from dmc_cli.cli import options
from dmc_cli.cli.isovalue import missing_isovalue
from dmc_cli.cli.parameters import ChoiceList, Components, complete_files
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import rework_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.settings import MeshSettings, MeshValue, ReadSettings, ReworkSettings


@click.command(cls=SectionedCommand)
@click.argument("mesh", metavar="IN", shell_complete=complete_files)
@click.argument("path", metavar="OUT", shell_complete=complete_files)
@options.setting(
    ReworkSettings,
    "keep",
    section="Parts",
    type=Components(),
    help="Keep the component with most faces, or the N with most.",
)
@options.setting(
    ReworkSettings,
    "min_faces",
    section="Parts",
    type=int,
    metavar="N",
    help="Drop components with fewer faces.",
)
@options.setting(
    ReworkSettings, "flip", section="Parts", is_flag=True, help="Turn all faces, and normals, round."
)
@options.mesh_options
@options.setting(
    ReworkSettings,
    "volume",
    section="Surface",
    metavar="INPUT",
    shell_complete=complete_files,
    help="The volume that the mesh is an isosurface of, for what keeps it there, normals and the deviation.",
)
@options.setting(
    ReworkSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Surface",
    type=float,
    help="The level of the isosurface, in the volume's physical values.",
)
@options.setting(
    ReworkSettings,
    "inside",
    section="Surface",
    help="The side that was the object, if the border was closed.",
)
@options.read_options
@options.noise_options
@options.setting(
    ReworkSettings,
    "output_format",
    section="Output",
    type=click.Choice(tuple(mesh_formats.FORMATS)),
    help=f"The format, where the suffix ({', '.join(mesh_formats.known_suffixes())}) does not tell.",
)
@options.setting(
    ReworkSettings,
    "normals",
    "--normals/--no-normals",
    section="Output",
    is_flag=True,
    help="Vertex normals: of the volume, of a mesh that changed without one its own, else the file's; without"
    " a word where there is a place for them.",
)
@options.setting(
    ReworkSettings,
    "space",
    section="Output",
    help="Axes of the coordinates: the mesh's, RAS or LPS.",
)
@options.setting(
    ReworkSettings, "unit", section="Output", help="Unit of the coordinates; the mesh's without it."
)
@options.setting(
    ReworkSettings, "ascii", section="Output", is_flag=True, help="Text where the format could be binary."
)
@options.setting(
    ReworkSettings,
    "values",
    section="Output",
    type=ChoiceList(get_args(MeshValue)),
    again=ChoiceList.again,
    help=f"Values in the file, of each vertex or face: {', '.join(get_args(MeshValue))}.",
)
@options.setting(
    ReworkSettings,
    "element",
    section="Output",
    help="What a quad is in an Abaqus file: a shell (S4R by default), a membrane, a surface, rigid.",
)
@options.setting(
    ReworkSettings,
    "report",
    section="Output",
    metavar="FILE",
    shell_complete=complete_files,
    help="Write a JSON report; - is standard output.",
)
@options.wall_option(ReworkSettings)
@options.require_option(ReworkSettings, "Write no mesh and end with status 6 unless it is")
@options.marked_option(ReworkSettings)
@options.setting(
    ReworkSettings, "dry_run", section="Output", is_flag=True, help="Do everything but write the mesh."
)
@options.force_option
@options.device_option
@options.threads_option
@options.verbosity_options
def mesh(quiet: bool, verbose: int, **values: Any) -> None:
    """Rework the mesh file IN into OUT: parts, size, sides, units, formats; on its volume all of convert's.

    IN holds quads or triangles, in a format that convert writes or one of meshio such as .med or .vol.
    Without an option it is written as it is, in the format of OUT. --simplify, --remesh and --relax need
    quads, and the volume that keeps the vertices on its surface. --quads, --edge-length and --max-error need
    quads alone: without a volume the mesh as it was read is the surface.

    \b
    Examples:
      dmc convert sample_data/dicom/head_ct head.ply -i 300
      dmc mesh head.ply skull.obj --keep largest
      dmc mesh head.ply parts.ply --min-faces 500 --unit um
      dmc mesh head.ply coarse.inp --quads 20%
      dmc mesh head.ply smooth.ply --volume sample_data/dicom/head_ct -i 300 --relax 10
    """
    read = options.gather(ReadSettings, values)
    operations = options.gather(MeshSettings, values)
    settings = options.gather(ReworkSettings, values, read=read, operations=operations)
    if settings.volume is not None and settings.isovalue is None:
        raise missing_isovalue(settings.volume, read)
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import rework_file
        report = rework_file(settings, progress).report
    if not quiet:
        echo_lines(rework_lines(report), err=True)
