"""List what Grosso & Zint 2021 print for data that anyone can make again, for `dmc reproduce`.

Their data sets are the synthetic fields; rows on scans are left out, since the scans and most isovalues were
never published. At the end come those of Schmitz et al. 2009. `dmc` is the mesh of dual marching cubes,
`dmc_simplified` the one after 3-X-3-Y and 3-3-3-3, `mc`, `tmc` and `dc` those of the methods that it is
compared with. Times were taken on an RTX 2080 Ti.
"""

from dmc_cli.reproduction.paper_values import (
    DMC,
    DMCS,
    DUAL,
    MARCHING,
    TOPOLOGICAL,
    DataSet,
    PaperValue,
)
from dmc_cli.reproduction.schmitz_table import SCHMITZ_VALUES

IWP_512 = DataSet(field="iwp", nodes=512)
GENUS_TWO_64 = DataSet(field="genus_two", nodes=64)
GENUS_TWO_128 = DataSet(field="genus_two", nodes=128)
GENUS_TWO_256 = DataSet(field="genus_two", nodes=256)
KUMMER_256 = DataSet(field="kummer", nodes=256)
NEOVIUS_256 = DataSet(field="neovius", nodes=256)
STEINER_512 = DataSet(field="steiner", nodes=512)

DATA_SETS = (GENUS_TWO_64, GENUS_TWO_128, GENUS_TWO_256, KUMMER_256, NEOVIUS_256, IWP_512, STEINER_512)
"""From the smallest to the largest."""

MC = "the paper's vertices of marching cubes"
COUNTED = "the paper's own irregular vertices in table 8 need 16285"
FLAT = "mean |f| falls with the square of the spacing; the printed row does not"
TIES = "diagonals as good as each other but for rounding decide the last tenth"

COPIED = "the figure of the quads in table 8: copied by mistake"
SPLITS = "equally good diagonals: 23.81 by exact positions, 24.28 by positions in float32"
TRANSPOSED = "4.32 with exactly the quads removed that table 4 prints: a digit is wrong there"
THREE = "23.49495: three vertices of 6.5 million short of what rounds so"
SINGULAR = "the surface has cone points at isovalue 0, where rounding decides the topology"
BRANCHES = "cells with several branches of the surface"

