"""Constraints that keep the shape of a body when nodes move. A node of a flat face remains in the face; a node of a
round face remains on that face.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from conoid.cases.model.bodies import Box, Cylinder, Plate, Sphere, Tube
from conoid.cases.shapes.geometry import Generated, cut_directions

from .faces import boundary_faces
from .frame import block
from .model import Floats, TetMesh

_NEAR = 1e-9
"""Largest distance between a node and a surface of the body at which the node counts as lying on the surface, in units
of ``scale``."""


@dataclass(frozen=True)
class Skin:
    """Constraints on the nodes of a body.

    ``held`` (n, 3): True for each coordinate of a node that is fixed. ``radius`` (n,): fixed distance from the axis
    (from the centre for a sphere), 0 for a free node. ``round``: number of coordinates a, b, c from which the radius is
    computed.
    """

    held: NDArray[np.bool_]
    radius: Floats
    round: int

    @classmethod
    def of(cls, body: Generated, mesh: TetMesh, scale: float) -> tuple[Self, Floats]:
        """Return the constraints of a ``mesh`` in the frame of the body. Also return the points of the mesh, projected
        onto the surface of the body. Lengths are divided by ``scale``.
        """
        points, round_in = mesh.points.copy(), 3 if isinstance(body, Sphere) else 2
        skin = np.zeros(len(points), bool)
        skin[boundary_faces(mesh.tets)] = True
        held = np.zeros(points.shape, bool)
        for direction, planes in _planes(body).items():
            for plane in planes:
                on = skin & (np.abs(points[:, direction] - plane / scale) < _NEAR)
                points[on, direction], held[on, direction] = plane / scale, True
        distance, radius = np.linalg.norm(points[:, :round_in], axis=1), np.zeros(len(points))
        for length in _radii(body):
            radius[skin & (np.abs(distance - length / scale) < 1e3 * _NEAR)] = length / scale
        held[skin & (radius == 0) & ~held.any(axis=1)] = True
        return cls(held, radius, round_in), points

    def movable(self, node: int) -> bool:
        """Return True if ``node`` can move."""
        return int(self.held[node].sum()) + int(self.radius[node] > 0) < 3

    def allowed(self, node: int, start: Floats, places: Floats) -> Floats:
        """Return the allowed positions (k, 3) of ``node`` nearest to ``places``; ``start`` is its present position."""
        places = np.where(self.held[node], start, places)
        if self.radius[node] > 0:
            places[:, : self.round] *= (self.radius[node] / np.linalg.norm(places[:, : self.round], axis=1))[:, None]
        return places


def _planes(body: Generated) -> dict[int, tuple[float, ...]]:
    """Return the positions, m, of the flat faces of a body, for each direction."""
    low, high = block(body)
    if isinstance(body, Box | Plate):
        return {i: (low[i], high[i]) for i in range(3)}
    cuts = dict.fromkeys(range(len(cut_directions(body, body.axis))), (0.0,))
    return {**cuts} if isinstance(body, Sphere) else {**cuts, 2: (low[2], high[2])}


def _radii(body: Generated) -> tuple[float, ...]:
    if isinstance(body, Tube):
        return body.inner_radius, body.radius
    return (body.radius,) if isinstance(body, Cylinder | Sphere) else ()
