"""Read TIFF, OME-TIFF and ImageJ; `reader` is the way in.

ome     what OME metadata promise, checked
reader  the volume of a stack of pages or of files
"""
