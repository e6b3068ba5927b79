"""Contour by marching cubes with crossings moved to better places, as Macet does.

The idea is that of Macet (C. A. Dietrich and others: Edge transformations for improving mesh quality of
marching cubes, IEEE TVCG, 2009), whose constants are not known here: the steps are our own. Marching cubes
has bad triangles where crossings lie near nodes. So a vertex starts from the middle of its edge and goes to
the surface along the gradient.

declaration      what the registry tells of the method, without Warp
extraction       the stages in order
step_lanes       Newton steps of sixteen vertices side by side
grid_values      values at the corners of cells, virtual nodes and missing values seen to
edge_batch       edges sixteen at a time, and where their vertices go
surface_steps    how vertices go to the surface, near their edges, and towards their neighbours
moved_triangles  the triangles of polygons whose vertices have left their edges
smoothing        sums of neighbours, for their means
edge_guard       back towards the edges where triangles are bad
placement        where a vertex that is drawn back lies
triangle_ranges  which triangles lie round the vertices of some rows
kernels          the modules with kernels that a run needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
