"""Hold the stages that several methods of contouring have; each file below those that it needs.

classification    inside bits: the one pass over the values
nodata_cells      what nodes without data take away
cell_words        the cells of a word at once: which are crossed, which may have several polygons
tracing           the polygons of one cell, followed from face to face
face_decisions    how the surface crosses an ambiguous face
outcome           what every method's surface has beside its mesh
"""
