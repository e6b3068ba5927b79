"""Offer the options of the surface: its level, the method of contouring, what methods have of their own."""

from itertools import chain
from typing import Any

import click

from dmc_cli.cli.options.from_settings import Decorator, default_of, setting, stack
from dmc_cli.cli.parameters import Isovalues, complete_values
from dmc_cli.isovalue_choices import PRESETS
from dmc_cli.methods import METHODS, method_named, option_values
from dmc_cli.settings import SurfaceSettings


def method_option(name: str, help: str) -> Decorator:
    """Make an option of the surface that methods have or have not, with their values; `help` is for all."""
    taken = {method: method_named(method).options.get(name, ()) for method in METHODS}
    differs = len(set(taken.values())) > 1
    if differs:
        told = {
            method: ", ".join((f"{values[0]} (default)", *values[1:]))
            for method, values in taken.items()
            if values
        }
        help += "".join(f" Of {method}: {values}." for method, values in told.items())
    default = default_of(SurfaceSettings, "method")
    return setting(
        SurfaceSettings,
        name,
        section="Surface",
        type=click.Choice(option_values(name)),
        show_default=False if differs else taken[default][0],
        help=help,
    )


def _method_help() -> str:
    """Return the help text of `--method`: each method and its title."""
    known = ", ".join(f"{name} ({method_named(name).title})" for name in METHODS)
    return f"Contouring method: {known}."


ISOVALUE_HELP = (
    "The level of the surface, in the volume's physical values (HU for CT), or how to choose it: otsu, otsu:N"
    " (the uppermost of N between N + 1 classes), otsu:N:K (the Kth of them), a share of the range of values"
    " as in 20%, band:LOW:HIGH (what lies between), of CT in HU"
    f" {', '.join(PRESETS)}. Without it: bone of CT in HU, half of a mask, else otsu."
)

isovalues_option = setting(
    SurfaceSettings,
    "isovalue",
    "-i",
    "--isovalue",
    section="Surface",
    type=Isovalues(),
    multiple=True,
    help=f"{ISOVALUE_HELP} Several: give it again, or first:last:step.",
)


def isovalues_of(values: dict[str, Any]) -> list[float | str | None]:
    """Return the isovalues of an option that may be given several times, each a number, several or words.

    Where none is given there is one, None, which the volume decides.
    """
    return list(chain.from_iterable(values.get("isovalue") or ())) or [None]


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
    method_option(
        "triangulation", "How polygons become triangles: of the best shapes, or as the standard table has it."
    ),
    method_option("gradients", "By differences of the values, or the exact ones of a synthetic field."),
    setting(
        SurfaceSettings,
        "steps",
        section="Surface",
        type=int,
        help="Steps of a particle towards the planes of its cell, with --placement particle; 50 unless told.",
    ),
    setting(
        SurfaceSettings,
        "step_size",
        section="Surface",
        type=float,
        help="How far a particle goes a step, as a share of the force; 0.05 unless told.",
    ),
    method_option(
        "border", "Leave the mesh open at the volume's border, or close it, as --require print does."
    ),
    setting(
        SurfaceSettings,
        "orientation",
        section="Surface",
        help="Normals out of the object, or along the gradient.",
    ),
)

surface_options = stack(isovalues_option, shape_of_surface_options)
