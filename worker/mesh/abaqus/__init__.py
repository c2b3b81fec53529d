"""Reader of Abaqus input files. The modules read the text, the keywords, the element types and the definitions of a
file, and select the mesh.
"""
