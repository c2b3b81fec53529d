"""Rigid bodies in the contact of a step: the contact slots that are nodes of bodies, and the contact impulses on these
slots.
"""

from typing import NamedTuple, Self

import numpy as np

from ..contact.solver.active import IMPULSE, ActiveNodes
from ..contact.surface.records import SurfaceNodes
from ..model.state import Flags, Floats, Indices, Ints
from ..parallel.comm import Comm
from . import rows
from .bodies import Bodies, times
from .stops import BodyStops

_SMALL = 16
"""Number of low bits of an impulse that the residual of the sweeps ignores (contact/solver/slot_numbers.py)."""


class _Slots(NamedTuple):
    """Contact slots of the step that are nodes of rigid bodies."""

    slot: Indices
    """(k,) index of each slot of a rigid body among all slots of the step."""
    body: Indices
    """(k,) body of each slot of a rigid body."""
    arm: Floats
    """(k, 3) vector from the centre of the body to each slot, m."""
    owned: Flags
    """(k,) True for each slot whose node this rank owns."""
    node: Indices
    """(k,) local node of each slot; -1 if the node is not on this rank."""
    impulse: Ints
    """(k, 3) sum of the impulses in the step, quanta. The sum is computed only if the field ``contact_pressure`` is
    requested."""

    @classmethod
    def of(cls, places: Indices, surface: SurfaceNodes, of_part: Indices, bodies: Bodies, rank: int) -> Self:
        """Finds the slots of rigid bodies among the slots at ``places`` of the surface nodes. ``of_part`` (parts,):
        body of each part.
        """
        body = of_part[surface.part[places]]
        slot: Indices = np.flatnonzero(body >= 0).astype(np.int32)
        at, body = places[slot], body[slot]
        arm = np.ascontiguousarray(surface.x[at] - bodies.centre[body])
        return cls(slot, body, arm, surface.owner[at] == rank, surface.local[at], np.zeros((len(at), 3), np.int64))


class BodyContacts:
    """Contact impulses on the rigid bodies of a case. All ranks have equal values."""

    def __init__(
        self, bodies: Bodies, stops: BodyStops, of_part: Indices, start: Floats, rate: Floats, comm: Comm,
        *, reports: bool,
    ) -> None:  # fmt: skip
        """``of_part`` (parts,): body of each part, -1 for none; ``start`` (2, b, 3): velocities and rotation vectors of
        the bodies before the impulses of the step; ``rate`` (b, 3): present rotation vectors, which this class updates;
        ``reports``: True if the run will call ``add_pressed``.
        """
        self._bodies, self._stops, self._of_part, self._comm = bodies, stops, of_part, comm
        self._start, self._rate, self._reports = start, rate, reports
        self._total, self._scale = np.zeros((bodies.n, rows.WORDS), np.int64), 1.0
        """(b, WORDS) contact impulses on each body in the step, quanta; and number of quanta per N s."""
        self._changed: Ints = np.zeros((bodies.n, rows.WORDS), np.int64)
        """(b, WORDS) contact impulses on each body in the last sweep, quanta."""
        self.active = False
        """True if a node of a rigid body is in an active contact of this step, on any rank."""

    def begin(self) -> None:
        """Starts a step without impulses."""
        self._total[:] = self._changed[:] = 0
        self.active = False

    @property
    def impulse(self) -> Floats:
        """(b, 6) impulse, N s, and moment, N m s, of contact in the step."""
        found = self._total / self._scale
        found[:, 3:] *= self._bodies.reach[:, None]
        return np.asarray(found)

    def take_up(self, places: Indices, surface_nodes: SurfaceNodes, scale: float) -> None:
        """Registers the contact slots of a step at ``places`` of the surface nodes. ``scale``: quanta per N s."""
        self._slots = _Slots.of(places, surface_nodes, self._of_part, self._bodies, self._comm.rank)
        self._scale = scale

    def weigh(self, active: ActiveNodes) -> None:
        """Sets the row weights of rigid slots, computed from the active contacts of all ranks. Collective."""
        bodies, slots, words = self._bodies, self._slots, np.zeros((self._bodies.n, rows.WEIGHTS), np.int64)
        mine = slots.slot, slots.body, slots.arm
        rows.weigh(words, active, *mine, slots.owned, bodies.reach)
        words = self._comm.sum(words) if self._comm.size > 1 else words
        self.active = bool(words.any())
        if self.active:
            rows.norms(active, words, *mine, bodies.reach, bodies.lightness, bodies.yielding)

    def give(self, active: ActiveNodes) -> None:
        """Moves the bodies by the impulses on their slots after a sweep, and moves the slots with the bodies.
        Collective.
        """
        if not self.active:
            return
        bodies, slots, words = self._bodies, self._slots, np.zeros((self._bodies.n, rows.WORDS), np.int64)
        if self._reports:
            slots.impulse[:] += active.moving_words[slots.slot, IMPULSE : IMPULSE + 3]
        rows.gather(words, active, slots.slot, slots.body, slots.arm, slots.owned, bodies.reach)
        self._changed = self._comm.sum(words) if self._comm.size > 1 else words
        self._total += self._changed
        impulse = self.impulse + self._stops.impulse
        bodies.speed = self._start[0] + bodies.lightness * impulse[:, :3]
        self._rate[:] = self._start[1] + times(bodies.yielding, impulse[:, 3:])
        self._stops.stop(bodies.speed, self._rate)
        rows.spread(active, slots.slot, slots.body, slots.arm, bodies.speed, self._rate)

    def add_pressed(self, pressed: Ints) -> None:
        """Adds the contact impulses of the step to ``pressed`` (nodes, 3), which are the impulses on the nodes of this
        rank, quanta.
        """
        mine = np.flatnonzero(self._slots.node >= 0)
        pressed[self._slots.node[mine]] += self._slots.impulse[mine]

    def unsettled(self) -> Ints:
        """(2,) l1 norms over all ranks, on rank 0: of the changes of impulses and moments in the last sweep, and of the
        impulses and moments in the step (sweep_count.py in contact/solver).
        """
        both = np.zeros(2, np.int64)
        if self._comm.rank == 0 and self.active:
            both[:] = (np.abs(self._changed) >> _SMALL).sum(), (np.abs(self._total) >> _SMALL).sum()
        return both

    def of_contact(self, parts: Ints) -> None:
        """Adds the impulses of the step to ``parts`` (parts, 3), which are the impulses on the parts, quanta; only on
        rank 0.
        """
        if self._comm.rank == 0:
            parts[self._bodies.part] += self._total[:, :3]
