"""Symmetry planes for nodes without tets: they would fly through a plane that holds the nodes on it only."""

from typing import Self

import numpy as np

from conoid.cases.schema import Case, Symmetry

from .boundaries import PRESCRIBED, Boundary, RigidWalls, mirrored
from .conditions import ON_PLANE
from .state import Model, Nodes


class Mirrors(RigidWalls):
    """Symmetry planes as they are for nodes that have lost their tets: walls, where they meet their mirror images."""

    @classmethod
    def of(cls, case: Case, model: Model, bounds: list[Boundary]) -> Self:
        """A wall for either side of every plane, and the nodes of eroding parts that start on that side of it.

        Nodes of prescribed motion are left alone.
        """
        nodes = model.nodes
        wears = np.array([part.erosion is not None for part in case.parts])[nodes.part]
        for bound in bounds:
            wears[bound.nodes] &= (bound.held_components() != PRESCRIBED).all(axis=1)
        points, normals, held = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((nodes.n, 0), bool)
        for _, spec in case.boundaries_of(Symmetry):
            there = np.array([part.name in spec.parts or not spec.parts for part in case.parts])[nodes.part]
            axis = np.eye(3)["xyz".index(spec.axis)]
            height = nodes.x0 @ axis - spec.at
            off = wears & there & (np.abs(height) > ON_PLANE * max(model.size, abs(spec.at)))
            points = np.vstack([points, spec.at * axis, spec.at * axis])
            normals = np.vstack([normals, axis, -axis])
            held = np.column_stack([held, off & (height > 0.0), off & (height < 0.0)])
        some = held.any(axis=1)
        planes = mirrored(nodes.n, bounds)[some]
        return cls(np.flatnonzero(some).astype(np.int32), points, normals, np.ascontiguousarray(held[some]), planes)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        super().apply(state, dt, self.last_push)
