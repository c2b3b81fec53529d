"""The scene: the surface near one rank. A scene has the faces, edges and nodes of the rank, ghosts of other ranks, and
candidate pairs. The modules of this package build a scene, and update it between two searches.
"""
