"""Reader of Abaqus input files: text, keywords, element types, definitions of a file, and the chosen mesh."""
