"""Declare the method for the registry; imports no Warp."""

from dmc_cli.methods import Cost, Memory, Method, later

CELLS = Cost(word=8, row=60, cell=8 + 4 + 2 * 16)
"""Inside bits, and bits of cells where some do not exist; counts of rows, and their sums; where special cells
are, what they have, and sums of that."""

CROSSINGS = Cost(vertex=4)
"""How far along its edge each vertex lies."""

METHOD = Method(
    title="topologically correct marching cubes",
    faces="triangles",
    options={"triangulation": ("best", "standard"), "border": ("open", "closed")},
    on_surface=frozenset({None}),
    manifold=frozenset({None}),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.kernels:surface_kernels"),
    list_tunnels=later(f"{__package__}.tunnels:list_tunnels"),
    memory=Memory(cells=CELLS, extracting=CROSSINGS),
)
