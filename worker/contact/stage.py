"""Contact in the time step: search when it is due, find who meets, push them apart, book what it cost.

Every meeting is computed by one rank, the one that owns its node or has its first edge; ghosts of other ranks'
surfaces make that possible. The impulses on a node are completed over all ranks that push or hold it, so that
everybody ends with the same velocity, to the bit.
"""

import math

import numpy as np
from numba import njit

from conoid.cases.schema import Case

from ..boundaries import Boundary, PrescribedVelocity, SymmetryPlane
from ..clock import Clock
from ..materials.models import BULK, DENSITY, SHEAR
from ..parallel import fixed_point
from ..parallel.comm import Comm
from ..parallel.fixed_point import exact_sums
from ..parallel.ownership import Neighbour, SharedSum
from ..state import Flags, Floats, Model, Nodes
from ..timers import Timers
from . import ghosts, meetings, pairing, scene, surface, sweeps
from .records import Crowd, merged
from .scene import Rules, Scene, Sides

_NORMAL_TAG = 14
_SHORTEST, _LONGEST = 10.0, 300.0
"""Steps of free flight that a search looks ahead: as many as the fastest takes past a face, within these bounds."""
_SPENT = 0.4
"""Of the skin: a node that strays further than this from its path calls for a new search."""
_KINEMATIC = 2.0
"""One over the share of a tet's altitude that anything may pass in a step."""


