"""The method once more, slow and obvious: plain Python from the paper, not from the kernels.

Reading order: cube, inside, grid, faces, polygons, flips, quads, surface; then irregular,
halfedges, coloring, simplify. A cell, node or face is a tuple of indices along x, y, z (a face or
an edge with its axis in front); arrays are [k, j, i], as in the package.
"""
