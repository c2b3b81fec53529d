"""LS-DYNA keyword decks: keywords, what the deck defines, sets, and the mesh that is chosen of it."""
