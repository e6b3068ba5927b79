"""Prepare a volume's nodes before contouring: what of it becomes the object, nothing of how it is cut.

Each stage makes a volume of a volume, so that contouring stays what it is, and exact.

crop        a box of nodes
band        values mapped so that what lies between two isovalues is inside
blending    sums of neighbouring values along an axis
filtering   values smoothed, or taken at other distances
runs        nodes of a row that follow each other
joining     runs that the surface does not part
components  their size, volume and bounds
flips       nodes brought to the other side of the isovalue
morphology  sets of nodes opened and closed by balls
selection   the object opened and closed, components kept, cavities filled
label_runs  nodes of a row that have one label
label_resampling, label_selection  what the others do, for labels
profile     what goes on along the slices
table       what a scan's body lies on, cut away
kernels     its modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
