"""Meshes of 4-node tetrahedra. The entry point is ``build.build``, which makes or reads a mesh, checks it, orders its
tets and stores it in a cache.
"""
