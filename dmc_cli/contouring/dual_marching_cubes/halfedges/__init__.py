"""Build the halfedges of a surface from its grid (Grosso & Zint 2021, section 3.2).

grid_twins    twins of halfedges, from the cell faces' segments
plain_rings   a halfedge and the valence of ordinary cells' vertices
vertex_rings  a halfedge and the valence of each vertex
connect       the steps in order
"""
