"""Convert a volume to a mesh: `dmc convert`."""

from typing import Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.isovalue import missing_isovalue
from dmc_cli.cli.progress import shown_progress
from dmc_cli.cli.sections import SectionedCommand
from dmc_cli.cli.summary import echo_summary
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, ReadSettings, SurfaceSettings


@click.command(cls=SectionedCommand)
@options.input_argument
@options.output_argument
@options.surface_options
@options.mesh_options
@options.read_options
@options.noise_options
@options.output_options
@options.run_options
@options.verbosity_options
def convert(input: str, quiet: bool, verbose: int, **values: Any) -> None:
    """Turn the volume INPUT into the mesh OUTPUT.

    INPUT is a file, packed or not, FILE:/DATASET of HDF5, a folder of DICOM or of images, a zip,
    synth:FIELD:N (for example synth:iwp:128), or - for standard input. OUTPUT is a mesh file, whose
    suffix tells the format, or - for standard output.

    \b
    Examples:
      dmc convert sample_data/nrrd/tooth.nrrd tooth.ply -i 600
      dmc convert synth:iwp:128 iwp.obj -i 0 --report iwp.json
    """
    read = options.gather(ReadSettings, values)
    output = options.gather(OutputSettings, values)
    if values["isovalue"] is None:
        raise missing_isovalue(input, read)
    surface = options.gather(SurfaceSettings, values)
    settings = options.gather(
        ConvertSettings,
        values,
        input=input,
        read=read,
        surface=surface,
        mesh=options.gather(MeshSettings, values),
        output=output,
    )
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import ReadAhead

            ahead = ReadAhead(settings)  # reads while Warp, which is most of the loading, is imported
            from dmc_cli.app import convert as convert_volume
        result = convert_volume(settings, progress, ahead)
    if not quiet:
        echo_summary(result.report)
