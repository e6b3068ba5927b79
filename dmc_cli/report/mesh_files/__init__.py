"""Mesh files in: PLY, OBJ and OFF by readers of our own, which keep quads; other formats through meshio."""