PAPER_VALUES: tuple[PaperValue, ...] = (
    PaperValue(2, IWP_512, DMC, "surface_ms", 99, "machine"),
    PaperValue(2, GENUS_TWO_256, DMC, "surface_ms", 7, "machine"),
    PaperValue(2, IWP_512, MARCHING, "surface_ms", 65, "machine"),
    PaperValue(2, GENUS_TWO_256, MARCHING, "surface_ms", 2, "machine"),
    PaperValue(3, IWP_512, DMC, "vertices", 6528938, "exact"),
    PaperValue(3, IWP_512, DMC, "quads", 6498576, "exact"),
    PaperValue(3, IWP_512, DMC, "crossed_edges", 6558756, "exact", MC),
    PaperValue(3, GENUS_TWO_256, DMC, "vertices", 158902, "exact"),
    PaperValue(3, GENUS_TWO_256, DMC, "quads", 158904, "exact"),
    PaperValue(3, GENUS_TWO_256, DMC, "crossed_edges", 158904, "exact", MC),
    PaperValue(3, IWP_512, MARCHING, "vertices", 6558756, "exact"),
    PaperValue(3, IWP_512, MARCHING, "triangles", 13056698, "exact"),
    PaperValue(3, GENUS_TWO_256, MARCHING, "vertices", 158904, "exact"),
    PaperValue(3, GENUS_TWO_256, MARCHING, "triangles", 317812, "exact"),
    PaperValue(4, IWP_512, DMCS, "removed_3x3y", 346907, "exact"),
    PaperValue(4, IWP_512, DMCS, "removed_3333", 384, "exact"),
    PaperValue(4, IWP_512, DMCS, "simplify_ms", 15, "machine"),
    PaperValue(4, GENUS_TWO_256, DMCS, "removed_3x3y", 16158, "misprint", COUNTED),
    PaperValue(4, GENUS_TWO_256, DMCS, "removed_3333", 0, "exact"),
    PaperValue(4, GENUS_TWO_256, DMCS, "simplify_ms", 1, "machine"),
    PaperValue(5, IWP_512, DMC, "halfedges_ms", 73, "machine"),
    PaperValue(5, IWP_512, DMC, "coloring_ms", 18, "machine"),
    PaperValue(5, GENUS_TWO_256, DMC, "halfedges_ms", 2, "machine"),
    PaperValue(5, GENUS_TWO_256, DMC, "coloring_ms", 2, "machine"),
    PaperValue(6, IWP_512, DMC, "mean_deviation_1e4", 0.97, "close"),
    PaperValue(6, IWP_512, DMCS, "mean_deviation_1e4", 1.06, "close"),
    PaperValue(6, IWP_512, DUAL, "mean_deviation_1e4", 3.44, "close"),
    PaperValue(6, IWP_512, TOPOLOGICAL, "mean_deviation_1e4", 1.04, "close"),
    PaperValue(6, IWP_512, MARCHING, "mean_deviation_1e4", 1.04, "close"),
    PaperValue(6, GENUS_TWO_64, DMC, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_128, DMC, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_256, DMC, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_64, DMCS, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_128, DMCS, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_256, DMCS, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_64, DUAL, "mean_deviation", 0.68, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_64, TOPOLOGICAL, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_64, MARCHING, "mean_deviation", 0.69, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_128, DUAL, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_128, TOPOLOGICAL, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_128, MARCHING, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_256, DUAL, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_256, TOPOLOGICAL, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(6, GENUS_TWO_256, MARCHING, "mean_deviation", 0.70, "misprint", FLAT),
    PaperValue(7, IWP_512, DMC, "mean_ratio", 0.84, "close"),
    PaperValue(7, IWP_512, DMCS, "mean_ratio", 0.82, "close"),
    PaperValue(7, GENUS_TWO_64, DMC, "mean_ratio", 0.87, "close"),
    PaperValue(7, GENUS_TWO_64, DMCS, "mean_ratio", 0.83, "close"),
    PaperValue(7, GENUS_TWO_128, DMC, "mean_ratio", 0.87, "close"),
    PaperValue(7, GENUS_TWO_128, DMCS, "mean_ratio", 0.82, "close"),
    PaperValue(7, GENUS_TWO_256, DMC, "mean_ratio", 0.87, "close"),
    PaperValue(7, GENUS_TWO_256, DMCS, "mean_ratio", 0.82, "close"),
    PaperValue(7, IWP_512, DMC, "irregular_triangle_percent", 23.85, "close", TIES),
    PaperValue(7, IWP_512, DMCS, "irregular_triangle_percent", 28.57, "close", TIES),
    PaperValue(7, GENUS_TWO_64, DMC, "irregular_triangle_percent", 34.88, "close", TIES),
    PaperValue(7, GENUS_TWO_64, DMCS, "irregular_triangle_percent", 48.30, "close", TIES),
    PaperValue(7, GENUS_TWO_128, DMC, "irregular_triangle_percent", 31.86, "close", TIES),
    PaperValue(7, GENUS_TWO_128, DMCS, "irregular_triangle_percent", 44.48, "close", TIES),
    PaperValue(7, GENUS_TWO_256, DMC, "irregular_triangle_percent", 28.96, "close", TIES),
    PaperValue(7, GENUS_TWO_256, DMCS, "irregular_triangle_percent", 41.01, "close", TIES),
    PaperValue(7, IWP_512, DUAL, "mean_ratio", 0.86, "close"),
    PaperValue(7, IWP_512, TOPOLOGICAL, "mean_ratio", 0.65, "close"),
    PaperValue(7, IWP_512, MARCHING, "mean_ratio", 0.65, "close"),
    PaperValue(7, GENUS_TWO_64, DUAL, "mean_ratio", 0.84, "close"),
    PaperValue(7, GENUS_TWO_64, TOPOLOGICAL, "mean_ratio", 0.71, "close"),
    PaperValue(7, GENUS_TWO_64, MARCHING, "mean_ratio", 0.71, "close"),
    PaperValue(7, GENUS_TWO_128, DUAL, "mean_ratio", 0.84, "close"),
    PaperValue(7, GENUS_TWO_128, TOPOLOGICAL, "mean_ratio", 0.71, "close"),
    PaperValue(7, GENUS_TWO_128, MARCHING, "mean_ratio", 0.71, "close"),
    PaperValue(7, GENUS_TWO_256, DUAL, "mean_ratio", 0.84, "close"),
    PaperValue(7, GENUS_TWO_256, TOPOLOGICAL, "mean_ratio", 0.71, "close"),
    PaperValue(7, GENUS_TWO_256, MARCHING, "mean_ratio", 0.71, "close"),
    PaperValue(7, IWP_512, DUAL, "irregular_triangle_percent", 24.13, "close", SPLITS),
    PaperValue(7, IWP_512, TOPOLOGICAL, "irregular_triangle_percent", 25.17, "close", SINGULAR),
    PaperValue(7, IWP_512, MARCHING, "irregular_triangle_percent", 25.13, "exact"),
    PaperValue(7, GENUS_TWO_64, DUAL, "irregular_triangle_percent", 43.37, "misprint", COPIED),
    PaperValue(7, GENUS_TWO_64, TOPOLOGICAL, "irregular_triangle_percent", 46.15, "exact"),
    PaperValue(7, GENUS_TWO_64, MARCHING, "irregular_triangle_percent", 46.15, "exact"),
    PaperValue(7, GENUS_TWO_128, DUAL, "irregular_triangle_percent", 36.71, "exact"),
    PaperValue(7, GENUS_TWO_128, TOPOLOGICAL, "irregular_triangle_percent", 45.03, "exact"),
    PaperValue(7, GENUS_TWO_128, MARCHING, "irregular_triangle_percent", 45.03, "exact"),
    PaperValue(7, GENUS_TWO_256, DUAL, "irregular_triangle_percent", 34.40, "exact"),
    PaperValue(7, GENUS_TWO_256, TOPOLOGICAL, "irregular_triangle_percent", 44.13, "exact"),
    PaperValue(7, GENUS_TWO_256, MARCHING, "irregular_triangle_percent", 44.13, "exact"),
    PaperValue(8, IWP_512, DMC, "shape", 0.89, "close"),
    PaperValue(8, IWP_512, DMCS, "shape", 0.90, "close"),
    PaperValue(8, IWP_512, DMC, "irregular_percent", 23.51, "exact"),
    PaperValue(8, IWP_512, DMCS, "irregular_percent", 4.22, "misprint", TRANSPOSED),
    PaperValue(8, GENUS_TWO_64, DMC, "shape", 0.85, "close"),
    PaperValue(8, GENUS_TWO_64, DMCS, "shape", 0.87, "close"),
    PaperValue(8, GENUS_TWO_64, DMC, "irregular_percent", 43.37, "exact"),
    PaperValue(8, GENUS_TWO_64, DMCS, "irregular_percent", 8.85, "exact"),
    PaperValue(8, GENUS_TWO_128, DMC, "shape", 0.86, "close"),
    PaperValue(8, GENUS_TWO_128, DMCS, "shape", 0.87, "close"),
    PaperValue(8, GENUS_TWO_128, DMC, "irregular_percent", 42.60, "exact"),
    PaperValue(8, GENUS_TWO_128, DMCS, "irregular_percent", 5.95, "exact"),
    PaperValue(8, GENUS_TWO_256, DMC, "shape", 0.86, "close"),
    PaperValue(8, GENUS_TWO_256, DMCS, "shape", 0.87, "close"),
    PaperValue(8, GENUS_TWO_256, DMC, "irregular_percent", 42.28, "exact"),
    PaperValue(8, GENUS_TWO_256, DMCS, "irregular_percent", 5.14, "exact"),
    PaperValue(8, IWP_512, DUAL, "shape", 0.84, "close"),
    PaperValue(8, IWP_512, DUAL, "irregular_percent", 23.50, "close", THREE),
    PaperValue(8, GENUS_TWO_64, DUAL, "shape", 0.73, "close"),
    PaperValue(8, GENUS_TWO_64, DUAL, "irregular_percent", 43.37, "exact"),
    PaperValue(8, GENUS_TWO_128, DUAL, "shape", 0.73, "close"),
    PaperValue(8, GENUS_TWO_128, DUAL, "irregular_percent", 42.60, "exact"),
    PaperValue(8, GENUS_TWO_256, DUAL, "shape", 0.74, "close"),
    PaperValue(8, GENUS_TWO_256, DUAL, "irregular_percent", 42.28, "exact"),
    PaperValue(8, IWP_512, DUAL, "several_branches_percent", 0.02, "close", BRANCHES),
    PaperValue(8, IWP_512, DMC, "non_manifold_percent", 0, "exact"),
    PaperValue(8, IWP_512, DMCS, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_64, DMC, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_64, DMCS, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_128, DMC, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_128, DMCS, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_256, DMC, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_256, DMCS, "non_manifold_percent", 0, "exact"),
    PaperValue(8, GENUS_TWO_64, DUAL, "several_branches_percent", 0, "exact", BRANCHES),
    PaperValue(8, GENUS_TWO_128, DUAL, "several_branches_percent", 0, "exact", BRANCHES),
    PaperValue(8, GENUS_TWO_256, DUAL, "several_branches_percent", 0, "exact", BRANCHES),
    PaperValue(9, KUMMER_256, DMC, "vertices", 265752, "exact"),
    PaperValue(9, KUMMER_256, DMC, "quads", 263856, "exact"),
    PaperValue(9, KUMMER_256, DMC, "surface_ms", 5, "machine"),
    PaperValue(9, NEOVIUS_256, DMC, "vertices", 644956, "exact"),
    PaperValue(9, NEOVIUS_256, DMC, "quads", 640992, "exact"),
    PaperValue(9, NEOVIUS_256, DMC, "surface_ms", 9, "machine"),
    PaperValue(9, STEINER_512, DMC, "vertices", 1232672, "exact"),
    PaperValue(9, STEINER_512, DMC, "quads", 1232184, "exact"),
    PaperValue(9, STEINER_512, DMC, "surface_ms", 34, "machine"),
    *SCHMITZ_VALUES,
)
