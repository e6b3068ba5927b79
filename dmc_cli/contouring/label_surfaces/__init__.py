"""Make surfaces of the labels of a label map, smooth without shrinking, by a conforming surface net.

crossings      the grid's edges between two labels, and the cells that have some, in words of bits
cell_loops     how one label's boundary runs through a cell, and which of its edges go together
net            the conforming net: a quad round each crossed edge, shared by the labels on its sides
links          the neighbours and quads of each vertex, and what lies on junctions of labels
pieces         specks, which stay as they are
swept_volumes  what quads sweep as they move
lost_volumes   what no vertex owes, shared out among labels
steps          smoothing, spreading what is owed, giving it back
folds          quads that fold
smoothing      the rounds in order
shells         each label's closed shell, taken from the net
kernels        the modules with kernels that this needs
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
