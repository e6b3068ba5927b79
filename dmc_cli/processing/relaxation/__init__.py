"""Smooth a mesh on its surface.

step_checks  whether a step may be taken
steps        steps of all vertices, checked afterwards
kernels      the modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
