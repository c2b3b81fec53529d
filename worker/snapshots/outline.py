"""Outline of fragments: the visible triangles of their surfaces. The outline is complete even if the fragments are
drawn apart.
"""

from dataclasses import dataclass

import numpy as np

from ..mesh.faces import FACES, across
from ..model.ids import places
from ..model.state import WIDE, Block, Floats, Ints, Model


@dataclass
class Outline:
    """Triangles of the outline; each vertex belongs to one fragment."""

    points: Floats
    """(v, 3) positions of the vertices, m."""
    fragment: Ints
    """(v,) number of the fragment of each vertex."""
    triangles: Ints
    """(m, 3) vertices of each triangle, anticlockwise seen from outside."""
    tet: Ints
    """(m,) index in the model of the tet of each triangle."""
    faces: Ints
    """(m, 3) indices of the original nodes of each triangle."""

    def chosen(self, rows: Ints) -> "Outline":
        """Return the outline that consists of the triangles ``rows`` and their vertices."""
        used, corners = np.unique(self.triangles[rows], return_inverse=True)
        triangles = corners.reshape(-1, 3)
        return Outline(self.points[used], self.fragment[used], triangles, self.tet[rows], self.faces[rows])


def find(model: Model, fragment: Ints) -> Outline:
    """Return the outline of a whole model; ``fragment`` (tets,): number of the fragment of each tet.

    The outline contains the exposed faces, the faces between two fragments, and the sides of open cracks. A closed
    crack within a fragment is not part of the outline.
    """
    ids = np.concatenate([np.zeros(0, np.int64), *(block.id for block in model.blocks)])
    order = np.argsort(ids)
    tets, faces, first = [np.zeros(0, np.int64)], [np.zeros((0, 3), np.int64)], 0
    for block in model.blocks:
        tet, face = np.nonzero(_seen(block, ids[order], fragment[order], fragment[first : first + block.n]))
        tets.append(tet + first)
        faces.append(block.tets[tet[:, None], FACES[face]].astype(np.int64))
        first += block.n
    return _over_vertices(model.nodes.x, fragment, np.concatenate(tets), np.concatenate(faces))


def _seen(block: Block, known: Ints, fragments: Ints, own: Ints) -> "np.ndarray":
    """Return (n, 4) True for each face of a block that is part of the outline.

    ``known``: global ids of tets, ascending; ``fragments``: fragment of each of these tets.
    """
    if not len(block.across):
        return np.asarray(across(block.tets.astype(np.int32)) < 0)
    seen = block.across < 0
    if len(block.bond):
        seen |= block.bond == WIDE
        tet, face = np.nonzero((block.bond > 0) & ~seen)
        behind = places(known, block.across[tet, face].astype(np.int64) // 4)
        seen[tet, face] = (behind < 0) | (fragments[behind] != own[tet])
    return seen


def _over_vertices(x: Floats, fragment: Ints, tet: Ints, faces: Ints) -> Outline:
    words = fragment[tet][:, None] * np.int64(max(len(x), 1)) + faces
    vertices, corners = np.unique(words, return_inverse=True)
    of, node = np.divmod(vertices, max(len(x), 1))
    return Outline(x[node], of, corners.reshape(-1, 3), tet, faces)
