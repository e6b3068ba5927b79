"""Offer the options of what is written, and how."""

from typing import get_args

import click

from dmc_cli import mesh_formats
from dmc_cli.cli.options.from_settings import Decorator, setting, stack
from dmc_cli.cli.parameters import ChoiceList, RequirementList, complete_files
from dmc_cli.cli.sections import SectionedOption
from dmc_cli.requirements import NAMES
from dmc_cli.settings import MeshValue, OutputSettings

DEFAULT_OUTPUT = "{stem}_{isovalue}.ply"
"""The template of a batch's outputs that were not named."""

output_argument = click.argument("path", metavar="OUTPUT", shell_complete=complete_files)


def require_option(owner: type, effect: str) -> Decorator:
    """Make the option of what a mesh must be; `effect` says what comes of it if it is not."""
    return setting(
        owner,
        "require",
        section="Output",
        type=RequirementList(NAMES),
        again=RequirementList.again,
        help=f"{effect}: {', '.join(NAMES)}; or a figure of the report beside a number, as in"
        " 'shape_min>=0.3,components<=1'.",
    )


def wall_option(owner: type, section: str = "Output") -> Decorator:
    """Make the option of the thickness that walls are measured against."""
    return setting(
        owner,
        "wall",
        section=section,
        type=float,
        metavar="LENGTH",
        help="A thickness, in the mesh's unit: how much of the area is thinner is told, too, and --require"
        " print takes none.",
    )


def marked_option(owner: type) -> Decorator:
    """Make the option of a file for the mesh with what its faces are to blame for."""
    return setting(
        owner,
        "marked",
        section="Output",
        metavar="FILE",
        shell_complete=complete_files,
        help="Write the mesh, also one that is refused, with a value `unmet` of each face: how many"
        " requirements it is to blame for.",
    )


output_options = stack(
    setting(
        OutputSettings,
        "output_format",
        section="Output",
        type=click.Choice(tuple(mesh_formats.FORMATS)),
        help=f"The format, where the suffix ({', '.join(mesh_formats.known_suffixes())}) does not tell.",
    ),
    setting(
        OutputSettings,
        "normals",
        "--normals/--no-normals",
        section="Output",
        is_flag=True,
        help="Vertex normals; without a word where the format has a place for them.",
    ),
    setting(
        OutputSettings,
        "space",
        section="Output",
        help="Axes of the coordinates: the input's, RAS or LPS, grid indices, or tkrRAS (FreeSurfer).",
    ),
    setting(
        OutputSettings,
        "unit",
        section="Output",
        help="Unit of the coordinates, and in the report of area, volume and bounds.",
    ),
    setting(
        OutputSettings, "ascii", section="Output", is_flag=True, help="Text where the format could be binary."
    ),
    setting(
        OutputSettings,
        "values",
        section="Output",
        type=ChoiceList(get_args(MeshValue)),
        again=ChoiceList.again,
        help=f"Values in the file, of each vertex or face: {', '.join(get_args(MeshValue))}.",
    ),
    setting(
        OutputSettings,
        "element",
        section="Output",
        help="What a quad is in an Abaqus file: a shell (S4R by default), a membrane, a surface, rigid.",
    ),
    setting(
        OutputSettings,
        "halfedges",
        section="Output",
        metavar="FILE",
        shell_complete=complete_files,
        help="Write the halfedges, and colours if the method has any: .npz or .txt.",
    ),
    setting(
        OutputSettings,
        "report",
        section="Output",
        metavar="FILE",
        shell_complete=complete_files,
        help="Write a JSON report; - is standard output.",
    ),
    setting(
        OutputSettings,
        "curvature",
        section="Output",
        is_flag=True,
        help="Report the mean and the Gaussian curvature at the vertices, too.",
    ),
    wall_option(OutputSettings),
    require_option(OutputSettings, "Write no mesh and end with status 6 unless it is"),
    marked_option(OutputSettings),
    setting(
        OutputSettings, "check", section="Output", is_flag=True, help="Verify every invariant before writing."
    ),
    setting(
        OutputSettings, "allow_empty", section="Output", is_flag=True, help="An empty surface is no error."
    ),
    setting(
        OutputSettings, "dry_run", section="Output", is_flag=True, help="Do everything but write the mesh."
    ),
    setting(OutputSettings, "force", section="Output", is_flag=True, help="Overwrite what exists."),
)

force_option = setting(OutputSettings, "force", section="Output", is_flag=True, help="Overwrite what exists.")
json_option = click.option(
    "--json", "as_json", cls=SectionedOption, section="Output", is_flag=True, help="JSON instead of text."
)
