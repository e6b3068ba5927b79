"""Hold the numbers along the grid of a method whose cells may have several polygons."""

from dataclasses import dataclass

from dmc_cli.contouring.dual_marching_cubes.polygons import Polygons
from dmc_cli.contouring.stages.numbering import QuadNumbering


@dataclass(frozen=True, kw_only=True)
class Numbering(QuadNumbering):
    """Numbers of vertices and quads where cells may have several polygons.

    Attributes:
        polygons: The special cells' polygons.
    """

    polygons: Polygons
