"""Take quads away by local collapses until a wanted number is left (`--quads`).

guard       distances between the fine mesh and the coarse one
fine_points  the points that a patch has, looked for side by side
points      the quads nearest to the fine vertices, and the mean side
own_surface  the mesh itself as the surface, where there is no field
places      a vertex put on the surface
costs       what collapses cost
sizes       what they cost more where quads are large
candidates  the quads of each region, from the cheapest on
judge       what an operation must leave
actions     what a sweep tries
fitting     a vertex put where its quads are nearest to the surface and to squares
sweep       collapses, rotations, and vertices that glide
bound       a distance that is proven, and returns to the last mesh that kept it
rounds      the rounds in order
kernels     the modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
