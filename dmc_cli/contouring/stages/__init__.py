"""Hold the stages that several methods of contouring have; each file below those that it needs.

classification    inside bits: the one pass over the values
indexed_classification  the same at several isovalues
nodata_cells      what nodes without data take away
cell_words        the cells of a word at once: which are crossed, which may have several polygons
tracing           the polygons of one cell, followed from face to face
face_decisions    how the surface crosses an ambiguous face
plain_quads       quads where every cell has one vertex
numbering         what the stages number, for those that follow
quad_ranks        the quads' numbers along the grid
color_words       colours of the quads of whole rows
coloring          colours of quads
outcome           what every method's surface has beside its mesh
"""
