"""Import of decks of other codes (LS-DYNA, Abaqus/Explicit, Radioss) as cases."""
