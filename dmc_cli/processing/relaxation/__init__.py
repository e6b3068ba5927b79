"""Smooth a mesh on its surface.

relax_checks  whether a step may be taken
relax         steps of all vertices, checked afterwards
"""
