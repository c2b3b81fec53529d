"""Reader of Radioss starter decks. The modules read the blocks, the definitions, the groups and the surfaces of a deck,
and select the mesh.
"""
