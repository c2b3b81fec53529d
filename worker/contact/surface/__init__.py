"""Exposed faces, edges and nodes of the bodies of one rank, and the changes of the surface by fracture and erosion."""
