"""Prepare a volume's nodes before contouring: what of it becomes the object, nothing of how it is cut.

Each stage makes a volume of a volume, so that contouring stays what it is, and exact.

crop        a box of nodes
band        values mapped so that what lies between two isovalues is inside
runs        nodes of a row that follow each other
joining     runs that the surface does not part
components  their size, volume and bounds
flips       nodes brought to the other side of the isovalue
selection   components kept, cavities filled
kernels     its modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
