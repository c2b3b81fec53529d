"""Reader of gmsh's .msh files, formats 4.1 and 2.2, text and binary. The modules read the sections and the blocks of
elements, and select the mesh.
"""
