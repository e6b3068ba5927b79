"""Work on bits by the word: what any stage does with one bit per item.

words       words of 32 bits, sixteen at a time; single bits of one
bit_lists   lists of the set bits of words (a C++ header)
flags       flags, a byte an item, 32 of them at a glance
selection   sets of items, as flags and as lists
kernels     its modules with kernels
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
