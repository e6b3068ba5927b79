"""Define every warning's code: what is told beside a result, so that nothing is guessed in silence.

A code never changes its meaning and is never used for anything else. Codes of `ABOUT_MEANING` say that the
file leaves open what its values or its places mean, or contradicts itself: `--strict` makes them status 4.
`docs/formats.md` has both tables, made from these by `make docs`.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from dmc_cli.errors import AmbiguousVolumeError, CallError

ABOUT_MEANING: dict[str, str] = {
    "W-UNIT-UNKNOWN": "a unit of length that no table has; the numbers are taken as the message says",
    "W-UNIT-MISSING": "lengths without a unit, of all axes or of some; taken as the message says",
    "W-SPACING-MISSING": "no distance of the nodes, along all axes or some; taken as the message says",
    "W-ORIENTATION-MISSING": "no orientation: axes are the grid's own, or those the format's programs assume",
    "W-AXES-MISSING": "axes that nothing says are those of space, or all of them; taken as the message says",
    "W-GEOMETRY-CONTRADICTED": "statements about the geometry that differ; the message says which is taken",
    "W-UNIT-DOUBTFUL": "a unit that puts nodes farther apart, or nearer, than any are; taken as told",
    "W-PHOTOMETRIC": "values that are no brightness (white is low, a colour table); taken as stored",
    "W-IMAGE-TURNED": "images that a tag says to turn or mirror; rows and columns are taken as stored",
    "W-SLICES-DOUBTFUL": "numbers or thicknesses say that slices may be missing; taken as whole",
    "W-SLICES-COUNT": "a text beside the slices tells of another number of them",
    "W-ORDER-ASSUMED": "names of slices without one number that counts them; in the order of the names",
    "W-POSITION-MISSING": "no position of the slices or the first node; taken as the message says",
    "W-SPACE-LEFT-HANDED": "a left-handed space: in a right-handed viewer the mesh is the mirror image",
    "W-ORIENTATION-ROUNDED": "direction cosines rounded coarsely; the nearest of length 1 are taken",
    "W-SLICES-SHIFTED": "slices beside the line from the first to the last; they are put on it",
    "W-RESCALE-UNKNOWN": "a scale of the values that is none (0, no number); the message says what is taken",
    "W-BITS-CONTRADICTED": "pixels not stored as their header says, or a header that contradicts itself",
    "W-IDENTITY-CONTRADICTED": "slices of several patients or studies in one series; taken as one volume",
    "W-FILE-DAMAGED": "files that may belong to the volume could not be read and were left out",
}
"""Codes of what the file leaves open, each with what it means."""

ABOUT_THE_RUN: dict[str, str] = {
    "W-FILES-LEFT-OUT": "files that are no part of the volume were left out",
    "W-SPACING-FROM-LOG": "the distance of the nodes is that of a scanner's text beside the slices",
    "W-DUPLICATES-DROPPED": "slices in the place of another one were left out, as `--duplicates` says",
    "W-SLICES-MISSING": "slices are missing, and the gap is spanned, as `--slice-gaps` says",
    "W-SLICES-UNEVEN": "the distances of slices vary; each stays where it is",
    "W-FIRST-VOLUME": "`dmc info` describes the first of several volumes",
    "W-OPTION-PREFERRED": "an option that was given is followed, not what the file or a text beside it says",
    "W-OPTION-UNUSED": "an option that was given has no effect on this input",
    "W-VALUES-MAPPED": "values have a further meaning (real-world values, uptake) that is not applied",
    "W-LABEL-MAP": "a volume that looks like a label map was cut at an isovalue; `--labels` makes its shells",
    "W-LABELS-ABSENT": "labels that the file, or a table beside it, names, but no node has",
    "W-LABELS-GONE": "labels that have no node any more after a part was taken; they have no file",
    "W-NO-DATA": "nodes without data: the surface ends there",
    "W-QUADS-FEWER": "the mesh has no more quads than were asked for; none are taken away",
    "W-QUADS-LEFT": "more quads are left than were asked for; the message says what stopped the collapses",
    "W-ROUNDING": "coordinates of 32 bits are coarse here",
    "W-OUTSIDE-VOLUME": "vertices of the measured mesh lie outside the volume",
    "W-SHELLS-APART": "shells of labels that touch have vertices of their own there, since each has a size",
    "W-SPACE-UNKNOWN": "one of two meshes names no space; its axes are taken for those of the other",
    "W-NORMALS-LEFT-OUT": "the output's format holds no normals, which were asked for or read from a mesh",
    "W-QUADS-SPLIT": "the mesh's format holds no quads: they were split into triangles",
    "W-SPACE-TURNED": "the mesh's format has axes of its own, which the mesh was turned to",
    "W-COLORS-LEFT-OUT": "the mesh's format holds no colours",
    "W-MATERIALS-LEFT-OUT": "the materials of an OBJ are a file beside it, for which there is no place",
    "W-GROUPS-LEFT-OUT": "the mesh's format holds no names of parts",
    "W-GROUPS-OVERLAP": "faces of a mesh file are in several groups; each stays in the first",
    "W-MESH-UNREAD": "a mesh file holds more than is read of it (normals, values, other cells)",
    "W-VALUES-LEFT-OUT": "the mesh's format holds no values of vertices and faces",
}
"""Codes of what was done as the file or the user says, each with what it means."""

CODES = ABOUT_MEANING | ABOUT_THE_RUN
"""All codes."""


@dataclass(frozen=True)
class Notice:
    """A warning: a code of `CODES` for scripts, a sentence for people."""

    code: str
    sentence: str

    def __post_init__(self) -> None:
        """Raise CallError for a code that is in no table."""
        if self.code not in CODES:
            raise CallError(f"the code {self.code!r} was found; expected one of dmc_cli.notices.CODES")

    @property
    def is_about_meaning(self) -> bool:
        """Return whether `--strict` refuses it."""
        return self.code in ABOUT_MEANING


def notices(code: str, sentences: Iterable[str]) -> list[Notice]:
    """Return one notice a sentence, all of the same code."""
    return [Notice(code, sentence) for sentence in sentences]


def warning_keys(found: Iterable[Notice]) -> dict[str, list[str]]:
    """Return what a report holds of notices: `warnings`, sentences, and `warning_codes`, one a sentence."""
    found = list(found)
    return {
        "warnings": [notice.sentence for notice in found],
        "warning_codes": [notice.code for notice in found],
    }


def refuse_uncertain(found: Iterable[Notice], name: str) -> None:
    """Raise AmbiguousVolumeError if there is a notice about meaning, as `--strict` wants it.

    Args:
        found: What is told of an input.
        name: The input, as the user named it.
    """
    uncertain = [f"{notice.sentence} ({notice.code})" for notice in found if notice.is_about_meaning]
    if uncertain:
        raise AmbiguousVolumeError(
            f"{name}: {'; '.join(uncertain)}; --strict expects a file that leaves nothing of this open; tell "
            "what is missing by the options named, correct the file, or leave --strict out"
        )
