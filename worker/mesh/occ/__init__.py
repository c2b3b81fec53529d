"""Bodies drawn and meshed with gmsh's OpenCASCADE kernel, in the child process only."""
