"""Declare the method for the registry; imports no Warp."""

from dmc_cli.methods import Cost, Memory, Method, later

CELLS = Cost(word=16, near=8, cell=36)
"""Inside, active and ordinary bits, a sixteenth of eight sums; two ranks; what is known of a special cell."""

TRACING = Cost(cell=13)
"""Counts and flags while special cells are traced."""

RANKS = Cost(near=16)
"""The quads' ranks: three bits per node and a number per word."""

METHOD = Method(
    title="dual marching cubes",
    faces="quads",
    options={
        "topology": ("manifold", "asymptotic"),
        "placement": ("exact", "sampled", "iterative", "centroid"),
        "border": ("open", "closed"),
    },
    on_surface=frozenset({"exact"}),
    manifold=frozenset({"manifold"}),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.kernels:surface_kernels"),
    connect=later(f"{__package__}.halfedges.connect:connect"),
    color=later("dmc_cli.contouring.stages.coloring:color"),
    mesh_kernels=later(f"{__package__}.kernels:mesh_kernels"),
    list_flips=later(f"{__package__}.flips:list_flips"),
    memory=Memory(cells=CELLS, extracting=TRACING, connecting=CELLS + RANKS),
)
