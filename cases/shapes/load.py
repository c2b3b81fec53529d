"""Estimate of the faces or nodes on which a boundary acts, before there is a mesh."""

from dataclasses import dataclass

_FACTOR, _NODES = 3.0, 10
"""Largest ratio of an estimated number of nodes to the real number, and a number of nodes that is added to this limit
(chosen values). A layer of an unstructured mesh has a third to three times as many nodes as its volume suggests."""


@dataclass(frozen=True)
class Load:
    """The estimate for one boundary: the faces on which a traction acts, or the nodes with a prescribed velocity. A
    field is None if the boundary is of the other kind, and for mesh files and single tets.
    """

    boundary: int
    """Index of the boundary in the case."""
    area: float | None = None
    """Area of the loaded faces, m^2."""
    faces: int | None = None
    spread: float = 0.0
    """Largest expected difference of the area of the mesh faces from ``area``, m^2."""
    nodes: int | None = None
    fewest: int = 0
    """Smallest expected number of nodes: those in the box of the boundary; ``nodes`` counts those in the box widened by
    half an element on all sides."""
    exact: bool = False
    """Whether the nodes, or the faces of a mesh file, were counted and not estimated."""

    def agrees(self, nodes: int, faces: int, area: float) -> bool:
        """Whether a mesh agrees with the estimate. ``nodes``: number of its driven nodes; ``faces``: number of its
        loaded faces; ``area``: their area, m^2.
        """
        if self.area is not None and faces:
            return abs(area - self.area) <= self.spread
        if self.nodes is None or faces:
            return True
        if self.exact:
            return nodes == self.nodes
        return self.fewest <= _FACTOR * nodes + _NODES and nodes <= _FACTOR * self.nodes + _NODES

    def words(self) -> str:
        """Returns the estimate as text: ``about 32 faces, 4 mm^2``."""
        if self.area is not None:
            return f"{'' if self.exact else 'about '}{self.faces} faces, {1e6 * self.area:.6g} mm^2"
        if self.nodes is not None:
            return f"{self.nodes} nodes" if self.exact else f"about {self.nodes} nodes"
        return "not known before there is a mesh"
