"""Reader of LS-DYNA keyword decks. The modules read the keywords, the definitions and the sets of a deck, and select
the mesh.
"""
