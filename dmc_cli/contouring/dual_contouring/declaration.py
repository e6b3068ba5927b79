"""Declare the method for the registry; imports no Warp."""

from dmc_cli.contouring.dual_grid import DUAL
from dmc_cli.methods import Method, Number, later

PARTICLE = frozenset({"particle"})

METHOD = Method(
    title="dual contouring",
    faces="quads",
    options={
        "placement": ("qef", "paper", "particle"),
        "border": ("open", "closed"),
        "gradients": ("differences", "exact"),
    },
    numbers={
        "steps": Number(
            default=50, least=0, most=100_000, why="more would only take longer", placements=PARTICLE
        ),
        "step_size": Number(
            default=0.05,
            least=1e-6,
            most=0.16,
            why="a particle of a cell with twelve crossed edges swings ever farther from a sixth on",
            placements=PARTICLE,
        ),
    },
    on_surface=frozenset(),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.extraction:surface_kernels"),
    connect=later("dmc_cli.contouring.dual_grid:connect_dual"),
    color=later("dmc_cli.contouring.stages.coloring:color"),
    mesh_kernels=later("dmc_cli.contouring.dual_grid:connecting_dual_kernels"),
    memory=DUAL,
)
