"""Rigid bodies in the time step.

A step at n, with the bodies as they lie there: v(n-1/2) -> v*(n+1/2) by what acts from outside (``kick``), impulses of
contact and of walls to v(n+1/2) (``give``, ``settle``), positions and orientations to n+1 (``move``). Impulses act at
the arms of n, and rates are those that the angular momentum has in the orientation of n: so the work of an impulse is
half of it times the velocities of its node before and after, to round-off, and no energy is lost besides.
"""

from typing import Any

import numpy as np

from conoid.cases.estimates.estimate import RIGID_STEPS
from conoid.cases.model.schema import Case, Wall
from conoid.cases.shapes.region import GENERATED

from ..boundaries.wall_shapes import Walls
from ..contact.solver.active import IMPULSE, ActiveNodes
from ..contact.surface.records import SurfaceNodes
from ..errors import InputError
from ..model.state import Floats, Indices, Ints, Nodes
from ..parallel.comm import Comm
from . import rotation, rows
from .bodies import STATE, Bodies, dot, of_nodes, times
from .stopped import stopped
from .stops import BodyStops

_TURN = 0.1
"""rad that a body may turn in a step. Chosen: the phase of a tumbling body is then off by a thousandth of a turn each
turn, and a node leaves its chord by a thousandth of the arm."""
_SMALL = 16
"""Bits of an impulse that do not count in what is unsettled (contact/solver/slot_numbers.py)."""
_KEPT = ("contact_loss", "external_work", "friction_loss", "_later", "_before")
"""What the accounts remember."""


