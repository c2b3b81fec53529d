"""Import of input files (decks) of LS-DYNA, Abaqus/Explicit and Radioss as cases."""
