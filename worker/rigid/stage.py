"""Rigid bodies in the time step.

At the start of a step the bodies are at their positions of n. External loads change v(n-1/2) to v*(n+1/2) (``kick``);
impulses of contact and walls change it to v(n+1/2) (``contacts``, ``settle``). Then positions and orientations of n+1
are computed (``move``).

Impulses act at the arms of n, and rotation vectors are computed from the angular momentum in the orientation of n.
Therefore the work of an impulse is, to round-off, half of the impulse times the sum of the velocities of its node
before and after, and no other energy is lost.
"""

from typing import Any

import numpy as np

from conoid.cases.estimates.estimate import RIGID_STEPS
from conoid.cases.model.schema import Case, Wall
from conoid.cases.shapes.region import GENERATED

from ..boundaries.wall_shapes import Walls
from ..errors import InputError
from ..model.ids import places
from ..model.state import Floats, Indices, Ints, Nodes
from ..parallel.comm import Comm
from . import rotation
from .account import BodyAccount
from .bodies import STATE, Bodies, dot, of_nodes, times
from .bonded import BodyBonds
from .contact import BodyContacts
from .points import Points
from .stopped import stopped
from .stops import BodyStops

_TURN = 0.1
"""Largest rotation of a body in a step, rad. Chosen value: the error of the rotation of a tumbling body is then a
thousandth of a turn for each turn, and the path of a node differs from the chord by a thousandth of the arm."""


