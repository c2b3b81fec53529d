"""The surface between two searches: where it is, which way it looks, and whether it still flies as it did."""

import numpy as np

from ..jit import njit
from ..migration.parcel import Parcel
from ..parallel.comm import Comm
from ..parallel.fixed_point import exact_sums
from ..parallel.ownership import Neighbour, complete
from ..state import Floats, Indices, Ints, Nodes, extended
from . import ghosts, sweeps
from .records import Crowd, merged
from .scene import Sides
from .surface import Surface

_NORMAL_TAG = 14
_LOOKS = np.array([10.0, 20.0, 40.0, 80.0, 160.0, 300.0])
"""Steps of free flight that a search may look ahead."""
_SWEPT = 8.0
"""How many cells a node may sweep in the mean: two along each axis."""
_SPENT = 0.4
"""Of the skin: a node that strays further than this from its path calls for a new search."""
_NOTHING = 1e-300
"""m^2: keeps a face of no area from a division by zero."""


class Flight:
    """The surface of one rank in motion."""

    def __init__(
        self, found: Surface, nodes: Nodes, mobility: Floats, skin: float, neighbours: list[Neighbour], comm: Comm
    ) -> None:
        """``mobility`` (nodes, 3): see records.Crowd; ``skin``: of the typical size of a face."""
        self._neighbours, self._comm = neighbours, comm
        self.size = _typical(found.faces.size, comm)
        """Of the faces of all ranks at the start, m."""
        self._skin = skin * self.size
        self.until = 0.0
        """Time to which the last search is good if nothing strays, s."""
        self.begin(nodes, nodes.v, 0.0)
        self.follow(found, nodes, mobility)

    def follow(self, found: Surface, nodes: Nodes, mobility: Floats) -> None:
        """Takes a new surface; all ranks take part."""
        self._found, self.mobility = found, mobility
        local = np.searchsorted(nodes.id, found.faces.nodes).astype(np.int32)
        self._face_nodes = np.ascontiguousarray(local[:, :3])
        self.sides = self._whole(nodes, local)
        """What this rank has of the surface."""

    def begin(self, nodes: Nodes, course: Floats, t: float) -> None:
        """Free flight with the velocities ``course`` (nodes, 3) from time ``t`` on."""
        self._x, self._course, self._t = nodes.x.copy(), course.copy(), t

    def spent(self, nodes: Nodes, t: float, dt: float) -> bool:
        """Whether the flight is over, or a node strays by ``_SPENT`` of the skin, a step ``dt`` after ``t``."""
        if t + dt > self.until:
            return True
        far = _strayed(nodes.x, nodes.v, self._x, self._course, self._found.flags, dt, t + dt - self._t)
        return bool(far > (_SPENT * self._skin) ** 2)

    def keep(self, parcel: Parcel) -> None:
        """Adds the surface and its flight to a parcel."""
        parcel.known["flight"] = self.size, self._skin, self._t, self.until
        parcel.nodes["flight.flags"], parcel.nodes["flight.x"] = self._found.flags, self._x
        parcel.nodes["flight.course"] = self._course

    def resume(self, found: Surface, nodes: Nodes, mobility: Floats, parcel: Parcel) -> None:
        """Takes them back, but for the surface, which is ``found``; all ranks take part."""
        self.size, self._skin, self._t, self.until = parcel.known["flight"]
        self._x, self._course = parcel.nodes["flight.x"], parcel.nodes["flight.course"]
        self.follow(found, nodes, mobility)

    def grow(self, parents: Ints) -> None:
        """Takes up copies of nodes: they fly as their parents do."""
        found = self._found
        found.flags = extended(found.flags, found.flags[parents])
        self._x, self._course = extended(self._x, self._x[parents]), extended(self._course, self._course[parents])

    def here(self, nodes: Nodes) -> Crowd:
        """Every node of this rank, by local index."""
        every = np.arange(nodes.n, dtype=np.int32)
        return Crowd(nodes.id, every, nodes.owner, nodes.part, self.mobility, nodes.x, nodes.v, self._course)

    def _whole(self, nodes: Nodes, local: Indices) -> Sides:
        """``local`` (f, 4): nodes of the faces."""
        found, here = self._found, self.here(nodes)
        used = found.flags.copy()
        used[local] = True
        far = ghosts.fetch(found.far, found.far_owner, here, self._comm)
        slaves = nodes.id[found.flags & nodes.owned]
        return Sides(found.faces, found.edges, merged([here.take(used), far]), slaves, self._skin)

    def refresh(self, nodes: Nodes) -> None:
        """Positions and velocities of the surface as they are."""
        crowd, found = self.sides.crowd, self._found
        held = crowd.local >= 0
        local = crowd.local[held]
        crowd.x[held], crowd.v[held], crowd.course[held] = nodes.x[local], nodes.v[local], self._course[local]
        far = ghosts.fetch(found.far, found.far_owner, self.here(nodes), self._comm)
        places = crowd.places(far.id)
        crowd.x[places], crowd.v[places], crowd.course[places] = far.x, far.v, far.course

    def normals(self, nodes: Nodes) -> Floats:
        """(nodes, 9) means over a node's faces, by area, of n and n n (meetings.node_face), zero off the surface; all
        ranks take part.
        """
        sums = np.zeros((nodes.n, 9), np.int64)
        _add_normals(sums, nodes.x, self._face_nodes, sweeps.SHARES / self.size**2)
        complete(self._comm, self._neighbours, sums, _NORMAL_TAG)
        area = sums[:, 3:6].sum(axis=1)
        return np.asarray(sums / np.where(area > 0, area, 1)[:, None])

    def foresight(self, dt: float) -> tuple[float, Floats]:
        """How many steps ``dt`` a search may look ahead, and the mean velocity (3,), m/s; all ranks take part.

        As many as leave the space that nodes sweep, in cells of a face's size, a few times what they need at rest:
        about a face's length for all, much more for the few that are fast.
        """
        crowd, slaves = self.sides.crowd, self.sides.slaves
        v = crowd.course[crowd.places(slaves)]
        sums = exact_sums(self._comm, np.column_stack([v, np.ones(len(v))]))
        if sums[3] == 0.0:
            return float(_LOOKS[0]), np.zeros(3)
        drift = sums[:3] / sums[3]
        paths = np.linalg.norm(v - drift, axis=1)[:, None] * (dt / self.size) * _LOOKS
        swept = np.rint(np.minimum((1.0 + paths) ** 3, 2.0**30)).sum(axis=0)
        total = self._comm.sum(np.append(swept, len(v)).astype(np.int64))
        return float(_LOOKS[total[:-1] <= _SWEPT * total[-1]].max(initial=_LOOKS[0])), np.asarray(drift)


@njit("void(int64[:, ::1], float64[:, ::1], int32[:, ::1], float64)", cache=True, error_model="numpy")
def _add_normals(sums, x, faces, scale):  # type: ignore[no-untyped-def]
    """Adds n and n n of faces (f, 3), times their area in quanta of 1 / ``scale``, to the sums (nodes, 9) of their
    nodes.
    """
    area, moments = np.empty(3), np.empty(9)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            area[i] = (x[b, j] - x[a, j]) * (x[c, k] - x[a, k]) - (x[b, k] - x[a, k]) * (x[c, j] - x[a, j])
        size = max(np.sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]), _NOTHING)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            moments[i], moments[3 + i] = area[i], area[i] * area[i] / size
            moments[6 + i] = area[j] * area[k] / size
        for i in range(9):
            quanta = np.int64(np.rint(moments[i] * scale))
            for m in range(3):
                sums[faces[f, m], i] += quanta


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


def _typical(sizes: Floats, comm: Comm) -> float:
    """Harmonic mean of the sizes of all faces, m: near the small ones where a mesh is graded."""
    total, count = exact_sums(comm, np.column_stack([1.0 / sizes, np.ones(len(sizes))]))
    return float(count / total)
