"""VTK's XML files of unstructured grids, .vtu: arrays in their encodings, and the mesh that is chosen of them."""
