"""Declare the method for the registry; imports no Warp."""

from dmc_cli.methods import Cost, Memory, Method, later

CELLS = Cost(word=8, row=60 + 1, cell=8 + 3)
"""Inside bits, and bits of cells where some do not exist; counts of rows, their sums, and which have poor
triangles; where special cells are, and what is told of them."""

STEPS = Cost(vertex=4 + 12 + 12 + 4 + 1, face=1)
"""How far along its edge each vertex lies, its step from the edge's middle, sums of neighbours and their
number, its axis; which triangles are bad."""

METHOD = Method(
    title="marching cubes, edges moved",
    faces="triangles",
    options={"border": ("open", "closed")},
    on_surface=frozenset(),
    manifold=frozenset({None}),
    extract=later(f"{__package__}.extraction:extract"),
    kernels=later(f"{__package__}.kernels:surface_kernels"),
    memory=Memory(cells=CELLS, extracting=STEPS),
)
