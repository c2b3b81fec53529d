"""Narrow phase: selects the active contacts from the candidate pairs in every step. There are contacts of nodes on
faces, of edges on edges, and of nodes across cracks.
"""
