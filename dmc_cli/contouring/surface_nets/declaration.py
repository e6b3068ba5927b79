"""Declare the method for the registry; imports no Warp."""

from dmc_cli.contouring.dual_grid import CELLS
from dmc_cli.methods import Method, later

METHOD = Method(
    title="surface nets",
    faces="quads",
    options={"border": ("open", "closed")},
    on_surface=frozenset(),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.extraction:surface_kernels"),
    color=later("dmc_cli.contouring.dual_grid:color_cells"),
    mesh_kernels=later("dmc_cli.contouring.dual_grid:color_kernels"),
    memory=CELLS,
)
