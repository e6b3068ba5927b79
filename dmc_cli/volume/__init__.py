"""Hold a volume: values on a grid, and where they lie in the world. Nothing here imports Warp.

allocation  memory for values, or a refusal
checks      which values and places will do
mapping     files mapped into memory, and what happens where one shrinks
label_table  what a file calls its labels
volume      the volume
labels      the labels of a label map, and their numbers for kernels
label_guess  whether a volume looks like a label map
space       the axes of the output
tkr         places as FreeSurfer's surfaces have them
histogram   how many nodes have which value
otsu        values parted into classes
suggestions  what kind of volume there is, and which isovalues suit it
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
