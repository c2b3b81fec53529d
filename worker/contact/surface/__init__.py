"""Exposed faces, edges and nodes of the bodies of one rank, and their changes by fracture and erosion."""
