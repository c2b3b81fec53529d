"""A tet with edges of 1 m, from which the tests of candidate pairs make clouds of tets."""

import numpy as np

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
FACES = np.array([[0, 2, 1, 3], [0, 1, 3, 2], [1, 2, 3, 0], [0, 3, 2, 1]])
"""(4, 4) corners of the faces of the tet, counter-clockwise seen from outside; the opposite node is last."""
EDGES = np.array([
    [0, 1, 2, 3, 3, 2], [0, 2, 3, 1, 1, 3], [0, 3, 1, 2, 2, 1],
    [1, 2, 0, 3, 3, 0], [1, 3, 2, 0, 0, 2], [2, 3, 0, 1, 1, 0],
])  # fmt: skip
"""(6, 6) for each edge of the tet: the two ends, the third nodes of its two faces, and the opposite nodes."""