class Contact(Boundary):
    """The contact of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, exposed: Flags, neighbours: list[Neighbour], bounds: list[Boundary],
        comm: Comm, clock: Clock, timers: Timers,
    ) -> None:  # fmt: skip
        super().__init__(np.arange(model.nodes.n, dtype=np.int32))
        assert case.contact is not None
        self._sweeps = case.contact.sweeps
        self._comm, self._neighbours, self._clock, self._timers = comm, neighbours, clock, timers
        self._mobility, planes = _mobility(model.nodes, bounds)
        self._surface = surface.build(model, exposed, planes, neighbours, comm, case.contact.edges)
        self._mu = pairing.friction(case)
        ids = self._surface.faces.nodes[:, :3]
        self._face_nodes = np.searchsorted(model.nodes.id, ids).astype(np.int32).reshape(-1, 3)
        size = _typical(self._surface.faces.size, comm)
        self._rules = Rules(case.contact.domain, ~np.isnan(self._mu), 2.0 * size)
        self._size = size
        self._sides = self._whole_sides(model.nodes, case.contact.skin * size)
        largest, fastest = _bounds(model, comm)
        self._scale = fixed_point.scale_for(largest * fastest)
        self._joule = math.ldexp(1.0, 30 - math.frexp(largest * fastest * fastest)[1])
        self._friction = np.zeros(2, np.int64)
        self._parts = np.zeros((len(case.parts), 3), np.int64)
        self._scene: Scene | None = None
        self._x, self._v, self._t, self._until = model.nodes.x, model.nodes.v, 0.0, 0.0
        """Where the nodes of the surface were at the last search, and how fast."""
        self.due = True
        """Whether the next step begins with a search."""
        self.limit = 0.0
        """One over the step in which nothing passes more than half a tet, 1/s."""
        self.searches = self.meetings = 0

    @property
    def candidates(self) -> int:
        """Pairs that this rank looks at in a step."""
        return 0 if self._scene is None else len(self._scene.node_face) + len(self._scene.edge_edge)

    @property
    def faces_sent(self) -> int:
        """Faces that this rank has sent to others for the present search."""
        return 0 if self._scene is None else self._scene.faces_sent

    def friction_work(self) -> float:
        """Heat of friction so far of the meetings of all ranks, J; all ranks take part."""
        high, low = (int(word) for word in self._comm.sum(self._friction))
        return math.ldexp(high * 2**30 + low, -30) / self._joule

    def impulses(self) -> Floats:
        """(parts, 3) what contact has given each part so far, N s; all ranks take part."""
        return np.asarray(self._comm.sum(self._parts) / self._scale)

    def note(self, state: Nodes) -> None:
        with self._timers.phase("contact"):
            if self._scene is not None:
                self._look(self._scene, state)
                self._book(self._scene)
                self._scene.total[:] = 0
            if (self.due or self._scene is None) and self._clock.dt > 0.0:
                self._search(state)

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        if dt > 0.0 and self._scene is not None:
            with self._timers.phase("contact"):
                self._push(self._scene, state, dt, t)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        if self._scene is not None:
            self._scene.free()

    def _look(self, now: Scene, state: Nodes) -> None:
        _gather(now.before, state.v, now.held, now.local)
        now.copies.note(state)

    def _search(self, state: Nodes) -> None:
        """Looks for candidates; all ranks take part."""
        clock, sides = self._clock, self._sides
        if self._scene is not None:
            self._scene.free()
        self._refresh(state)
        fastest, drift, lowest = self._extremes()
        self.limit = _KINEMATIC * fastest / lowest
        steps = min(max(self._size / (fastest * clock.dt), _SHORTEST), _LONGEST) if fastest > 0.0 else _LONGEST
        self._scene = scene.build(sides, self._rules, steps * clock.dt, drift, state, self._neighbours, self._comm)
        self._look(self._scene, state)
        self._scene.normals[self._scene.held] = self._normals(state)[self._scene.local]
        self._x, self._v, self._t = state.x.copy(), state.v.copy(), clock.t
        self._until = clock.t + steps * clock.dt
        self.due = False
        self.searches += 1

    def spent(self, state: Nodes) -> bool:
        """Whether a node of the surface will leave, in a step more, what the last search has allowed for."""
        ahead = self._clock.t + self._clock.dt
        if ahead > self._until:
            return True
        with self._timers.phase("contact"):
            then = (self._x, self._v)
            far = _strayed(state.x, state.v, *then, self._surface.flags, self._clock.dt, ahead - self._t)
            return bool(far > (_SPENT * self._sides.skin) ** 2)

    def _here(self, nodes: Nodes) -> Crowd:
        every = np.arange(nodes.n, dtype=np.int32)
        return Crowd(nodes.id, every, nodes.owner, nodes.part, self._mobility, nodes.x, nodes.v)

    def _whole_sides(self, nodes: Nodes, skin: float) -> Sides:
        found, here = self._surface, self._here(nodes)
        used = found.flags.copy()
        used[np.searchsorted(nodes.id, found.faces.nodes.reshape(-1))] = True
        far = ghosts.fetch(found.far, found.far_owner, here, self._comm)
        slaves = nodes.id[found.flags & nodes.owned]
        return Sides(found.faces, found.edges, merged([here.take(used), far]), slaves, skin)

    def _refresh(self, nodes: Nodes) -> None:
        """Positions and velocities of the surface as they are."""
        crowd, found = self._sides.crowd, self._surface
        held = crowd.local >= 0
        crowd.x[held], crowd.v[held] = nodes.x[crowd.local[held]], nodes.v[crowd.local[held]]
        far = ghosts.fetch(found.far, found.far_owner, self._here(nodes), self._comm)
        places = crowd.places(far.id)
        crowd.x[places], crowd.v[places] = far.x, far.v

    def _normals(self, nodes: Nodes) -> Floats:
        """(nodes, 3) unit outward normals of the nodes of the surface, zero off it; all ranks take part."""
        sums = np.zeros((nodes.n, 3), np.int64)
        _add_normals(sums, nodes.x, self._face_nodes, sweeps.SHARES / self._size**2)
        shared = SharedSum(self._comm, self._neighbours, sums, _NORMAL_TAG)
        shared.begin()
        shared.finish()
        shared.free()
        length = np.sqrt((sums.astype(np.float64) ** 2).sum(axis=1))
        return np.asarray(sums / np.where(length > 0.0, length, 1.0)[:, None])

    def _extremes(self) -> tuple[float, Floats, float]:
        """Largest difference of velocities on the surface, their middle (3,), m/s, and its tets' lowest altitude, m."""
        crowd = self._sides.crowd
        altitude = _lowest(crowd.x, self._sides.face_places)
        ends = (crowd.v.max(axis=0, initial=-np.inf), (-crowd.v).max(axis=0, initial=-np.inf))
        most = self._comm.maximum(np.array([-altitude, *ends[0], *ends[1]]))
        return float(np.linalg.norm(most[1:4] + most[4:7])), 0.5 * (most[1:4] - most[4:7]), -float(most[0])

    def _push(self, now: Scene, state: Nodes, dt: float, t: float) -> None:
        crowd, room, held = now.crowd, now.room, now.held
        _take(crowd.x, crowd.v, held, state.x, state.v, now.local)
        now.copies.refresh(state, crowd.x, crowd.v, now.before)
        n = self._meet(now, dt)
        self._weigh(now, n)
        room_of = (room.nodes, room.weights, room.normals)
        now.push[:n] = 0.0
        slip = sweeps.rates(now.before, room.nodes, room.weights, n)
        for _ in range(self._sweeps):
            sweeps.sweep(
                now.impulse, now.push, crowd.v, *room_of, room.wanted, room.friction, now.diagonal, self._scale, n
            )
            now.shared_impulse.begin()
            now.shared_impulse.finish()
            sweeps.give(crowd.v, now.total, now.impulse, crowd.mobility, self._scale)
        sweeps.heat(self._friction, now.push, slip, crowd.v, *room_of, room.friction, self._joule, n)
        self._book(now)
        self.meetings = n
        if _give_back(state.v, self._parts, now.local, held, crowd.v, now.total, state.part, state.owned):
            self.last_push = t

    def _meet(self, now: Scene, dt: float) -> int:
        crowd, room = now.crowd, now.room
        out = (room.nodes, room.weights, room.normals, room.wanted, room.friction)
        found = (crowd.x, crowd.v, crowd.part, self._mu, dt)
        n = meetings.node_face(*out, 0, now.faces, now.face_size, now.normals, now.node_face, *found)
        return int(meetings.edge_edge(*out, n, now.edges, now.edge_size, now.edge_edge, *found))

    def _weigh(self, now: Scene, n: int) -> None:
        room = now.room
        now.shares[:] = 0
        sweeps.add_shares(now.shares, room.nodes, room.weights, room.normals, n)
        now.shared_shares.begin()
        now.shared_shares.finish()
        sweeps.mobilities(now.diagonal, room.nodes, room.weights, room.normals, now.shares, now.crowd.mobility, n)

    def _book(self, now: Scene) -> None:
        """Half of the work of the last impulses, with the velocities in ``before``."""
        _book(
            self.contact_loss, self.external_work, now.local, now.held, now.before, now.total, now.crowd.mobility,
            self._scale,
        )  # fmt: skip


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], int32[::1])", cache=True)
def _gather(out, v, held, local):  # type: ignore[no-untyped-def]
    for h in range(len(local)):
        for i in range(3):
            out[held[h], i] = v[local[h], i]


