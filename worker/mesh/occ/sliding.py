"""Constraints that keep the shape of a drawn body when nodes move. Nodes slide along the faces and edges of the drawn
model.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..model import Floats, Ids

NEAR = 1e-9
"""Largest distance between a node and a cut plane at which the node counts as lying on the plane, in units of the
model."""

Cut = tuple[int, float]
"""A plane on which a body is cut: index of its normal direction, and its position."""
Nearest = Callable[[Floats], Floats]
"""Callback that returns the points (k, 3) of an entity nearest to given points."""


@dataclass(frozen=True)
class Sliding:
    """Constraints on the nodes of a body.

    ``entity`` (n,): index in ``nearest`` of the face or edge of each node, -1 inside of the body, -2 at a corner.
    ``held`` (n, 3): True for each coordinate of a node that a cut plane fixes.
    """

    entity: NDArray[np.int32]
    nearest: tuple[Nearest, ...]
    held: NDArray[np.bool_]

    @classmethod
    def of(cls, gmsh: Any, tags: Ids, points: Floats, cuts: Sequence[Cut]) -> tuple[Self, Floats]:
        """Return the constraints on the nodes ``tags`` of the current model. Also return the ``points`` of the nodes,
        projected onto the planes of ``cuts``.
        """
        entity, nearest = np.full(len(tags), -1, np.int32), list[Nearest]()
        for dimension, number in gmsh.model.getEntities():
            if dimension == 3:
                continue
            nodes = np.asarray(gmsh.model.mesh.getNodes(dimension, number)[0], np.int64)
            place = np.searchsorted(tags, nodes[np.isin(nodes, tags)])
            entity[place] = -2 if dimension == 0 else len(nearest)
            if dimension:
                nearest.append(_nearest(gmsh, dimension, number))
        points, held = points.copy(), np.zeros(points.shape, bool)
        for direction, at in cuts:
            on = np.abs(points[:, direction] - at) < NEAR
            points[on, direction], held[on, direction] = at, True
        return cls(entity, tuple(nearest), held), points

    def movable(self, node: int) -> bool:
        """Return True if ``node`` can move."""
        return bool(self.entity[node] != -2)

    def allowed(self, node: int, start: Floats, places: Floats) -> Floats:
        """Return the allowed positions (k, 3) of ``node`` nearest to ``places``; ``start`` is its present position."""
        on = self.entity[node]
        if on >= 0:
            places = self.nearest[on](places)
        return np.where(self.held[node], start, places)


def _nearest(gmsh: Any, dimension: int, number: int) -> Nearest:
    kind = gmsh.model.getType(dimension, number)
    if kind == "Plane":
        return _flat(gmsh, number)
    return lambda places: np.asarray(
        gmsh.model.getClosestPoint(dimension, number, places.ravel())[0], np.float64
    ).reshape(-1, 3)


def _flat(gmsh: Any, number: int) -> Nearest:
    """Return the callback for a plane face, which projects points onto the plane of the face. (For a curved face gmsh
    searches the nearest point.)
    """
    low, high = gmsh.model.getParametrizationBounds(2, number)
    middle = 0.5 * (np.asarray(low) + np.asarray(high))
    origin = np.asarray(gmsh.model.getValue(2, number, middle), np.float64)
    normal = np.asarray(gmsh.model.getNormal(number, middle), np.float64)

    def nearest(places: Floats) -> Floats:
        away = ((places - origin) * normal).sum(axis=1)
        moved: Floats = places - away[:, None] * normal
        return moved

    return nearest
