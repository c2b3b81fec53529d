"""Import of Abaqus/Explicit input files."""
