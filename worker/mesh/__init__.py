"""Meshes of 4-node tetrahedra: made or read, checked, ordered and cached. The entry point is ``build.build``."""
