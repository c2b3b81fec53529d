"""The surface near one rank: the faces, edges and nodes of the rank, ghosts of other ranks, candidate pairs; and
updates of these between two searches.
"""
