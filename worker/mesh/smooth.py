"""Smoothing of the tets that limit the time step. In an explicit run the tet with the shortest step length limits every
step.

The tets with the shortest step length are processed first. One node of a tet with a small step length is moved along
the gradient of the step length, as far as the worst tet at the node improves. Nodes on the boundary slide along the
boundary, so the body keeps its shape.
"""

import heapq
from typing import Protocol

import numpy as np

from .model import Floats, Ids, TetMesh, step_lengths

_MOVES = np.array([0.6, 0.3, 0.15, 0.07, 0.03])
"""Distances by which a node is moved in successive attempts, divided by the step length of the worst tet."""

_GAIN = 1.01
"""Smallest ratio of the new step length to the old step length of the worst tet at a node. A move with a smaller ratio
is not made."""


_MOST, _PATIENCE = 10_000, 4
"""Two limits of the number of processed tets: a total number, and a number for each tet whose initial step length is
too small."""

_AHEAD = 1.25
"""Largest ratio of the step length of a processed tet to that of a tet that cannot be improved. A tet with a larger
ratio is not processed, because the tet that cannot be improved limits the time step."""


class Slides(Protocol):
    """Constraints on the nodes of a body, which keep its shape."""

    def movable(self, node: int) -> bool:
        """Return True if ``node`` can move."""

    def allowed(self, node: int, start: Floats, places: Floats) -> Floats:
        """Return the allowed positions (k, 3) of ``node`` nearest to ``places``; ``start`` is its present position."""


def smoothed(mesh: TetMesh, skin: Slides, wanted: float) -> TetMesh:
    """Return the mesh after a bounded number of moves that raise step lengths below ``wanted``, m."""
    work = _Smoothing(mesh, skin, wanted)
    waiting = [(length, tet) for tet, length in enumerate(work.lengths.tolist()) if length < wanted]
    heapq.heapify(waiting)
    stuck = wanted
    for _ in range(min(_MOST, _PATIENCE * len(waiting))):
        if not waiting or waiting[0][0] > _AHEAD * stuck:
            break
        length, tet = heapq.heappop(waiting)
        if length == work.lengths[tet]:
            changed = work.raise_tet(tet)
            stuck = stuck if len(changed) else min(stuck, length)
            for other in changed[work.lengths[changed] < wanted]:
                heapq.heappush(waiting, (float(work.lengths[other]), int(other)))
    return TetMesh(work.points, mesh.tets)


class _Smoothing:
    """State of the smoothing: the moved points of the mesh, and the step lengths of the tets."""

    def __init__(self, mesh: TetMesh, skin: Slides, wanted: float) -> None:
        self.points = mesh.points.copy()
        self.tets = mesh.tets
        self.wanted = wanted
        self.lengths = mesh.step_lengths()
        self.skin = skin
        self.by_node = np.argsort(mesh.tets, axis=None, kind="stable") // 4
        self.first = np.concatenate([[0], np.cumsum(np.bincount(mesh.tets.ravel(), minlength=len(mesh.points)))])

    def raise_tet(self, tet: int) -> Ids:
        """Move one node of ``tet`` if this improves the worst tet at the node; return the changed tets at this node."""
        for node in self.tets[tet].tolist():
            if self.skin.movable(node):
                star = self.by_node[self.first[node] : self.first[node + 1]]
                if self._move(node, tet, star):
                    return star
        return np.empty(0, np.int64)

    def _move(self, node: int, tet: int, star: Ids) -> bool:
        place, before = self.points[node], self.lengths[star].min()
        reach = max(float(self.lengths[tet]), 1e-3 * self.wanted)
        slope = self._slope(node, tet, 1e-3 * reach)
        centre = self.points[self.tets[star]].mean(axis=(0, 1)) - place
        ways = np.array([_unit(slope), _unit(centre), _unit(_unit(slope) + _unit(centre))])
        places = self.skin.allowed(node, place, place + (reach * _MOVES[:, None, None] * ways).reshape(-1, 3))
        lengths = self._lengths_at(node, star, places)
        best = int(lengths.min(axis=1).argmax())
        if lengths[best].min() <= before * _GAIN:
            return False
        self.points[node], self.lengths[star] = places[best], lengths[best]
        return True

    def _slope(self, node: int, tet: int, small: float) -> Floats:
        """Return the gradient of the step length of ``tet`` with respect to the position of ``node``, by central
        differences.
        """
        shifts = small * np.concatenate([np.eye(3), -np.eye(3)])
        lengths = self._lengths_at(node, np.array([tet]), self.points[node] + shifts)[:, 0]
        slope: Floats = (lengths[:3] - lengths[3:]) / (2 * small)
        return slope

    def _lengths_at(self, node: int, tets: Ids, places: Floats) -> Floats:
        """Return (k, s) step lengths of the s tets in ``tets``, one row for each of the k positions ``places`` of
        ``node``.
        """
        corners = np.repeat(self.points[self.tets[tets]][None], len(places), axis=0)
        corners[:, self.tets[tets] == node] = places[:, None]
        return step_lengths(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(*corners.shape[:2], 4))


def _unit(vector: Floats) -> Floats:
    length = np.sqrt((vector**2).sum())
    return vector / length if length > 0 else vector
