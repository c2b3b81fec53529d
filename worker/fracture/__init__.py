"""Fracture of parts: facets between tets break, nodes separate, cohesive tractions act between crack surfaces, and
fragments are counted.
"""
