"""Contour by surface nets (Gibson 1998), without the relaxation of her label maps: the plain baseline.

A vertex in each active cell at the mean of its crossings, a quad round each crossed edge.

declaration     what the registry tells of the method, without Warp
mean_crossings  vertices at the mean of their cells' crossings
extraction      the stages in order
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
