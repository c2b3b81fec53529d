"""Symmetry planes, rigid walls, prescribed motion: what acts on velocities between the kick and the move.

Each books the work that it does on the body. The kick at time n does it in two halves, with the velocity before and
after: at time n only the first has been spent (the kinetic energy of the ledger is 1/2 m v(n-1/2) . v(n+1/2)).
"""

import numpy as np
from numba import njit

from conoid.cases import schema

from .errors import InputError
from .parallel.comm import Comm
from .state import Flags, Floats, Indices, Model, Nodes

_AXES = {"x": 0, "y": 1, "z": 2}
_ON_PLANE = 1e-9
"""Of the size of the mesh: closer than this is on a plane."""
_SWEEPS = 4


class Boundary:
    """What the time step asks of a boundary."""

    def __init__(self, nodes: Indices) -> None:
        self.nodes = nodes
        self.contact_loss = np.zeros(len(nodes))
        """(n,) energy lost by impact on the boundary, J."""
        self.external_work = np.zeros(len(nodes))
        """(n,) work done on the body from outside, J."""
        self.last_push = 0.0
        """Last time at which the boundary pushed, s."""

    def start(self, state: Nodes) -> None:
        """Makes the initial velocities agree with the boundary."""

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        """Corrects v(n+1/2) at time ``t``.

        ``quantum`` is the impulse of one force quantum over the mean step, N s; ``dt`` the step ahead, s.
        """
        raise NotImplementedError


class SymmetryPlane(Boundary):
    """Nodes that start on a plane across an axis have no velocity along it."""

    def __init__(self, nodes: Indices, axis: int) -> None:
        super().__init__(nodes)
        self.axis = axis

    def start(self, state: Nodes) -> None:
        _hold(state.v, self.nodes, self.axis)

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        _hold(state.v, self.nodes, self.axis)


class RigidWalls(Boundary):
    """No node ends the step behind a wall: an impulse along its normal stops the node there, never pulls.

    ``points`` and ``normals`` (w, 3), ``held`` (n, w): which walls hold which node. A node between two walls is taken
    to each in turn, a few times.
    """

    def __init__(self, nodes: Indices, points: Floats, normals: Floats, held: Flags) -> None:
        super().__init__(nodes)
        self._points = points
        self._normals = normals / np.linalg.norm(normals, axis=1)[:, None]
        self._held = held
        self._pending = np.zeros(len(nodes))

    def depths(self, state: Nodes) -> Floats:
        """(w,) how deep the deepest node starts behind each wall, m."""
        depths = np.full(len(self._points), -np.inf)
        for k, (point, normal) in enumerate(zip(self._points, self._normals, strict=True)):
            behind = (point - state.x[self.nodes[self._held[:, k]]]) @ normal
            depths[k] = behind.max(initial=-np.inf)
        return depths

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        self.contact_loss += self._pending
        self._pending[:] = 0.0
        if dt > 0.0 and _push_out(
            state.x, state.v, state.force, state.mass, self.nodes, self._points, self._normals, self._held,
            quantum, dt, self.contact_loss, self._pending,
        ):  # fmt: skip
            self.last_push = t


class PrescribedVelocity(Boundary):
    """Nodes whose velocity has given components; NaN leaves a component free."""

    def __init__(self, nodes: Indices, velocity: Floats) -> None:
        super().__init__(nodes)
        self._velocity = np.broadcast_to(velocity, (len(nodes), 3))
        self._pending = np.zeros(len(nodes))

    def _target(self, state: Nodes, dt: float) -> Floats:
        free = state.v[self.nodes]
        return np.where(np.isnan(self._velocity), free, self._velocity)

    def start(self, state: Nodes) -> None:
        state.v[self.nodes] = self._target(state, 0.0)

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        free, mass = state.v[self.nodes], state.mass[self.nodes, None]
        before = free - state.force[self.nodes] * (quantum / mass)
        new = self._target(state, dt)
        impulse = mass * (new - free)
        self.external_work += self._pending + 0.5 * (impulse * before).sum(axis=1)
        self._pending = 0.5 * (impulse * new).sum(axis=1)
        state.v[self.nodes] = new


class PrescribedRotation(PrescribedVelocity):
    """Nodes that turn rigidly: each step is the chord of the exact rotation."""

    def __init__(self, nodes: Indices, centre: Floats, rate: Floats) -> None:
        super().__init__(nodes, np.zeros(3))
        self._centre = centre
        self._rate = rate

    def _target(self, state: Nodes, dt: float) -> Floats:
        r = state.x[self.nodes] - self._centre
        speed = float(np.linalg.norm(self._rate))
        if dt == 0.0 or speed == 0.0:
            return np.cross(self._rate, r)
        axis, angle = self._rate / speed, speed * dt
        across = np.cross(axis, r)
        chord: Floats = (np.sin(angle) * across + (1.0 - np.cos(angle)) * np.cross(axis, across)) / dt
        return chord


@njit("void(float64[:, ::1], int32[::1], int64)", cache=True)
def _hold(v, nodes, axis):  # type: ignore[no-untyped-def]
    for a in nodes:
        v[a, axis] = 0.0


