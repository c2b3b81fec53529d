"""Narrow phase: selects the active contacts from the candidate pairs in every step. The contacts are of nodes on faces,
edges on edges, and nodes across cracks.
"""