@njit("void(float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1], float64[:, ::1], int32[::1])", cache=True)
def _take(x, v, held, node_x, node_v, local):  # type: ignore[no-untyped-def]
    """Positions and velocities of the held nodes of a crowd."""
    for h in range(len(held)):
        for i in range(3):
            x[held[h], i], v[held[h], i] = node_x[local[h], i], node_v[local[h], i]


@njit(
    "boolean(float64[:, ::1], int64[:, ::1], int32[::1], int32[::1], float64[:, ::1], int64[:, ::1], int32[::1], "
    "boolean[::1])",
    cache=True,
)
def _give_back(node_v, parts, local, held, v, total, part, owned):  # type: ignore[no-untyped-def]
    """Velocities of the held nodes, and the impulses of the owned ones to the sums of their parts; whether any."""
    pushed = False
    for h in range(len(held)):
        for i in range(3):
            j = total[held[h], i]
            node_v[local[h], i] = v[held[h], i]
            pushed |= j != 0
            if owned[local[h]]:
                parts[part[local[h]], i] += j
    return pushed


@njit(
    "void(float64[::1], float64[::1], int32[::1], int32[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], "
    "float64)",
    cache=True,
)
def _book(loss, external, local, held, before, total, mobility, scale):  # type: ignore[no-untyped-def]
    """Half of the impulse times velocity: lost by contact; where a velocity is held, taken in from outside."""
    for h in range(len(held)):
        for i in range(3):
            work = 0.5 * before[held[h], i] * (total[held[h], i] / scale)
            loss[local[h]] -= work
            if mobility[held[h], i] == 0.0:
                external[local[h]] -= work


