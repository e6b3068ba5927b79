"""Write the outcomes of a batch as JUnit's XML, which programs of continuous integration show.

A test case is an item. One whose mesh is not as required has a failure, any other that failed an error; both
have the message. Counts, figures and verdicts are properties. There is no time but how long an item took.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from dmc_cli.errors import RequirementError
from dmc_cli.printable import printable

if TYPE_CHECKING:
    from dmc_cli.app.batch import Outcome


def junit_text(outcomes: Sequence["Outcome"]) -> str:
    """Return the outcomes as a document of XML, in their order."""
    unmet = sum(_is_unmet(outcome) for outcome in outcomes)
    failed = sum(outcome.status != 0 for outcome in outcomes)
    counts = {
        "name": "dmc batch",
        "tests": len(outcomes),
        "failures": unmet,
        "errors": failed - unmet,
        "time": f"{sum(outcome.seconds for outcome in outcomes):.3f}",
    }
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<testsuites{_attributes(counts)}>",
        f"  <testsuite{_attributes(counts)}>",
        *(line for outcome in outcomes for line in _case(outcome)),
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


def _properties(outcome: "Outcome") -> Iterator[tuple[str, Any]]:
    """Yield what is known of an item, by its name."""
    for name in ("isovalue", "vertices", "quads", "triangles", "report"):
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
