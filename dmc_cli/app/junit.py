"""Write the outcomes of a batch as JUnit's XML, which programs of continuous integration show.

A test case is an item. One whose mesh is not as required has a failure, any other that failed an error; both
have the message. One that a run which was stopped did not end is skipped. Counts, figures and verdicts are
properties. There is no time but how long an item took.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from dmc_cli.app.output_folders import OutputFolders
from dmc_cli.errors import DmcError, RequirementError
from dmc_cli.files import check_output, write_output
from dmc_cli.printable import printable
from dmc_cli.settings import ConvertSettings, LabelSettings

if TYPE_CHECKING:
    from dmc_cli.app.outcomes import Outcome


@contextmanager
def junit_written(
    path: str | None,
    items: Sequence[ConvertSettings | LabelSettings],
    outcomes: Sequence["Outcome"],
    *,
    force: bool,
    whole: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Iterator[None]:
    """Write what has been told when the context ends, also by an exception; the file's folder is made.

    Args:
        path: The file; None writes nothing.
        items: All that are to be converted.
        outcomes: Those that are told; they may come within the context.
        force: Whether the file may exist.
        whole: A context in which no signal raises an exception.

    Raises:
        WriteError: The file exists, or cannot be written.
    """
    if path is None:
        yield
        return
    with OutputFolders() as folders:
        folders.make_for(path)
        check_output(path, force=force)
        try:
            yield
        except BaseException:
            with whole(), suppress(DmcError):  # why the run ends is told
                write_output(path, [junit_text(outcomes, items).encode()], force=force)
            raise
        write_output(path, [junit_text(outcomes, items).encode()], force=force)


def junit_text(outcomes: Sequence["Outcome"], items: Sequence[ConvertSettings | LabelSettings] = ()) -> str:
    """Return the outcomes as a document of XML, in their order, and after them the items that have none."""
    told = {outcome.output for outcome in outcomes}
    of_labels = {outcome.input for outcome in outcomes if outcome.label is not None}
    left = [
        item
        for item in items
        if item.output.path not in told and not (isinstance(item, LabelSettings) and item.input in of_labels)
    ]
    unmet = sum(_is_unmet(outcome) for outcome in outcomes)
    failed = sum(outcome.status != 0 for outcome in outcomes)
    counts = {
        "name": "dmc batch",
        "tests": len(outcomes) + len(left),
        "failures": unmet,
        "errors": failed - unmet,
        "skipped": len(left),
        "time": f"{sum(outcome.seconds for outcome in outcomes):.3f}",
    }
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<testsuites{_attributes(counts)}>",
        f"  <testsuite{_attributes(counts)}>",
        *(line for outcome in outcomes for line in _case(outcome)),
        *(line for item in left for line in _skipped(item)),
        "  </testsuite>",
        "</testsuites>",
    ]
    return "\n".join(lines) + "\n"


def _case(outcome: "Outcome") -> Iterator[str]:
    """Yield the lines of an item."""
    named = {"classname": outcome.input, "name": outcome.output, "time": f"{outcome.seconds:.3f}"}
    yield f"    <testcase{_attributes(named)}>"
    yield "      <properties>"
    for name, value in _properties(outcome):
        yield f"        <property{_attributes({'name': name, 'value': value})}/>"
    yield "      </properties>"
    if outcome.status:
        kind = "failure" if _is_unmet(outcome) else "error"
        yield f"      <{kind}{_attributes({'type': f'status {outcome.status}', 'message': outcome.error})}/>"
    yield "    </testcase>"


def _skipped(item: ConvertSettings | LabelSettings) -> Iterator[str]:
    """Yield the lines of an item that the run did not end."""
    named = {"classname": item.input, "name": item.output.path, "time": "0.000"}
    yield f"    <testcase{_attributes(named)}>"
    yield f"      <skipped{_attributes({'message': 'the run was stopped before this item was done'})}/>"
    yield "    </testcase>"


def _properties(outcome: "Outcome") -> Iterator[tuple[str, Any]]:
    """Yield what is known of an item, by its name."""
    for name in ("isovalue", "label", "vertices", "quads", "triangles", "report"):
        if (value := getattr(outcome, name)) is not None:
            yield name, value
    for name, value in (outcome.quality or {}).items():
        if value is not None:
            yield name, value
    for verdict in outcome.requirements:
        found = "no value" if verdict["found"] is None else verdict["found"]
        yield f"require {verdict['require']}", f"{'met' if verdict['met'] else 'not met'}: {found}"


def _is_unmet(outcome: "Outcome") -> bool:
    return outcome.status == RequirementError.exit_status


def _attributes(values: dict[str, Any]) -> str:
    """Return attributes; characters that XML cannot have are escaped as Python does it."""
    return "".join(f" {name}={quoteattr(printable(str(value)))}" for name, value in values.items())
