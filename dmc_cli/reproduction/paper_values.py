"""Hold a printed figure: of which paper, table, data set and mesh, and what a found one should be."""

from dataclasses import dataclass
from typing import Literal

MeshKind = Literal["dmc", "dmc_simplified", "mc", "tmc", "dc", "dc_particle", "macet"]

Expectation = Literal["exact", "close", "misprint", "machine", "other_data"]
"""What a found value should be: equal to the printed one; equal but for the last digit or two, where ties
decide; different, since the printed one cannot be right; a time, on another machine; near it, since today's
copy of the scan is another one. The remark says why."""

SCHMITZ = "I"
"""The table of Schmitz et al. 2009; numbers are tables of Grosso & Zint 2021."""


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """A synthetic volume of the paper: its field, and the nodes along an axis."""

    field: str
    nodes: int

    @property
    def name(self) -> str:
        """Return the name in the reports, for example iwp_512."""
        return f"{self.field}_{self.nodes}"


@dataclass(frozen=True, kw_only=True)
class Scan:
    """A scan of a paper, which the user has or not: its isovalue, and the nodes along its longest axis."""

    name: str
    isovalue: float
    nodes: int


@dataclass(frozen=True)
class PaperValue:
    """A printed figure.

    Attributes:
        table: Number of the table, or `SCHMITZ`.
        data: The data set.
        mesh: Which mesh.
        quantity: What was counted or measured.
        printed: The figure.
        expectation: What a found value should be.
        remark: Why a found one differs, where it does.
    """

    table: int | str
    data: DataSet | Scan
    mesh: MeshKind
    quantity: str
    printed: float
    expectation: Expectation
    remark: str = ""


DMC: MeshKind = "dmc"
DMCS: MeshKind = "dmc_simplified"
MARCHING: MeshKind = "mc"
TOPOLOGICAL: MeshKind = "tmc"
DUAL: MeshKind = "dc"
PARTICLE: MeshKind = "dc_particle"
MACET: MeshKind = "macet"
