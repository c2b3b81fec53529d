"""Tied bonds between non-matching meshes: nodes of one surface tied to faces of another."""
