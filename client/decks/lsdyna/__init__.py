"""Import of LS-DYNA keyword decks."""
