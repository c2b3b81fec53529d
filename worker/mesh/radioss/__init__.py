"""Reader of Radioss starter decks: blocks, definitions of a deck, groups and surfaces, and the chosen mesh."""
