"""Positions and velocities of the surface between two searches. The module also decides whether the candidate list is
still valid.
"""

from typing import ClassVar

import numpy as np

from ...kernels.jit import njit
from ...model.columns import COPIED, ZERO
from ...model.growing import spacious_copy
from ...model.state import Flags, Floats, Nodes
from ...parallel.comm import Comm
from ...parallel.fixed_point import exact_sums
from ..surface.records import SurfaceNodes, merged
from ..surface.surface import Surface
from . import ghosts
from .near_surface import HALO, NearSurface

_HORIZONS = np.array([10.0, 20.0, 40.0, 80.0, 160.0, 300.0])
"""Smallest and largest horizon of a search, in steps. The horizon is the time for which the result is valid."""
_SWEPT = 8.0
"""Largest mean number of cells that a node may sweep in a horizon. Chosen value: two cells along each axis."""
_SPENT = 0.4
"""Fraction of the width of the halo. If a node departs from its extrapolated position by more than this fraction of the
width, all ranks must search."""


class SurfaceMotion:
    """Motion of the surface of one rank after the last search."""

    COLUMNS: ClassVar = {"mobility": COPIED, "_watched": COPIED, "_x": COPIED, "_course": COPIED, "loose": ZERO}
    """Columns with one value for each node (model/columns.py)."""

    def __init__(self, found: Surface, nodes: Nodes, mobility: Floats, size: float, comm: Comm) -> None:
        """``mobility`` (nodes, 3): see records.SurfaceNodes; ``size``: typical size of a face, m."""
        self._comm, self._size = comm, size
        self.until = 0.0
        """Simulated time up to which the last search is valid, s, if no node departs too far."""
        self.mobility = mobility
        self.loose = np.zeros(nodes.n, bool)
        """(nodes,) True for each node that has no tets."""
        self.begin(nodes, nodes.v, 0.0)
        self.follow(found, nodes)

    def follow(self, found: Surface, nodes: Nodes) -> None:
        """Replaces the surface by a new one. Collective."""
        self.found = found
        """Returns the surface of this rank."""
        self._watched = found.flags | found.waiting
        self.sides = self._whole(nodes)
        """Returns faces, edges and nodes of the surface."""

    def forget(self, removed: Flags) -> None:
        """Marks the nodes ``removed`` (nodes,) as removed. The motion ignores removed nodes from now on."""
        self._watched &= ~removed

    def begin(self, nodes: Nodes, course: Floats, t: float) -> None:
        """Stores the positions at the simulated time ``t`` and the extrapolated velocities ``course`` (nodes, 3)."""
        self._x, self._course, self._t = spacious_copy(nodes.x), spacious_copy(course), t

    def spent(self, nodes: Nodes, t: float, dt: float) -> bool:
        """Returns True if the candidate list will be invalid at the simulated time ``t`` + ``dt``. There are two
        possible reasons: the horizon has passed, or a node departs so far that its ghost may be missing on another
        rank.
        """
        if t + dt > self.until:
            return True
        if self._comm.size == 1:
            return False
        far = _strayed(nodes.x, nodes.v, self._x, self._course, self._watched, dt, t + dt - self._t)
        return bool(far > (_SPENT * HALO * self._size) ** 2)

    def here(self, nodes: Nodes) -> SurfaceNodes:
        """Returns all nodes of this rank. The order is that of the local indices."""
        every = np.arange(nodes.n, dtype=np.int32)
        return SurfaceNodes(nodes.id, every, nodes.owner, nodes.part, self.mobility, nodes.x, nodes.v, self._course)

    def _whole(self, nodes: Nodes) -> NearSurface:
        """Returns the faces, edges and nodes of the surface. With several ranks, a tet at an edge may be on another
        rank although the opposite node of the tet is on this rank.
        """
        found, here = self.found, self.here(nodes)
        used = self._watched.copy()
        used[found.corners.reshape(-1)] = True
        if self._comm.size > 1:
            opposite = nodes.places(found.edges.nodes[:, 4:])
            used[opposite[opposite >= 0]] = True
        far = ghosts.fetch(found.far, found.far_owner, here, self._comm)
        owned = nodes.id[self._watched & nodes.owned]
        return NearSurface(found.faces, found.edges, merged([here.take(used), far]), owned)

    def refresh(self, nodes: Nodes) -> None:
        """Updates positions and velocities of the surface."""
        surface_nodes, found = self.sides.surface_nodes, self.found
        held = surface_nodes.local >= 0
        local = surface_nodes.local[held]
        surface_nodes.x[held], surface_nodes.v[held], surface_nodes.course[held] = (
            nodes.x[local],
            nodes.v[local],
            self._course[local],
        )
        far = ghosts.fetch(found.far, found.far_owner, self.here(nodes), self._comm)
        places = surface_nodes.places(far.id)
        surface_nodes.x[places], surface_nodes.v[places], surface_nodes.course[places] = far.x, far.v, far.course

    def foresight(self, dt: float) -> tuple[float, Floats]:
        """Returns the horizon of a search in steps of length ``dt``, and the mean velocity (3,), m/s. Collective.

        The horizon is as long as possible. The limit of the horizon is that the mean volume swept by a node is below
        ``_SWEPT`` cells of the size of a face. The swept length is about the length of a face if all nodes move; the
        swept length is much longer if only few nodes are fast.
        """
        surface_nodes, owned = self.sides.surface_nodes, self.sides.owned
        v = surface_nodes.course[surface_nodes.places(owned)]
        sums = exact_sums(self._comm, np.column_stack([v, np.ones(len(v))]))
        if sums[3] == 0.0:
            return float(_HORIZONS[0]), np.zeros(3)
        drift = sums[:3] / sums[3]
        paths = np.linalg.norm(v - drift, axis=1)[:, None] * (dt / self._size) * _HORIZONS
        cells = 1.0 + paths
        swept = np.rint(np.minimum(cells * cells * cells, 2.0**30)).sum(axis=0)
        total = self._comm.sum(np.append(swept, len(v)).astype(np.int64))
        return float(_HORIZONS[total[:-1] <= _SWEPT * total[-1]].max(initial=_HORIZONS[0])), np.asarray(drift)


@njit(
    "float64(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], boolean[::1], float64, float64)",
    cache=True,
)
def _strayed(x, v, x_then, v_then, flags, dt, ahead):  # type: ignore[no-untyped-def]
    """Returns the largest squared distance, m^2, of a flagged node from its extrapolated position at the end of the
    step.
    """
    most = 0.0
    for a in range(len(x)):
        if flags[a]:
            far = 0.0
            for i in range(3):
                off = x[a, i] + dt * v[a, i] - (x_then[a, i] + ahead * v_then[a, i])
                far += off * off
            most = max(most, far)
    return most


def typical(sizes: Floats, comm: Comm) -> float:
    """Harmonic mean of the sizes of all faces, m; 0 if there are no faces. In a graded mesh the small faces dominate
    the harmonic mean.
    """
    total, count = exact_sums(comm, np.column_stack([1.0 / sizes, np.ones(len(sizes))]))
    return float(count / total) if count > 0.0 else 0.0
