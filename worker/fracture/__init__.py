"""Fracture: facets between tets break, nodes separate, fragments come into being."""
