"""Meshes of 4-node tetrahedra: made, read, checked, ordered and cached. ``build.build`` is the way in."""
