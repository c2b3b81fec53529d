"""Fracture: breaking of facets between tets, separation of nodes, cohesive tractions, fragments."""