class Rigid:
    """The rigid bodies of a case on one rank; every rank has all of them."""

    def __init__(
        self, case: Case, nodes: Nodes, bodies: Bodies, walls: Walls, beside: Ints, comm: Comm
    ) -> None:  # fmt: skip
        """``beside``: (planes, parts) the side of a plane of symmetry on which a body starts beside it, 1 or -1; all
        ranks take part.
        """
        self.bodies, self._comm = bodies, comm
        self._take(case, nodes)
        n = bodies.n
        self.contact_loss, self.external_work, self.friction_loss = np.zeros((3, n))
        """(b,) energy lost by impact and friction, work from outside, and of the loss that of friction on walls, J."""
        self._later = np.zeros((3, n))
        """(3, b) the second halves of these, of the last step."""
        self._before = np.stack([bodies.speed, bodies.momentum])
        """(2, b, 3) v(n-1/2), m/s, and the angular momentum, kg m^2/s."""
        self._total, self._scale = np.zeros((n, rows.WORDS), np.int64), 1.0
        """(b, WORDS) impulses of contact in the step, quanta, and quanta per N s."""
        self._changed: Ints = np.zeros((n, rows.WORDS), np.int64)
        self.last_dt = self.last_push = 0.0
        """Of the last step, and when contact or a wall last pushed, s."""
        self._least = RIGID_STEPS / case.run.end_time if len(case.rigid) == len(case.parts) else 0.0
        self._start, self._rate = np.zeros((2, n, 3)), np.zeros((n, 3))
        self._tells = "contact_pressure" in case.run.fields
        self.share = 1.0
        """How much of the last change of the motion the velocities of the nodes have: less at the end of a run."""
        self.active = False
        """Whether a contact of this step, on any rank, has a node of a rigid body."""
        self.stops = BodyStops(
            walls, bodies, *stopped(case, nodes, bodies, beside, comm), _restitution(case, walls), _names(case)
        )

    def _take(self, case: Case, nodes: Nodes) -> None:
        """The nodes that are here."""
        of = of_nodes(case, nodes)
        self.nodes: Indices = np.flatnonzero(of >= 0).astype(np.int32)
        self._body: Indices = of[self.nodes]
        self._arms = np.ascontiguousarray(nodes.x0[self.nodes] - self.bodies.origin[self._body])
        number = np.full(len(case.parts), -1, np.int32)
        number[case.rigid] = np.arange(len(case.rigid), dtype=np.int32)
        self.of_part: Indices = number
        """(parts,) which body each part is, -1 for none."""

    def require_front(self, case: Case, size: float) -> None:
        """Raises InputError for a wall behind which a body starts, by more than rounding of the ``size``, m."""
        for (index, _), depth in zip(case.boundaries_of(Wall), self.stops.deepest().tolist(), strict=False):
            if depth > GENERATED * size:
                raise InputError(f"boundaries[{index}]: a body starts {depth:.3g} m behind this wall")

    # State ------------------------------------------------------------------------------------------------------------

    def keep(self) -> dict[str, Any]:
        """All of it, equal on all ranks."""
        kept = {name: getattr(self.bodies, name).copy() for name in STATE}
        own = {name: getattr(self, name).copy() for name in _KEPT}
        constant = {name: getattr(self.bodies, name) for name in ("part", "mass", "origin", "inertia", "reach")}
        return {"state": kept, "own": own, "constant": constant, "last_dt": self.last_dt, "given": self.stops.given}

    @staticmethod
    def kept_bodies(known: dict[str, Any], held: list[Any]) -> Bodies:
        """The bodies of a run that goes on."""
        bodies = Bodies(**known["constant"], held=held)
        for name, values in known["state"].items():
            setattr(bodies, name, values.copy())
        bodies.pose()
        return bodies

    def resume(self, known: dict[str, Any]) -> None:
        """Takes the accounts back."""
        for name, values in known["own"].items():
            setattr(self, name, values.copy())
        self.last_dt = known["last_dt"]
        self.stops.given[:] = known["given"]

    def words(self) -> bytes:
        """Of the digest: where the bodies are and how they move."""
        return b"".join(np.ascontiguousarray(getattr(self.bodies, name)).tobytes() for name in STATE)

    @property
    def limit(self) -> float:
        """One over the longest step, 1/s: none turns by more than _TURN; rigid parts alone take RIGID_STEPS."""
        rate = self.bodies.rates(self.bodies.momentum)
        return max(float(np.sqrt(dot(rate, rate)).max(initial=0.0)) / _TURN, self._least)

    # The step ---------------------------------------------------------------------------------------------------------

    def note(self) -> None:
        """Before the kick: keeps v(n-1/2), and books the second half of the last impulses' work."""
        bodies = self.bodies
        self.contact_loss += self._later[0]
        self.external_work += self._later[1]
        self.friction_loss += self._later[2]
        self._later[:] = 0.0
        self._before[0], self._before[1] = bodies.speed, bodies.momentum

    def kick(self, nodes: Nodes, dt: float, t: float) -> None:
        """v*(n+1/2) of the bodies and their nodes; ``dt``: the step ahead, s."""
        bodies = self.bodies
        for b, held in enumerate(bodies.held):
            bodies.speed[b] = held.kick(bodies.speed[b], bodies.centre[b], self.last_dt, dt, t)
        self._total[:] = self._changed[:] = 0
        self.active = False
        self.last_dt = dt
        self._start[0], self._start[1] = bodies.speed, bodies.rates(bodies.momentum)
        self._rate[:] = self._start[1]
        if self.stops.walls.n:
            self.stops.begin(dt)
        self._carry(nodes)

    def settle(self, nodes: Nodes, t: float) -> None:
        """After contact and walls: v(n+1/2) of the bodies and their nodes, and half of the work that it took."""
        bodies, stops = self.bodies, self.stops
        stops.stop(bodies.speed, self._rate)
        stops.end(bodies.speed, self._rate, self.last_dt, t)
        impulse = self._impulse() + stops.impulse
        given = impulse[:, 3:] * bodies.turns
        bodies.momentum = bodies.momentum + given
        if impulse.any():
            self.last_push = t
        self._book(impulse)
        self._rate[:] = bodies.rates(bodies.momentum)
        self._carry(nodes)

    def move(self, nodes: Nodes, dt: float) -> None:
        """To n+1: positions, orientations, and the velocities of nodes that the same motion is there."""
        bodies = self.bodies
        bodies.centre += dt * bodies.speed
        rotation.turn(bodies.q, bodies.momentum, bodies.rotation, bodies.inverse, bodies.loose, dt)
        for b, held in enumerate(bodies.held):
            if held.spin is not None:
                rotation.multiply(bodies.q, b, *held.half(dt).tolist(), True)
            elif bodies.turns[b].any() and not bodies.turns[b].all():
                rate = 0.5 * dt * self._rate[b]
                rotation.multiply(bodies.q, b, *rate.tolist(), True)
        bodies.pose()
        for b, held in enumerate(bodies.held):
            if held.spin is not None:
                bodies.momentum[b] = times(bodies.about(b)[None], held.spin[1][None])[0]
        self._rate[:] = bodies.rates(bodies.momentum)
        rotation.place(nodes.x, self.nodes, self._body, self._arms, bodies.rotation, bodies.centre)
        self._carry(nodes)

    def _carry(self, nodes: Nodes) -> None:
        bodies = self.bodies
        rotation.carry(nodes.v, nodes.x, self.nodes, self._body, bodies.centre, bodies.speed, self._rate)

    def begin(self, nodes: Nodes) -> None:
        """Before the first step, and where a run goes on: velocities of nodes."""
        self._rate[:] = self.bodies.rates(self.bodies.momentum)
        self._carry(nodes)

    def _impulse(self) -> Floats:
        """(b, 6) impulse, N s, and moment, N m s, of contact in the step."""
        found = self._total / self._scale
        found[:, 3:] *= self.bodies.reach[:, None]
        return np.asarray(found)

    def _book(self, impulse: Floats) -> None:
        """Half of the work of the step's impulses (b, 6) at the velocities before, and the other for the next step:
        what contact and walls give; what else changes the motion, and what driven walls do, is from outside.
        """
        bodies, rubbed, walls = self.bodies, self.stops.rubbed, self.stops.walls
        speed, momentum = self._before
        change = [bodies.mass[:, None] * (bodies.speed - speed), bodies.momentum - momentum]
        outside = np.concatenate(change, axis=1) - impulse
        halves = np.zeros((2, 3, bodies.n))
        times_n = (speed, momentum, walls.before), (bodies.speed, bodies.momentum, walls.speed)
        for k, (v, spin, of_walls) in enumerate(times_n):
            rate = bodies.rates(spin)
            for m, (given, sign) in enumerate(((impulse, -0.5), (outside, 0.5), (rubbed, -0.5))):
                halves[k, m] = sign * (dot(given[:, :3], v) + dot(given[:, 3:], rate))
            for w in np.flatnonzero(~walls.plain).tolist():
                moved = 0.5 * dot(self.stops.of_walls[w], of_walls[w][None])
                halves[k, 0] += moved
                halves[k, 1] += moved if walls.lightness[w] == 0.0 else 0.0
                halves[k, 2] += 0.5 * dot(self.stops.rubbed_by[w], of_walls[w][None])
        self.contact_loss += halves[0, 0]
        self.external_work += halves[0, 1]
        self.friction_loss += halves[0, 2]
        self._later = halves[1]

    # Contact ----------------------------------------------------------------------------------------------------------

    def take_up(self, places: Indices, surface_nodes: SurfaceNodes, scale: float) -> None:
        """The slots of a step at ``places`` of the surface_nodes; ``scale``: quanta per N s."""
        body = self.of_part[surface_nodes.part[places]]
        self._slots: Indices = np.flatnonzero(body >= 0).astype(np.int32)
        self._of_slots: Indices = body[self._slots]
        at = places[self._slots]
        self._slot_arms = np.ascontiguousarray(surface_nodes.x[at] - self.bodies.centre[self._of_slots])
        self._owned = surface_nodes.owner[at] == self._comm.rank
        self._slot_nodes = surface_nodes.local[at]
        self._slot_impulses = np.zeros((len(at), 3), np.int64)
        self._scale = scale

    def weigh(self, active: ActiveNodes) -> None:
        """Row weights of rigid slots, of all ranks; all take part."""
        bodies, words = self.bodies, np.zeros((self.bodies.n, rows.WEIGHTS), np.int64)
        mine = self._slots, self._of_slots, self._slot_arms
        rows.weigh(words, active, *mine, self._owned, bodies.reach)
        words = self._comm.sum(words) if self._comm.size > 1 else words
        self.active = bool(words.any())
        if self.active:
            rows.norms(active, words, *mine, bodies.reach, bodies.lightness, bodies.yielding)

    def give(self, active: ActiveNodes) -> None:
        """After a sweep: the impulses of its slots move the bodies, and these their slots; all ranks take part."""
        if not self.active:
            return
        bodies, words = self.bodies, np.zeros((self.bodies.n, rows.WORDS), np.int64)
        if self._tells:
            self._slot_impulses += active.moving_words[self._slots, IMPULSE : IMPULSE + 3]
        rows.gather(words, active, self._slots, self._of_slots, self._slot_arms, self._owned, bodies.reach)
        self._changed = self._comm.sum(words) if self._comm.size > 1 else words
        self._total += self._changed
        impulse = self._impulse() + self.stops.impulse
        bodies.speed = self._start[0] + bodies.lightness * impulse[:, :3]
        self._rate[:] = self._start[1] + times(bodies.yielding, impulse[:, 3:])
        self.stops.stop(bodies.speed, self._rate)
        rows.spread(active, self._slots, self._of_slots, self._slot_arms, bodies.speed, self._rate)

    def add_pressed(self, pressed: Ints) -> None:
        """Adds the impulses of contact of the step to those of this rank's nodes, ``pressed`` (nodes, 3), quanta."""
        mine = np.flatnonzero(self._slot_nodes >= 0)
        pressed[self._slot_nodes[mine]] += self._slot_impulses[mine]

    def unsettled(self) -> Ints:
        """(2,) l1 norms of what the last sweep has changed of the bodies' impulses and moments, and of these
        (contact/solver/sweep_count.py): of all ranks, on the first.
        """
        both = np.zeros(2, np.int64)
        if self._comm.rank == 0 and self.active:
            both[:] = (np.abs(self._changed) >> _SMALL).sum(), (np.abs(self._total) >> _SMALL).sum()
        return both

    def of_contact(self, parts: Ints) -> None:
        """Adds the impulses of the step to those of the ``parts`` (parts, 3), quanta, on the first rank."""
        if self._comm.rank == 0:
            parts[self.bodies.part] += self._total[:, :3]

    def of_walls(self, walls: list[int], part: int) -> Floats:
        """(3,) what these walls have given the body that is ``part`` so far, N s; zero where it is none."""
        body = int(self.of_part[part])
        return self.stops.given[walls, body].sum(axis=0) if body >= 0 else np.zeros(3)

    # The ledger -------------------------------------------------------------------------------------------------------

    def kinetic(self) -> Floats:
        """(b,) kinetic energy at n, J: that of the leapfrog, by the motion before and after."""
        bodies, (speed, momentum) = self.bodies, self._before
        linear = bodies.mass * dot(speed, bodies.speed)
        return np.asarray(0.5 * (linear + dot(momentum, bodies.rates(bodies.momentum))))

    def quantity(self, body: int, field: str, axis: int, share: float) -> float:
        """Kinetic energy, J, or a component of ``momentum``, ``centre`` or ``centre_velocity`` of a body, with this
        ``share`` of the change that the last impulses have made.
        """
        bodies, (speed, momentum) = self.bodies, self._before
        if field == "centre":
            return float(bodies.centre[body, axis])
        v = speed + share * (bodies.speed - speed)
        spin = momentum + share * (bodies.momentum - momentum)
        if field == "kinetic_energy":
            return float(0.5 * (bodies.mass * dot(v, v) + dot(spin, bodies.rates(spin)))[body])
        return float(v[body, axis] * (bodies.mass[body] if field == "momentum" else 1.0))

    def momenta(self) -> Floats:
        """(6,) momentum, kg m/s, and angular momentum about the origin, kg m^2/s, of all bodies at n."""
        bodies, (speed, momentum) = self.bodies, self._before
        p = 0.5 * bodies.mass[:, None] * (speed + bodies.speed)
        own = 0.5 * (momentum + bodies.momentum)
        x = bodies.centre
        about = own + np.stack([x[:, i] * p[:, j] - x[:, j] * p[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
        return np.concatenate([p.sum(axis=0), about.sum(axis=0)])


def _restitution(case: Case, walls: Walls) -> Floats:
    """(walls,) of planes of symmetry that of contact; of walls none."""
    found = np.zeros(walls.n)
    if case.contact is not None:
        found[len(case.boundaries_of(Wall)) :] = case.contact.restitution
    return found


def _names(case: Case) -> list[str]:
    return [case.parts[index].name for index in case.rigid]
