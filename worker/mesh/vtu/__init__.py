"""Reader of .vtu files, VTK's XML files of unstructured grids. The modules decode the arrays and select the mesh."""
