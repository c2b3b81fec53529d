"""Tied bonds between non-matching meshes: nodes of one surface are tied to faces of another surface."""
