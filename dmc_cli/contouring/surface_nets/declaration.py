"""Declare the method for the registry; imports no Warp."""

from dmc_cli.contouring.dual_grid import DUAL
from dmc_cli.methods import Method, later

METHOD = Method(
    title="surface nets",
    faces="quads",
    options={"border": ("open", "closed")},
    on_surface=frozenset(),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.extraction:surface_kernels"),
    connect=later("dmc_cli.contouring.dual_grid:connect_dual"),
    color=later("dmc_cli.contouring.stages.coloring:color"),
    mesh_kernels=later("dmc_cli.contouring.dual_grid:connecting_dual_kernels"),
    memory=DUAL,
)
