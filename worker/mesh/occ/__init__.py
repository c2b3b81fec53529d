"""Bodies drawn with gmsh's OpenCASCADE kernel and meshed there. Only the child process gets here."""
