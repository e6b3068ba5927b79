"""Make the options that commands share, each once from the settings field that it fills.

Name, default and choices come from the field in `settings.py`, those that depend on the method of contouring
from what the methods declare; only the help text and its heading are added.
"""

from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import click

from dmc_cli import mesh_formats, volume_formats
from dmc_cli.cli.group import VERBOSE
from dmc_cli.cli.parameters import ChoiceList, Size, Triple, complete_files, complete_values
from dmc_cli.cli.sections import SectionedOption
from dmc_cli.methods import METHODS, method_named, option_values
from dmc_cli.settings import (
    ConvertSettings,
    MeshSettings,
    OutputSettings,
    ReadSettings,
    Requirement,
    SurfaceSettings,
)

Decorator = Callable[[Any], Any]
Settings = TypeVar("Settings")


def setting(owner: type, name: str, *flags: str, section: str, help: str, **extra: Any) -> Decorator:
    """Make the option that fills the field `name` of the settings class `owner`.

    Args:
        owner: A dataclass of `settings.py`.
        name: Its field; the flag is the same with dashes unless `flags` are given.
        flags: Other flags for the same field.
        section: The heading in the help text.
        help: What the option does.
        extra: Further arguments of click, for example the type where the field's is no choice.
    """
    if "type" not in extra and "is_flag" not in extra:
        choices = _choices(get_type_hints(owner)[name])
        extra["type"] = click.Choice(choices) if choices else None
    default = default_of(owner, name)
    if default == ():
        extra["show_default"] = False
    names = flags or (f"--{name.replace('_', '-')}",)
    return click.option(
        *names, name, cls=SectionedOption, section=section, default=default, help=help, **extra
    )


def method_option(name: str, help: str) -> Decorator:
    """Make an option of the surface that methods have or have not, with their values; `help` is for all."""
    taken = {method: method_named(method).options.get(name, ()) for method in METHODS}
    if len(set(taken.values())) > 1:
        help += "".join(f" Of {method}: {', '.join(values)}." for method, values in taken.items() if values)
    default = default_of(SurfaceSettings, "method")
    return setting(
        SurfaceSettings,
        name,
        section="Surface",
        type=click.Choice(option_values(name)),
        show_default=taken[default][0] if taken[default] else False,
        help=help,
    )


def _method_help() -> str:
    """Return the help text of `--method`: each method and its title."""
    known = ", ".join(f"{name} ({method_named(name).title})" for name in METHODS)
    return f"Contouring method: {known}."


def default_of(owner: type, name: str) -> Any:
    """Return the default of a settings field, None where it has none."""
    found: Field[Any] = next(field for field in fields(owner) if field.name == name)
    return None if found.default is MISSING else found.default


def gather(owner: type[Settings], values: dict[str, Any], **given: Any) -> Settings:
    """Build settings from the options of the same names; `given` fills the other fields."""
    names = {field.name for field in fields(owner) if field.init}  # type: ignore[arg-type]
    return owner(**{name: value for name, value in values.items() if name in names} | given)


def stack(*decorators: Decorator) -> Decorator:
    """Join options into one decorator that lists them in this order."""

    def apply(command: Any) -> Any:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return apply


def _choices(annotation: Any) -> tuple[str, ...]:
    """Return the values of a Literal, or of the Literal in an optional one; none for other types."""
    for part in (annotation, *get_args(annotation)):
        if get_origin(part) is Literal:
            return get_args(part)
    return ()


def _remember(ctx: click.Context, _parameter: click.Parameter, value: int) -> int:
    ctx.meta[VERBOSE] = value
    return value


