"""Offer the options of what is read, and how."""

from typing import Any

import click

from dmc_cli import volume_formats
from dmc_cli.cli.options.from_settings import setting, stack
from dmc_cli.cli.parameters import Triple, complete_files, complete_values
from dmc_cli.settings import ReadSettings

input_argument = click.argument("input", shell_complete=complete_files)


def _complete_types(ctx: click.Context, parameter: click.Parameter, incomplete: str) -> Any:
    from dmc_cli.volume_io import RAW_TYPES

    return complete_values(*RAW_TYPES)(ctx, parameter, incomplete)


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
