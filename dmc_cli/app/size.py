"""Tell what became of the size that was asked for: what was reached, and what stopped it."""

from typing import TYPE_CHECKING, Any

from dmc_cli.notices import Notice

if TYPE_CHECKING:  # its kernels are only imported by runs that take quads away
    from dmc_cli.processing import Decimated

STOPPED = {
    "topology": "they would tear the mesh, or close a hole of it",
    "shape": "they would leave a quad that is folded or too thin",
    "distance": "they would go too far from the surface",
    "fixed": "the quads stand at a boundary, whose vertices stay",
}
"""What each reason of a refusal means."""


def size_section(result: "Decimated", before: int) -> dict[str, Any]:
    """Return the report's section `size`; `before` counts the quads that there were."""
    quads = result.mesh.face_count
    reasons = {**result.refusals, "fixed": result.fixed} if quads > result.wanted else {}
    most = max(reasons, key=lambda name: reasons[name], default=None)
    return {
        "quads_wanted": result.wanted,
        "quads_before": before,
        "quads": quads,
        "reached": quads <= result.wanted,
        "stopped_by": most,
        "refusals": result.refusals,
        "fixed_quads": result.fixed,
        "rounds": result.rounds,
    }


def size_warnings(size: dict[str, Any]) -> tuple[Notice, ...]:
    """Return the warnings that the number was not met, or had nothing to do."""
    wanted, quads = size["quads_wanted"], size["quads"]
    if not size["reached"]:
        return (
            Notice(
                "W-QUADS-LEFT",
                f"{quads} quads are left of the {wanted} that were asked for: no further collapse was found,"
                f" mostly because {STOPPED[size['stopped_by']]}",
            ),
        )
    if size["quads_before"] <= wanted:
        return (
            Notice(
                "W-QUADS-FEWER",
                f"the mesh has {quads} quads, no more than the {wanted} that were asked for; none were taken"
                " away",
            ),
        )
    return ()
