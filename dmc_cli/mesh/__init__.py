"""The mesh, whoever made it: connectivity, renumbering, invariants.

surface          what contouring returns: a mesh that still knows its field
halfedges        faces, twins, a halfedge and the valence of each vertex
working_mesh     a mesh while faces are being removed
valences         valences that follow from twins
compaction       renumbering without gaps
near_frame       the frame in which a mesh far from the origin is changed
check            invariants of a finished mesh
check_halfedges  invariants of a halfedge structure
"""
