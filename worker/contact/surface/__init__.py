"""Exposed faces, edges and nodes of the bodies of one rank, and what fracture and erosion change of them."""
