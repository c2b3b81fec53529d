"""Reader of gmsh's .msh files, formats 4.1 and 2.2, text and binary: sections, blocks of elements, the chosen mesh."""
