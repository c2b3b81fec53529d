"""Symmetry planes, rigid walls, prescribed motion: what acts on velocities between the kick and the move.

Each books the work that it does on the body. The kick at time n does it in two halves, with the velocity before and
after: at time n only the first has been spent (the kinetic energy of the ledger is 1/2 m v(n-1/2) . v(n+1/2)).
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from conoid.cases import schema

from .state import Floats, Indices, Nodes

_AXES = {"x": 0, "y": 1, "z": 2}


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
        self._axis = axis

    def start(self, state: Nodes) -> None:
        _hold(state.v, self.nodes, self._axis)

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        _hold(state.v, self.nodes, self._axis)


class RigidWall(Boundary):
    """No node ends the step behind the wall: an impulse along the normal stops it there, never pulls."""

    def __init__(self, nodes: Indices, point: Floats, normal: Floats) -> None:
        super().__init__(nodes)
        self._point = point
        self._normal = normal / np.linalg.norm(normal)

    def apply(self, state: Nodes, quantum: float, dt: float, t: float) -> None:
        if dt > 0.0 and _push_out(
            state.x,
            state.v,
            state.force,
            state.mass,
            self.nodes,
            self._point,
            self._normal,
            quantum,
            dt,
            self.contact_loss,
        ):
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
    "boolean(float64[:, ::1], float64[:, ::1], int64[:, ::1], float64[::1], int32[::1], float64[::1], float64[::1], "
    "float64, float64, float64[::1])",
    cache=True,
    error_model="numpy",
)
def _push_out(x, v, force, mass, nodes, point, normal, quantum, dt, loss):  # type: ignore[no-untyped-def]
    """Impulse form: gap at the end of the step, never negative. Returns whether the wall pushed."""
    pushed = False
    for j in range(len(nodes)):
        a = nodes[j]
        gap, speed, kicked = 0.0, 0.0, 0.0
        for k in range(3):
            gap += (x[a, k] - point[k]) * normal[k]
            speed += v[a, k] * normal[k]
        if gap + dt * speed >= 0.0:
            continue
        for k in range(3):
            kicked += force[a, k] * normal[k]
        change = -gap / dt - speed
        before = speed - kicked * quantum / mass[a]
        for k in range(3):
            v[a, k] += change * normal[k]
        loss[j] -= 0.5 * mass[a] * change * (before + speed + change)
        pushed = True
    return pushed


def _chosen(nodes: Nodes, parts: Sequence[str], names: list[str]) -> "np.ndarray":
    if not parts:
        return np.ones(nodes.n, bool)
    return np.isin(nodes.part, [names.index(p) for p in parts])


def build(case: schema.Case, nodes: Nodes, names: list[str]) -> list[Boundary]:
    """The boundaries of a case on this rank's nodes; prescribed motion last, so that it has the last word."""
    boundaries: list[Boundary] = []
    for spec in sorted(case.boundaries, key=lambda b: b.kind in ("velocity", "rotation")):
        chosen = _chosen(nodes, spec.parts, names)
        if isinstance(spec, schema.Symmetry):
            axis = _AXES[spec.axis]
            on = np.abs(nodes.x0[:, axis] - spec.at) <= 1e-9 * max(float(np.abs(nodes.x0).max()), abs(spec.at))
            boundaries.append(SymmetryPlane(_indices(chosen & on), axis))
        elif isinstance(spec, schema.Wall):
            boundaries.append(RigidWall(_indices(chosen), np.array(spec.point), np.array(spec.normal)))
        elif isinstance(spec, schema.Prescribed):
            for bound, inside in ((spec.low, np.greater_equal), (spec.high, np.less_equal)):
                if bound is not None:
                    chosen &= inside(nodes.x0, np.array(bound)).all(axis=1)
            velocity = np.array([np.nan if c is None else c for c in (spec.x, spec.y, spec.z)])
            boundaries.append(PrescribedVelocity(_indices(chosen), velocity))
        else:
            boundaries.append(
                PrescribedRotation(_indices(chosen), np.array(spec.spin.centre), np.array(spec.spin.rate))
            )
    return boundaries


def _indices(chosen: "np.ndarray") -> Indices:
    return np.flatnonzero(chosen).astype(np.int32)
