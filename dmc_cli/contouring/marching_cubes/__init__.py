"""Contour by marching cubes (Lorensen & Cline 1987): triangles whose vertices lie on the grid's edges.

declaration   what the registry tells of the method, without Warp
extraction    the stages in order; the stages themselves are shared, in `stages/`
kernels       the modules with kernels that a run needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
