"""Read NRRD; `reader` is the way in.

header    the fields of a header
geometry  where they put the grid
reader    the volume that they describe
"""
