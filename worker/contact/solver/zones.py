"""Zones: parts of a scene whose contacts threads sweep side by side.

Every node of a surface_nodes is of a zone, a box in space, by where it is when it comes into the scene. Contacts all of
whose nodes are of one zone are a set: two such sets have no node in common. All others, those across the borders of
zones, are one set more, which is swept after these. With one thread there is one zone. No bit of the answer depends on
zones.
"""

import numpy as np

from ...model.state import Floats, Indices, Ints
from ..surface.records import SurfaceNodes

_PER_THREAD = 4
"""Zones of a thread: contacts are not spread evenly, and a thread that has done with its own takes another's. Chosen.
"""


class Zones:
    """Halves of halves of a surface_nodes, each across its longest side; nodes that come later are of the box they are
    in.
    """

    def __init__(self, threads: int) -> None:
        """A power of two, by the ``threads``."""
        self.many = 1 if threads == 1 else 1 << (_PER_THREAD * threads - 1).bit_length()
        """How many."""
        self._surface_nodes: SurfaceNodes | None = None
        self._axis, self._at = np.zeros(self.many - 1, np.int64), np.zeros(self.many - 1)
        """(many - 1,) across which axis, and where, each part is halved; part k becomes the parts 2 k + 1 and 2 k + 2.
        """
        self._zone: Indices = np.zeros(0, np.int32)

    def of(self, surface_nodes: SurfaceNodes) -> Indices:
        """(surface_nodes,) the zone of each node."""
        if surface_nodes is not self._surface_nodes:
            self._surface_nodes, self._zone = surface_nodes, np.zeros(0, np.int32)
            self._divide(surface_nodes.x)
        if len(self._zone) < surface_nodes.n:
            self._zone = np.concatenate([self._zone, self._located(surface_nodes.x[len(self._zone) :])])
        return self._zone

    def _divide(self, x: Floats) -> None:
        parts = [np.arange(len(x))]
        for k in range(self.many - 1):
            points = x[parts[k]]
            if len(points):
                self._axis[k] = np.argmax(np.ptp(points, axis=0))
                self._at[k] = np.median(points[:, self._axis[k]])
            high = points[:, self._axis[k]] >= self._at[k]
            parts += [parts[k][~high], parts[k][high]]

    def _located(self, x: Floats) -> Indices:
        part = np.zeros(len(x), np.int64)
        every = np.arange(len(x))
        for _ in range(self.many.bit_length() - 1):
            part = 2 * part + 1 + (x[every, self._axis[part]] >= self._at[part])
        return (part - (self.many - 1)).astype(np.int32)


def tasks(zones: int) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
    """Tasks and starts, as a team takes them, of the sets of contacts with a node that other ranks share, and of the
    sets of those without: every zone, and then what lies across.
    """
    first = np.arange(zones + 1)
    border, starts = np.column_stack([first, first + 1]), np.array([0, zones, zones + 1])
    return (border, starts), (border + zones + 1, starts)
