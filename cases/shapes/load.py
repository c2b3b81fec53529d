"""The approximate load of a boundary, estimated before there is a mesh."""

from dataclasses import dataclass

_FACTOR, _NODES = 3.0, 10
"""Largest ratio of an estimated number of nodes to the real number, and additional nodes (chosen values). A layer of an
unstructured mesh has a third to three times as many nodes as its volume suggests."""


@dataclass(frozen=True)
class Load:
    """The approximate load of a boundary: faces of a traction, or nodes of a prescribed velocity. A field is None for a
    mesh file, for single tets, and for the other kind of boundary.
    """

    boundary: int
    """Index of the boundary."""
    area: float | None = None
    """Loaded area, m^2."""
    faces: int | None = None
    spread: float = 0.0
    """Uncertainty of the estimated area of the mesh faces, m^2."""
    nodes: int | None = None
    fewest: int = 0
    """Number of nodes in a box that is not widened by half an element on all sides."""
    exact: bool = False
    """Whether nodes, or faces of a mesh file, are counted and not estimated."""

    def agrees(self, nodes: int, faces: int, area: float) -> bool:
        """Whether a mesh has approximately this load: number of driven ``nodes``, or ``faces`` with an ``area``,
        m^2.
        """
        if self.area is not None and faces:
            return abs(area - self.area) <= self.spread
        if self.nodes is None or faces:
            return True
        if self.exact:
            return nodes == self.nodes
        return self.fewest <= _FACTOR * nodes + _NODES and nodes <= _FACTOR * self.nodes + _NODES

    def words(self) -> str:
        """Returns the load in words: ``about 32 faces, 4 mm^2``."""
        if self.area is not None:
            return f"{'' if self.exact else 'about '}{self.faces} faces, {1e6 * self.area:.6g} mm^2"
        if self.nodes is not None:
            return f"{self.nodes} nodes" if self.exact else f"about {self.nodes} nodes"
        return "not known before there is a mesh"
