"""The surface between two searches: where it is, and whether it still flies as it did."""

import numpy as np

from ...kernels.jit import njit
from ...model.ids import located
from ...model.state import Flags, Floats, Indices, Ints, Nodes, extended
from ...parallel.comm import Comm
from ...parallel.fixed_point import exact_sums
from ..surface.records import SurfaceNodes, merged
from ..surface.surface import Surface
from . import ghosts
from .near_surface import HALO, NearSurface

_LOOKS = np.array([10.0, 20.0, 40.0, 80.0, 160.0, 300.0])
"""Steps of free flight that a search may look ahead."""
_SWEPT = 8.0
"""How many cells a node may sweep in the mean: two along each axis."""
_SPENT = 0.4
"""Of the halo: a node that strays further than this from its path calls for a search of all ranks."""


class SurfaceMotion:
    """The surface of one rank in motion."""

    def __init__(self, found: Surface, nodes: Nodes, mobility: Floats, size: float, comm: Comm) -> None:
        """``mobility`` (nodes, 3): see records.SurfaceNodes; ``size``: the typical one of a face, m."""
        self._comm, self._size = comm, size
        self.until = 0.0
        """Time to which the last search is good if nothing strays, s."""
        self.mobility = mobility
        self.loose = np.zeros(nodes.n, bool)
        """(nodes,) those without tets."""
        self.begin(nodes, nodes.v, 0.0)
        self.follow(found, nodes)

    def follow(self, found: Surface, nodes: Nodes) -> None:
        """Takes a new surface; all ranks take part."""
        self.found = found
        """The surface."""
        self._watched = found.flags | found.waiting
        self.sides = self._whole(nodes, located(nodes.id, found.faces.nodes))
        """What this rank has of the surface."""

    def forget(self, removed: Flags) -> None:
        """Nodes that are ``removed`` (nodes,) do not fly any more."""
        self._watched &= ~removed

    def begin(self, nodes: Nodes, course: Floats, t: float) -> None:
        """Free flight with the velocities ``course`` (nodes, 3) from time ``t`` on."""
        self._x, self._course, self._t = nodes.x.copy(), course.copy(), t

    def spent(self, nodes: Nodes, t: float, dt: float) -> bool:
        """Whether the flight is over, or a node strays so far, a step ``dt`` after ``t``, that another rank may not
        know of it.
        """
        if t + dt > self.until:
            return True
        if self._comm.size == 1:
            return False
        far = _strayed(nodes.x, nodes.v, self._x, self._course, self._watched, dt, t + dt - self._t)
        return bool(far > (_SPENT * HALO * self._size) ** 2)

    def grow(self, parents: Ints) -> None:
        """Takes up copies of nodes: they fly as their parents do."""
        found = self.found
        found.flags = extended(found.flags, found.flags[parents])
        self._watched = extended(self._watched, self._watched[parents])
        self.loose = extended(self.loose, np.zeros(len(parents), bool))
        self._x, self._course = extended(self._x, self._x[parents]), extended(self._course, self._course[parents])

    def here(self, nodes: Nodes) -> SurfaceNodes:
        """Every node of this rank, by local index."""
        every = np.arange(nodes.n, dtype=np.int32)
        return SurfaceNodes(nodes.id, every, nodes.owner, nodes.part, self.mobility, nodes.x, nodes.v, self._course)

    def _whole(self, nodes: Nodes, local: Indices) -> NearSurface:
        """``local`` (f, 4): nodes of the faces. The tet of an edge may be another rank's, and its opposite node held
        here.
        """
        found, here = self.found, self.here(nodes)
        used, opposite = self._watched.copy(), nodes.places(found.edges.nodes[:, 4:])
        used[local] = used[opposite[opposite >= 0]] = True
        far = ghosts.fetch(found.far, found.far_owner, here, self._comm)
        owned = nodes.id[self._watched & nodes.owned]
        return NearSurface(found.faces, found.edges, merged([here.take(used), far]), owned)

    def refresh(self, nodes: Nodes) -> None:
        """Positions and velocities of the surface as they are."""
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
        """How many steps ``dt`` a search may look ahead, and the mean velocity (3,), m/s; all ranks take part.

        As many as leave the space that nodes sweep, in cells of a face's size, a few times what they need at rest:
        about a face's length for all, much more for the few that are fast.
        """
        surface_nodes, owned = self.sides.surface_nodes, self.sides.owned
        v = surface_nodes.course[surface_nodes.places(owned)]
        sums = exact_sums(self._comm, np.column_stack([v, np.ones(len(v))]))
        if sums[3] == 0.0:
            return float(_LOOKS[0]), np.zeros(3)
        drift = sums[:3] / sums[3]
        paths = np.linalg.norm(v - drift, axis=1)[:, None] * (dt / self._size) * _LOOKS
        swept = np.rint(np.minimum((1.0 + paths) ** 3, 2.0**30)).sum(axis=0)
        total = self._comm.sum(np.append(swept, len(v)).astype(np.int64))
        return float(_LOOKS[total[:-1] <= _SWEPT * total[-1]].max(initial=_LOOKS[0])), np.asarray(drift)


@njit(
    "float64(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], boolean[::1], float64, float64)",
    cache=True,
)
def _strayed(x, v, x_then, v_then, flags, dt, ahead):  # type: ignore[no-untyped-def]
    """Largest squared distance, m^2, of a flagged node a step ahead from where free flight would have taken it."""
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
    """Harmonic mean of the sizes of all faces, m: near the small ones where a mesh is graded; 0 without faces."""
    total, count = exact_sums(comm, np.column_stack([1.0 / sizes, np.ones(len(sizes))]))
    return float(count / total) if count > 0.0 else 0.0
