"""Zones: boxes in space. Different threads sweep the contacts of different zones simultaneously.

Every surface node belongs to the zone in which it enters the scene. Zones are made by recursive halving of boxes. A
contact belongs to the smallest box that contains all its nodes. All contacts of a box are a set. Boxes of the same
level have no node in common, so different threads can sweep their sets. First the sets of the zones are swept, then the
sets of contacts across the border of two zones, and so on; the last set has the contacts across the border of the first
two halves. With one thread there is one zone. The answer does not depend on zones.

Box 1 has all nodes, its halves are the boxes 2 and 3, and the halves of box k are the boxes 2 k and 2 k + 1; the zones
are the boxes of the last level.
"""

import numpy as np

from ...model.state import Floats, Indices, Ints
from ..surface.records import SurfaceNodes

_SAMPLE = 8192
"""Largest number of sampled nodes by which boxes are halved."""
_PER_THREAD = 4
"""Number of zones for each thread; the number is above 1 because contacts are not distributed evenly: a thread that has
finished its zones computes a zone of another thread. Chosen value."""


class Zones:
    """Recursive bisection of the surface nodes. Each box is halved across its longest side. A node that is added later
    belongs to the box that contains it.
    """

    def __init__(self, threads: int) -> None:
        """``threads``: number of threads. The number of zones is chosen from the number of threads, and is a power of
        two.
        """
        self.many = 1 if threads == 1 else 1 << (_PER_THREAD * threads - 1).bit_length()
        """Number of zones."""
        self._surface_nodes: SurfaceNodes | None = None
        self._axis, self._at = np.zeros(self.many - 1, np.int64), np.zeros(self.many - 1)
        """(many - 1,) axis and position of the cut of each part. Part k is divided into the parts 2 k + 1 and 2 k +
        2.
        """
        self._zone: Indices = np.zeros(0, np.int32)

    def of(self, surface_nodes: SurfaceNodes) -> Indices:
        """(surface_nodes,) the zone of each node."""
        if surface_nodes is not self._surface_nodes:
            self._surface_nodes, self._zone = surface_nodes, np.zeros(0, np.int32)
            self._divide(surface_nodes.x[:: 1 + surface_nodes.n // _SAMPLE])
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


def sets(zones: int) -> int:
    """Two counts: sets of contacts with a node that other ranks share, and sets of contacts without such a node. The
    set of box k has the number ``sets(zones) - k``.
    """
    return 2 * zones - 1


def tasks(zones: int) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
    """Returns tasks and starts for a team, for two groups of sets: contacts with a node that other ranks share, and
    contacts without such a node. The order is: all zones, then all larger boxes. Boxes of the same level are swept
    simultaneously.
    """
    first = np.arange(sets(zones))
    border = np.column_stack([first, first + 1])
    starts = np.cumsum([0, *(zones >> k for k in range(zones.bit_length()))])
    return (border, starts), (border + sets(zones), starts)
