"""Reader of LS-DYNA keyword decks: keywords, definitions of a deck, sets, and the chosen mesh."""
