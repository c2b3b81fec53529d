"""Radioss starter decks: blocks, what the deck defines, groups and surfaces, and the mesh that is chosen of it."""
