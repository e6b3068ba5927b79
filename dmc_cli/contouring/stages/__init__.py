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
plain_twins       twins through faces that are not ambiguous
face_twins        neighbours of quads through any cell face
color_words       colours of the quads of whole rows
coloring          colours of quads
case_polygons     the polygons of all 256 cases, inside corners separated
triangulations    which triangles these polygons may have, and which they have in the papers
edge_rows         the crossed edges of a word
edge_ranks        numbers of the crossed edges, and counts of triangles, row by row
edge_vertices     a vertex on each crossed edge
cell_edges        the vertices on the edges of a cell
polygon_lists     polygons of a size side by side, each with its best triangles
cell_triangles    the triangles of cells that the tables of cases serve
special_list      cells that may have several polygons or a tunnel
second_fans       vertices of their own for fans of faces beside missing cells
outcome           what every method's surface has beside its mesh
edge_surface      the stages of a method whose vertices lie on edges
"""
