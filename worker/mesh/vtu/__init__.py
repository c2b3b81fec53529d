"""Reader of VTK's XML files of unstructured grids, .vtu: arrays in their encodings, and the chosen mesh."""
