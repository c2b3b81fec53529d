"""Symmetry planes for the nodes beside them: what flies at a plane meets its mirror image there.

Two images press with equal forces, so that neither passes the plane. That is a wall for each side of it.
"""

from typing import Self

import numpy as np

from conoid.cases.schema import Case, Symmetry

from .boundaries import Boundary, driven, free
from .conditions import AXES, sides
from .jit import njit
from .migration.parcel import Parcel
from .state import Bits, Floats, Indices, Ints, Model, Nodes, extended

_TOGETHER = 64
"""Nodes that are looked at in one loop, which compilers make vectors of; only where one of them would be beyond are
they looked at on their own."""


class Mirrors(Boundary):
    """No node ends the step beyond a symmetry plane that it started beside: an impulse stops it there, never pulls."""

    after_contact = True

    def __init__(self, nodes: Indices, axes: Ints, at: Floats, sides: Floats, restitution: float = 0.0) -> None:
        """Planes across the ``axes`` (planes,) at the heights ``at`` (planes,), m; ``sides`` (n, planes): 1 for a node
        above, -1 for one below, 0 for one that the plane does not hold; ``restitution``: as of contact.
        """
        super().__init__(nodes)
        self._axes, self._at, self._sides, self._restitution = axes, at, sides, restitution
        self._stopped: Ints = np.zeros(0, np.int64)
        """Places of the nodes that were stopped in the last step."""

    @classmethod
    def of(cls, case: Case, model: Model, bounds: list[Boundary]) -> Self:
        """All symmetry planes of a case, and the nodes that start beside them; those of prescribed motion are left
        alone.
        """
        specs = [spec for _, spec in case.boundaries_of(Symmetry)]
        axes, at = np.array([AXES[spec.axis] for spec in specs]), np.array([spec.at for spec in specs])
        held = np.column_stack([sides(spec, model) for spec in specs])
        some = held.any(axis=1) & ~driven(model.nodes.n, bounds)
        back = case.contact.restitution if case.contact is not None else 0.0
        return cls(np.flatnonzero(some).astype(np.int32), axes, at, held[some], back)

    def held_components(self) -> Bits:
        return free(self.nodes)

    def _inherit(self, at: Ints) -> None:
        self._sides = extended(self._sides, self._sides[at])

    def resume(self, parcel: Parcel, name: str, dt: float) -> None:
        super().resume(parcel, name, dt)
        self._stopped = np.flatnonzero(self._impulse.any(axis=1))

    def note(self, state: Nodes) -> None:
        np.take(state.v, self.nodes, axis=0, out=self._before, mode="clip")
        _book(self.contact_loss, self._impulse, self._before, self._stopped)
        self._impulse[self._stopped] = 0.0

    def apply(self, state: Nodes, dt: float, t: float) -> None:
        self._stopped = _stop(
            state.x, state.v, self._before, self._impulse, state.mass, self.nodes, self._axes, self._at,
            self._sides, self._restitution, dt,
        )  # fmt: skip
        _book(self.contact_loss, self._impulse, self._before, self._stopped)


@njit("void(float64[::1], float64[:, ::1], float64[:, ::1], int64[::1])", cache=True)
def _book(loss, impulse, before, rows):  # type: ignore[no-untyped-def]
    """Half of what the impulses of these ``rows`` take from the body, at the velocities ``before`` them."""
    for j in rows:
        for i in range(3):
            loss[j] -= 0.5 * impulse[j, i] * before[j, i]


@njit(
    "int64[::1](float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], int32[::1], "
    "int64[::1], float64[::1], float64[:, ::1], float64, float64)",
    cache=True,
    error_model="numpy",
)
def _stop(x, v, before, impulse, mass, nodes, axes, at, sides, restitution, dt):  # type: ignore[no-untyped-def]
    """The velocity of a node that would be beyond a plane ends it on the plane, or leads away from it with a share of
    the speed at which it came, of ``before`` (n, 3): v(n-1/2). Adds to ``impulse``; returns the places of those that
    were stopped, by some plane.
    """
    stopped, n = np.empty(len(nodes), np.int64), 0
    for first in range(0, len(nodes), _TOGETHER):
        last, met = min(first + _TOGETHER, len(nodes)), 0
        for k in range(len(axes)):
            i, plane = axes[k], at[k]
            for j in range(first, last):
                a = nodes[j]
                met += sides[j, k] * (x[a, i] - plane + dt * v[a, i]) < 0.0
        if not met:
            continue
        for j in range(first, last):
            a = nodes[j]
            for k in range(len(axes)):
                i, side = axes[k], sides[j, k]
                height, speed = side * (x[a, i] - at[k]), side * v[a, i]
                if height + dt * speed < 0.0:
                    back = -restitution * side * before[j, i]
                    change = side * (max(-height / dt, back if back > 0.0 else -np.inf) - speed)
                    v[a, i] += change
                    impulse[j, i] += mass[a] * change
            if impulse[j].any():
                stopped[n] = j
                n += 1
    return stopped[:n].copy()