@njit(
    "boolean(float64[:, ::1], float64[:, ::1], int64[:, ::1], float64[::1], int32[::1], float64[:, ::1], "
    "float64[:, ::1], boolean[:, ::1], float64, float64, float64[::1], float64[::1])",
    cache=True,
    error_model="numpy",
)
def _push_out(x, v, force, mass, nodes, points, normals, held, quantum, dt, loss, pending):  # type: ignore[no-untyped-def]
    """Impulse form: the gap at the end of the step is never negative. Returns whether a wall pushed.

    The half of the loss that goes with v(n-1/2) is booked in ``loss``, the other in ``pending``.
    """
    pushed = False
    for j in range(len(nodes)):
        a = nodes[j]
        fx, fy, fz = v[a, 0], v[a, 1], v[a, 2]
        touched = False
        for _ in range(_SWEEPS):
            moved = False
            for k in range(len(points)):
                gap, speed = 0.0, 0.0
                for i in range(3):
                    gap += (x[a, i] - points[k, i]) * normals[k, i]
                    speed += v[a, i] * normals[k, i]
                if held[j, k] and gap + dt * speed < 0.0:
                    for i in range(3):
                        v[a, i] -= (gap / dt + speed) * normals[k, i]
                    moved = touched = True
            if not moved or len(points) == 1:
                break
        if touched:
            kick = quantum / mass[a]
            jx, jy, jz = v[a, 0] - fx, v[a, 1] - fy, v[a, 2] - fz
            bx, by, bz = fx - force[a, 0] * kick, fy - force[a, 1] * kick, fz - force[a, 2] * kick
            loss[j] -= 0.5 * mass[a] * (jx * bx + jy * by + jz * bz)
            pending[j] = -0.5 * mass[a] * (jx * v[a, 0] + jy * v[a, 1] + jz * v[a, 2])
            pushed = True
    return pushed


def build(case: schema.Case, model: Model, comm: Comm) -> list[Boundary]:
    """The boundaries of a case on this rank's nodes; prescribed motion last, so that it has the last word.

    Raises InputError, on every rank alike, for a boundary that holds no node, a body that starts behind a wall, and
    motion prescribed across a symmetry plane.
    """
    nodes = model.nodes
    held = [_held_by(spec, model) for spec in case.boundaries]
    counts = comm.sum(np.array([int(h.sum()) for h in held], np.int64))
    for index in np.flatnonzero(counts == 0):
        raise InputError(f"boundaries[{index}]: holds no node; check its place and its parts")
    pairs = list(zip(case.boundaries, held, strict=True))
    boundaries: list[Boundary] = [
        SymmetryPlane(_indices(h), _AXES[spec.axis]) for spec, h in pairs if isinstance(spec, schema.Symmetry)
    ]
    boundaries += _walls(case, model, held, comm)
    for spec, h in pairs:
        if isinstance(spec, schema.Prescribed):
            velocity = np.array([np.nan if c is None else c for c in (spec.x, spec.y, spec.z)])
            boundaries.append(PrescribedVelocity(_indices(h), velocity))
        elif isinstance(spec, schema.Rotation):
            centre, rate = np.array(spec.spin.centre), np.array(spec.spin.rate)
            boundaries.append(PrescribedRotation(_indices(h), centre, rate))
    _refuse_conflicts(boundaries, nodes, comm)
    return boundaries


def _held_by(spec: schema.Boundary, model: Model) -> Flags:
    """(n,) the nodes that a boundary acts on."""
    nodes = model.nodes
    chosen = np.ones(nodes.n, bool)
    if spec.parts:
        chosen = np.isin(nodes.part, [model.parts.index(p) for p in spec.parts])
    if isinstance(spec, schema.Symmetry):
        chosen &= np.abs(nodes.x0[:, _AXES[spec.axis]] - spec.at) <= _ON_PLANE * max(model.size, abs(spec.at))
    elif isinstance(spec, schema.Prescribed):
        if spec.low is not None:
            chosen &= (nodes.x0 >= np.array(spec.low)).all(axis=1)
        if spec.high is not None:
            chosen &= (nodes.x0 <= np.array(spec.high)).all(axis=1)
    return chosen


def _walls(case: schema.Case, model: Model, held: list[Flags], comm: Comm) -> list[Boundary]:
    found = [(i, spec, held[i]) for i, spec in enumerate(case.boundaries) if isinstance(spec, schema.Wall)]
    if not found:
        return []
    touched = np.any([h for _, _, h in found], axis=0)
    walls = RigidWalls(
        _indices(touched), np.array([spec.point for _, spec, _ in found]),
        np.array([spec.normal for _, spec, _ in found]),
        np.ascontiguousarray(np.array([h[touched] for _, _, h in found]).T),
    )  # fmt: skip
    depths = comm.maximum(walls.depths(model.nodes))
    for (index, _, _), depth in zip(found, depths, strict=True):
        if depth > _ON_PLANE * model.size:
            raise InputError(f"boundaries[{index}]: a body starts {depth:.3g} m behind this wall")
    return [walls]


def _refuse_conflicts(boundaries: list[Boundary], nodes: Nodes, comm: Comm) -> None:
    """Motion prescribed across a symmetry plane would do work on it that never happened."""
    before = nodes.v.copy()
    for boundary in boundaries:
        boundary.start(nodes)
    planes = [b for b in boundaries if isinstance(b, SymmetryPlane)]
    speeds = [float(np.abs(nodes.v[b.nodes, b.axis]).max(initial=0.0)) for b in planes]
    nodes.v[:] = before
    fastest = comm.maximum(np.array([max(speeds, default=0.0)]))[0]
    if fastest > 0.0:
        raise InputError("boundaries: a prescribed motion leads nodes off their symmetry plane; allowed: along it")


def _indices(chosen: Flags) -> Indices:
    return np.flatnonzero(chosen).astype(np.int32)