def _complete_types(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> Any:
    from dmc_cli.volume_io import RAW_TYPES

    return complete_values(*RAW_TYPES)(ctx, parameter, incomplete)


input_argument = click.argument("input", shell_complete=complete_files)
output_argument = click.argument("path", metavar="OUTPUT", shell_complete=complete_files)

read_options = stack(
    setting(
        ReadSettings,
        "input_format",
        section="Input",
        type=click.Choice(tuple(volume_formats.FORMATS)),
        help=f"The format, where neither the suffix ({', '.join(volume_formats.known_suffixes())}) nor the"
        " content tells.",
    ),
    setting(
        ReadSettings,
        "series",
        section="Input",
        metavar="UID|N",
        help="The DICOM series: its UID, or its number as `dmc info` lists it.",
    ),
    setting(
        ReadSettings,
        "slice_gaps",
        section="Input",
        help="What to do where slices of a DICOM series are missing: refuse, or span the gap.",
    ),
    setting(
        ReadSettings,
        "duplicates",
        section="Input",
        help="What to do where several DICOM slices share a place: refuse, or take the first of true copies.",
    ),
    setting(
        ReadSettings,
        "slice_order",
        section="Input",
        help="How slices of a DICOM series follow each other: by position, or, where positions are missing "
        "or wrong, by instance number, slice location or file name, with --spacing.",
    ),
    setting(
        ReadSettings,
        "channel",
        section="Input",
        metavar="N|NAME",
        help="Which channel of a file with several: its number, from 0, or its name.",
    ),
    setting(
        ReadSettings,
        "time",
        section="Input",
        metavar="N|NAME",
        help="Which time of a file with several: its number, from 0, or its name.",
    ),
    setting(
        ReadSettings,
        "volume_index",
        section="Input",
        type=int,
        help="Which volume of a file with several, from 0, as `dmc info` lists them.",
    ),
    setting(
        ReadSettings,
        "allow_outside",
        section="Input",
        is_flag=True,
        help="Read files outside the input's folder, too, that a header names or a link leads to.",
    ),
    setting(
        ReadSettings,
        "spacing",
        section="Input",
        type=Triple(float),
        help="Distance of the nodes in mm, for any file that tells none, or in no known unit; 1 without it.",
    ),
    setting(
        ReadSettings,
        "origin",
        section="Input",
        type=Triple(float),
        help="Centre of the first node in mm, for any file that tells none; 0 without it.",
    ),
    setting(
        ReadSettings,
        "strict",
        section="Input",
        is_flag=True,
        help="Refuse, with status 4, a file that leaves open what it means: unit, spacing, axes, order.",
    ),
    setting(ReadSettings, "shape", section="Raw input", type=Triple(int), help="Number of nodes."),
    setting(
        ReadSettings,
        "dtype",
        section="Raw input",
        metavar="T",
        shell_complete=_complete_types,
        help="Type of a value: uint8, int16, float32, ...",
    ),
    setting(ReadSettings, "byte_order", section="Raw input", help="Order of the bytes of a value."),
    setting(
        ReadSettings,
        "skip_bytes",
        section="Raw input",
        type=int,
        metavar="N",
        help="Bytes before the values.",
    ),
)

noise_options = stack(
    setting(ReadSettings, "seed", section="Noise", type=int, help="Seed of the field `noise`."),
    setting(
        ReadSettings,
        "sigma",
        section="Noise",
        type=float,
        help="Smoothing of the field `noise`: standard deviation of a Gaussian, in nodes.",
    ),
)

_ISOVALUE_HELP = "The level of the surface, in the volume's physical values (HU for CT)."

_SEVERAL_ISOVALUES = "keep one of them, or give all of them to dmc batch"

isovalue_option = setting(
    SurfaceSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Surface",
    type=float,
    again=_SEVERAL_ISOVALUES,
    help=_ISOVALUE_HELP,
)
batch_isovalue_option = setting(
    SurfaceSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Surface",
    type=float,
    multiple=True,
    help=f"{_ISOVALUE_HELP} May be given several times.",
)
shape_of_surface_options = stack(
    setting(
        SurfaceSettings,
        "method",
        section="Surface",
        metavar=f"[{'|'.join(METHODS)}]",
        shell_complete=complete_values(*METHODS),
        help=_method_help(),
    ),
    setting(
        SurfaceSettings, "inside", section="Surface", help="The side of the isovalue that is the object."
    ),
    method_option("topology", "A 2-manifold always, or the asymptotic decider's own answer."),
    method_option("placement", "Where the vertices lie."),
    method_option("border", "Leave the mesh open at the volume's border, or close it."),
    setting(
        SurfaceSettings,
        "orientation",
        section="Surface",
        help="Normals out of the object, or along the gradient.",
    ),
)

surface_options = stack(isovalue_option, shape_of_surface_options)

mesh_options = stack(
    setting(
        MeshSettings,
        "simplify",
        section="Mesh",
        help="Remove quads by the valences of their vertices: the pattern 3-X-3-Y, 3-3-3-3, or both.",
    ),
    setting(
        MeshSettings,
        "simplify_rules",
        section="Mesh",
        help="Keep the mesh manifold and unfolded, or follow the papers' bare rules.",
    ),
    setting(
        MeshSettings,
        "project",
        "--project/--no-project",
        section="Mesh",
        is_flag=True,
        help="Put the vertices of simplification back on the surface.",
    ),
    setting(
        MeshSettings,
        "remesh",
        section="Mesh",
        type=int,
        metavar="ROUNDS",
        help="Reduce irregular vertices in ROUNDS rounds of edge rotations, quad collapses and splits; 20 do"
        " most of it. Implies --simplify all.",
    ),
    setting(
        MeshSettings,
        "relax",
        section="Mesh",
        type=int,
        metavar="N",
        help="Smooth on the surface in N steps: vertices glide to where quads have better shapes.",
    ),
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
        help="Vertex normals.",
    ),
    setting(
        OutputSettings,
        "space",
        section="Output",
        help="Axes of the coordinates: the input's, RAS or LPS, or grid indices.",
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
        "halfedges",
        section="Output",
        metavar="FILE",
        shell_complete=complete_files,
        help="Write the halfedges and colours, too: .npz or .txt.",
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
        "require",
        section="Output",
        type=ChoiceList(get_args(Requirement)),
        again=ChoiceList.again,
        help=f"Write no mesh and end with status 6 unless it is: {', '.join(get_args(Requirement))}.",
    ),
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

device_option = setting(
    ConvertSettings,
    "device",
    section="Run",
    metavar="DEVICE",
    shell_complete=complete_values("auto", "cpu", "cuda"),
    again=None,
    help="auto (CUDA where usable), cpu, cuda or cuda:N.",
)
threads_option = setting(
    ConvertSettings,
    "threads",
    section="Run",
    type=int,
    metavar="N",
    again=None,
    help="CPU threads; all cores without it.",
)
memory_option = setting(
    OutputSettings,
    "memory",
    section="Run",
    type=Size(),
    again=None,
    help="The memory that the run's arrays may take, as in 4G; Python and Warp take some 200 MiB more.",
)
run_options = stack(device_option, threads_option, memory_option)

force_option = setting(OutputSettings, "force", section="Output", is_flag=True, help="Overwrite what exists.")
json_option = click.option(
    "--json", "as_json", cls=SectionedOption, section="Output", is_flag=True, help="JSON instead of text."
)
verbosity_options = stack(
    click.option("-q", "--quiet", is_flag=True, help="No progress and no summary."),
    click.option(
        "-v",
        "--verbose",
        count=True,
        show_default=False,
        callback=_remember,
        help="Print more; -vv adds tracebacks.",
    ),
)
