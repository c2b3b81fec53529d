"""Fracture: facets between tets break, nodes separate, cohesive tractions act between crack surfaces, fragments are
counted.
"""
