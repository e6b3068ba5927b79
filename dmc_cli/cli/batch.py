"""Convert many inputs at many isovalues in one run: `dmc batch`."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from dmc_cli.cli import options
from dmc_cli.cli.parameters import complete_files
from dmc_cli.cli.progress import echo_data, shown_progress
from dmc_cli.cli.sections import SectionedCommand, SectionedOption
from dmc_cli.cli.signals import signals_held
from dmc_cli.errors import BatchError
from dmc_cli.printable import json_text

if TYPE_CHECKING:
    from dmc_cli.app import Outcome


@click.command(cls=SectionedCommand)
@click.argument("inputs", nargs=-1, required=True, shell_complete=complete_files)
@click.option(
    "-o",
    "--output",
    cls=SectionedOption,
    section="Batch",
    metavar="TEMPLATE",
    shell_complete=complete_files,
    default=options.DEFAULT_OUTPUT,
    help="Name of each output, from {stem}, {name}, {parent} (the input's folder), {isovalue} and {index};"
    " with --labels {label}, and {name} is the label's.",
)
@click.option(
    "--jobs",
    cls=SectionedOption,
    section="Batch",
    type=click.IntRange(min=1),
    default=1,
    again=None,
    help="Items at work at the same time; each has an equal share of --memory, or of the machine's.",
)
@click.option(
    "--junit",
    cls=SectionedOption,
    section="Batch",
    metavar="FILE",
    shell_complete=complete_files,
    help="Write the outcomes as JUnit's XML, for continuous integration: a test case an item, also of a run"
    " that is stopped.",
)
@options.surface_options
@options.part_options
@options.label_options
@options.mesh_options
@options.read_options
@options.noise_options
@options.output_options
@options.run_options
@options.verbosity_options
@click.pass_context
def batch(
    ctx: click.Context,
    /,
    inputs: tuple[str, ...],
    jobs: int,
    junit: str | None,
    quiet: bool,
    verbose: int,
    **values: Any,
) -> None:
    """Convert all INPUTS at all isovalues, and go on after a failure.

    INPUTS are files, folders, patterns in quotes, synth:FIELD:N, or one .toml file with the same options
    (`inputs`, `isovalue`, `output`, ...; not --jobs, --junit, -q, -v) and, under [[items]], tables of them
    that go before the common ones. An item without inputs takes the common ones; if all have their own, the
    common ones are converted too. Each item's outcome is a line of JSON on standard output: seconds, counts,
    quality, verdicts of --require and the file of --report, which is a template too. Folders of outputs are
    made. With --labels each label has a line. Ends with status 8 if an item failed.

    \b
    Examples:
      dmc batch 'sample_data/nrrd/*.nrrd' -i 500 -i 1000 -o '{stem}_{isovalue}.obj'
      dmc batch synth:torus:32 synth:sphere:32 -i 0 --jobs 2
      dmc batch 'sample_data/labels/*.nrrd' --labels all -o 'shells/{stem}_{name}.stl'
      dmc batch 'sample_data/nifti/*.nii.gz' -i otsu -o 'out/{stem}.ply' --require manifold --junit out.xml
    """
    from dmc_cli.cli.batch_plan import plan_batch

    items = plan_batch(ctx, inputs, values, junit)
    outcomes: list[Outcome] = []
    with shown_progress(quiet=quiet, verbose=verbose) as progress:
        with progress.stage("loading"):
            from dmc_cli.app import convert_all, junit_written

        def tell(outcome: "Outcome") -> None:
            echo_data(json_text(asdict(outcome)), progress)
            outcomes.append(outcome)

        with junit_written(junit, items, outcomes, force=values["force"], whole=signals_held):
            convert_all(items, tell, jobs, progress, signals_held)
    if failed := sum(outcome.status != 0 for outcome in outcomes):
        raise BatchError(
            f"{failed} of {len(outcomes)} item(s) failed; their lines on standard output tell why"
        )
    if not quiet:
        click.echo(f"{len(outcomes)} item(s) done", err=True)
