"""Abaqus input files: text, keywords, element types, what the file defines, and the mesh that is chosen of it."""