class Rigid:
    """Rigid bodies of a case on one rank. Every rank has all bodies."""

    def __init__(
        self, case: Case, nodes: Nodes, bodies: Bodies, walls: Walls, beside: Ints, comm: Comm
    ) -> None:  # fmt: skip
        """``beside`` (planes, parts): side of each symmetry plane on which a part starts, 1 or -1; else 0.
        Collective.
        """
        self.bodies = bodies
        of = of_nodes(case, nodes)
        self.nodes: Indices = np.flatnonzero(of >= 0).astype(np.int32)
        """(k,) local nodes of the bodies."""
        self._body: Indices = of[self.nodes]
        self._arms = np.ascontiguousarray(nodes.x0[self.nodes] - bodies.origin[self._body])
        """(k, 3) arms (vectors from the centre of the body to the nodes) at the start, m."""
        self.of_part: Indices = np.full(len(case.parts), -1, np.int32)
        """(parts,) number of the body of each part; -1 if the part is not rigid."""
        self.of_part[case.rigid] = np.arange(len(case.rigid), dtype=np.int32)
        self.account = BodyAccount(bodies)
        self.last_dt = self.last_push = 0.0
        """Last time step, s; and simulated time of the last impulse of contact or a wall, s."""
        driven = [held.spin.fastest for held in bodies.held if held.spin is not None]
        self._least = max(
            RIGID_STEPS / case.run.end_time if len(case.rigid) == len(case.parts) else 0.0,
            max(driven, default=0.0) / _TURN,
        )
        self._start, self._rate = np.zeros((2, bodies.n, 3)), np.zeros((bodies.n, 3))
        """Velocities and rotation vectors before the impulses of the step; and present rotation vectors, rad/s."""
        self.share = 1.0
        """Fraction of the last change of the motion that the velocities of the nodes contain. The fraction is below 1
        at the end of a run, when velocities are interpolated to n."""
        self.stops = BodyStops(
            walls, bodies, *stopped(case, nodes, bodies, beside, comm), _restitution(case, walls), _names(case)
        )
        self.contacts = BodyContacts(
            bodies, self.stops, self.of_part, self._start, self._rate, comm,
            reports="contact_pressure" in case.run.fields,
        )  # fmt: skip
        self.bonds = BodyBonds(bodies, self.stops, self._start, self._rate, comm)

    def require_front(self, case: Case, size: float) -> None:
        """Raises InputError if a body starts behind a wall by more than the round-off of coordinates; ``size``: largest
        coordinate, m.
        """
        for (index, _), depth in zip(case.boundaries_of(Wall), self.stops.deepest().tolist(), strict=False):
            if depth > GENERATED * size:
                raise InputError(f"boundaries[{index}]: a body starts {depth:.3g} m behind this wall")

    # State ------------------------------------------------------------------------------------------------------------

    def keep(self) -> dict[str, Any]:
        """Returns the state of the rigid bodies for a checkpoint. All ranks return equal values."""
        kept = {name: getattr(self.bodies, name).copy() for name in STATE}
        constant = {name: getattr(self.bodies, name) for name in ("part", "mass", "origin", "inertia", "reach")}
        return {
            "state": kept, "own": self.account.keep(), "constant": constant, "last_dt": self.last_dt,
            "given": self.stops.given,
        }  # fmt: skip

    @staticmethod
    def kept_bodies(known: dict[str, Any], held: list[Any]) -> Bodies:
        """Returns the bodies of a resumed run; ``known``: state in the checkpoint."""
        bodies = Bodies(**known["constant"], held=held)
        for name, values in known["state"].items():
            setattr(bodies, name, values.copy())
        bodies.pose()
        return bodies

    def resume(self, known: dict[str, Any]) -> None:
        """Restores the state of this object from a checkpoint. The bodies themselves are restored by
        ``kept_bodies``.
        """
        self.account.resume(known["own"])
        self.last_dt = known["last_dt"]
        self.stops.given[:] = known["given"]

    def words(self) -> bytes:
        """Returns the values of the bodies for the digest: positions and motion."""
        return b"".join(np.ascontiguousarray(getattr(self.bodies, name)).tobytes() for name in STATE)

    @property
    def limit(self) -> float:
        """Returns 1 / longest allowed step, 1/s. No body may turn by more than _TURN in a step, also at the largest
        prescribed rate. A run that has only rigid parts makes RIGID_STEPS steps.
        """
        rate = self.bodies.rates(self.bodies.momentum)
        return max(float(np.sqrt(dot(rate, rate)).max(initial=0.0)) / _TURN, self._least)

    # The step ---------------------------------------------------------------------------------------------------------

    def begin(self, nodes: Nodes) -> None:
        """Sets the velocities of the nodes of bodies, before the first step and when a run resumes."""
        self._rate[:] = self.bodies.rates(self.bodies.momentum)
        self._carry(nodes)

    def note(self) -> None:
        """Adds the second half of the work of the last impulses; to be called before the kick."""
        self.account.note()

    def kick(self, nodes: Nodes, dt: float, t: float) -> None:
        """Computes v*(n+1/2) of the bodies and their nodes; ``dt``: time step, s."""
        bodies = self.bodies
        for b, held in enumerate(bodies.held):
            bodies.speed[b] = held.kick(bodies.speed[b], bodies.centre[b], self.last_dt, dt, t)
            self._spin(b, dt, t)
        self.contacts.begin()
        self.bonds.begin()
        self.last_dt = dt
        self._start[0], self._start[1] = bodies.speed, bodies.rates(bodies.momentum)
        self._rate[:] = self._start[1]
        if self.stops.walls.n:
            self.stops.begin(dt)
        self._carry(nodes)

    def settle(self, nodes: Nodes, t: float) -> None:
        """Computes v(n+1/2) of bodies and nodes after contact and walls. Adds the first half of the work of the
        impulses.
        """
        bodies, stops = self.bodies, self.stops
        stops.stop(bodies.speed, self._rate)
        stops.end(bodies.speed, self._rate, self.last_dt, t)
        impulse, of_bonds = self.contacts.impulse + stops.impulse, self.bonds.impulse
        given = (impulse + of_bonds)[:, 3:] * bodies.turns
        bodies.momentum = bodies.momentum + given
        if impulse.any():
            self.last_push = t
        self.account.book(impulse, of_bonds, stops)
        self._rate[:] = bodies.rates(bodies.momentum)
        self._carry(nodes)

    def move(self, nodes: Nodes, dt: float, t: float) -> None:
        """Computes positions and orientations at n+1, and sets the velocities of the nodes to the motion of the
        bodies. ``dt``: step from the time ``t``, s.
        """
        bodies = self.bodies
        bodies.centre += dt * bodies.speed
        rotation.turn(bodies.q, bodies.momentum, bodies.rotation, bodies.inverse, bodies.loose, dt)
        for b, held in enumerate(bodies.held):
            if held.spin is not None:
                rotation.multiply(bodies.q, b, *held.half(dt, t).tolist(), True)
            elif bodies.turns[b].any() and not bodies.turns[b].all():
                rate = 0.5 * dt * self._rate[b]
                rotation.multiply(bodies.q, b, *rate.tolist(), True)
        bodies.pose()
        for b in range(bodies.n):
            self._spin(b, dt, t)
        self._rate[:] = bodies.rates(bodies.momentum)
        rotation.place(nodes.x, self.nodes, self._body, self._arms, bodies.rotation, bodies.centre)
        self._carry(nodes)

    def tied(self, nodes: Nodes) -> None:
        """Stores the motion from which contact starts, and sets the nodes to it; to be called after the warm start of
        the tied bonds.
        """
        self.bonds.settle_start()
        self._carry(nodes)

    def points(self, rows: Ints, masters: Ints, weights: Floats, ids: Ints, comm: Comm) -> Points:
        """Returns the points of the bodies to which tied rows tie nodes. ``rows`` (e,): row of each weight; ``masters``
        (e,): global id of its mortar node; ``weights`` (e,). ``ids`` (nodes,): global ids of the local nodes.
        Collective.
        """
        mine = np.isin(ids[self.nodes], masters)
        words = np.column_stack([ids[self.nodes][mine], self._body[mine], self._arms[mine].view(np.int64)])
        every = comm.join(words.reshape(-1)).reshape(-1, 5)
        known, first = np.unique(every[:, 0], return_index=True)
        at = places(known, masters)
        row, of = rows[at >= 0], first[at[at >= 0]]
        arms, many = np.ascontiguousarray(every[of, 2:]).view(np.float64), int(rows.max(initial=-1)) + 1
        mean = np.column_stack([np.bincount(row, weights[at >= 0] * arms[:, i], many) for i in range(3)])
        some, start = np.unique(row, return_index=True)
        return Points(some, every[of[start], 1].astype(np.int32), np.ascontiguousarray(mean[some]))

    def of_walls(self, walls: list[int], part: int | None) -> Floats:
        """(3,) sum of the impulses so far of the given walls on the rigid body of ``part``, N s. The sum is over all
        bodies if no part is given, and zero for a part that is not rigid.
        """
        if part is None:
            return np.asarray(self.stops.given[walls].sum(axis=(0, 1)))
        body = int(self.of_part[part])
        return self.stops.given[walls, body].sum(axis=0) if body >= 0 else np.zeros(3)

    def _spin(self, b: int, dt: float, t: float) -> None:
        """Sets the angular momentum of a body to that of its prescribed rotation, if it has one, in the step ``dt``, s,
        from the time ``t``.
        """
        axis = self.bodies.held[b].spin
        if axis is not None:
            rate = axis.mean_rate(t, t + dt)
            self.bodies.momentum[b] = times(self.bodies.about(b)[None], rate[None])[0]

    def _carry(self, nodes: Nodes) -> None:
        """Sets the velocities of the nodes to the motion of their bodies."""
        bodies = self.bodies
        rotation.carry(nodes.v, nodes.x, self.nodes, self._body, bodies.centre, bodies.speed, self._rate)


def _restitution(case: Case, walls: Walls) -> Floats:
    """(walls,) coefficient of restitution of each wall: that of contact for symmetry planes, zero for walls."""
    found = np.zeros(walls.n)
    if case.contact is not None:
        found[len(case.boundaries_of(Wall)) :] = case.contact.restitution
    return found


def _names(case: Case) -> list[str]:
    return [case.parts[index].name for index in case.rigid]