@njit("void(int64[:, ::1], float64[:, ::1], int32[:, ::1], float64)", cache=True)
def _add_normals(sums, x, faces, scale):  # type: ignore[no-untyped-def]
    """Adds the area vectors of faces (f, 3), in quanta of 1 / ``scale``, to the sums (nodes, 3) of their nodes."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            area = (x[b, j] - x[a, j]) * (x[c, k] - x[a, k]) - (x[b, k] - x[a, k]) * (x[c, j] - x[a, j])
            quanta = np.int64(np.rint(area * scale))
            for m in range(3):
                sums[faces[f, m], i] += quanta


@njit("float64(float64[:, ::1], int32[:, ::1])", cache=True, error_model="numpy")
def _lowest(x, faces):  # type: ignore[no-untyped-def]
    """Lowest altitude, m, of tets over their faces (f, 4)."""
    lowest = np.inf
    for f in range(len(faces)):
        a, b, c, d = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        fx, fy, fz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
        height = nx * (x[d, 0] - x[a, 0]) + ny * (x[d, 1] - x[a, 1]) + nz * (x[d, 2] - x[a, 2])
        lowest = min(lowest, abs(height) / np.sqrt(nx * nx + ny * ny + nz * nz))
    return lowest


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


def _mobility(nodes: Nodes, bounds: list[Boundary]) -> tuple[Floats, Flags]:
    """(nodes, 3) one over the mass, zero where a velocity is held; and which nodes lie on a symmetry plane."""
    mobility = np.repeat(1.0 / nodes.mass[:, None], 3, axis=1)
    planes = np.zeros((nodes.n, 3), bool)
    for bound in bounds:
        if isinstance(bound, SymmetryPlane):
            planes[bound.nodes, bound.axis] = True
        elif isinstance(bound, PrescribedVelocity):
            rows = mobility[bound.nodes]
            rows[bound.held] = 0.0
            mobility[bound.nodes] = rows
    mobility[planes] = 0.0
    return mobility, planes


def _typical(sizes: Floats, comm: Comm) -> float:
    """Harmonic mean of the sizes of all faces, m: near the small ones where a mesh is graded."""
    total, count = exact_sums(comm, np.column_stack([1.0 / sizes, np.ones(len(sizes))]))
    return float(count / total)


def _bounds(model: Model, comm: Comm) -> tuple[float, float]:
    """The largest nodal mass, kg, and the largest of wave speed and velocity, m/s."""
    speeds = [float(np.linalg.norm(model.nodes.v, axis=1).max(initial=0.0))]
    for block in model.blocks:
        p = block.params
        speeds.append(math.sqrt((p[BULK] + 4.0 / 3.0 * p[SHEAR]) / p[DENSITY]))
    largest, fastest = comm.maximum(np.array([float(model.nodes.mass.max(initial=0.0)), max(speeds)]))
    return float(largest), float(fastest)
