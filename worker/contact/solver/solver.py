"""Impulses of a step: from the active contacts of the narrow phase to the velocities v(n+1/2)."""

from typing import Protocol

import numpy as np

from ...model.growing import Scratch
from ...model.state import Flags, Floats, Indices, Ints, Nodes
from ...parallel.fixed_point import Tally
from ...parallel.team import Team
from .. import tasks
from ..books import Books
from ..narrow_phase.rows import ActiveRows
from ..surface.records import SurfaceNodes
from . import impulse_work, slot_numbers, stops, zones
from .active import IMPULSE, PUSH, PUSH_T, ActiveContacts, ActiveNodes, Kept, Loaded
from .quiet import Quiet
from .sets import Sets, Slots
from .shared_sums import ActiveSum
from .stops import Braced, Stops
from .zones import Zones

_ROW_WEIGHTS = 4
"""Number of columns of ``ActiveNodes.row_weights``."""
_SPARE = 1.25
"""Allocated rows over the present number of nodes and contacts. While a body breaks, these numbers increase in
nearly every step, and each new allocation costs time because the operating system clears new pages. Chosen value: a
bar of glass has a quarter more rows after 400 steps."""

_NONE: Indices = np.zeros(0, np.int32)


class Bodies(Protocol):
    """Interface of rigid bodies, whose nodes are slots (rigid/rows.py)."""

    active: bool
    """True if any rank has an active contact with a rigid body."""

    def take_up(self, places: Indices, surface_nodes: SurfaceNodes, scale: float) -> None:
        """Finds the slots of rigid bodies."""

    def weigh(self, active: ActiveNodes) -> None:
        """Sets the row weights of the slots of rigid bodies, after all contacts have added their row weights.
        Collective.
        """

    def give(self, active: ActiveNodes) -> None:
        """Moves the rigid bodies by the impulses on their slots, and sets the velocities of the slots. Collective."""

    def unsettled(self) -> Ints:
        """Residual of the sweeps, see sweep_count.py."""

    def of_contact(self, parts: Ints) -> None:
        """Adds the impulses of the step to the sums ``parts`` (parts, 3), quanta."""

    def add_pressed(self, pressed: Ints) -> None:
        """Adds the impulses of the step on rigid bodies to the impulses ``pressed`` (nodes, 3) on the nodes of this
        rank, quanta.
        """


class ActiveSet:
    """Active contacts of a rank in a step, and the slots of their nodes."""

    def __init__(self, scale: float, near: Stops, team: Team, bodies: Bodies | None = None) -> None:
        """``scale``: quanta per N s, a power of two; ``near``: walls and planes of symmetry; ``bodies``: rigid
        bodies."""
        self.scale, self.stops, self._bodies = scale, near, bodies
        self.places: Indices = np.zeros(0, np.int32)
        """(slots,) rows in the scene of the nodes that were slots in the last step."""
        self._zones, self._passes = Zones(team.threads), Slots(team)
        self._sets, self._room = Sets(team, self._zones.many), _Room(0, 0, 0, self._zones.many)
        self._scratch, self._quiet = Scratch(), Quiet(team)
        self._turn = np.zeros(2, np.int64)
        """Number of the present sweep, and number of sweeps in the step."""

    def go_on(self, scale: float, sides: Floats) -> None:
        """Sets the scale, and the ``sides`` of the stops, after a restart or a repartition."""
        self.scale, self.stops = scale, self.stops._replace(sides=sides.reshape(self.stops.sides.shape))

    def rest(
        self, rows: ActiveRows, surface_nodes: SurfaceNodes, kept: Kept, loose: Flags, shared: ActiveSum, dt: float
    ) -> bool:  # fmt: skip
        """Tests whether the contacts ``rows`` need no impulse in a step ``dt``, s; then no other method has to be
        called in the step. False if other ranks or rigid bodies may take part. ``kept``: stored impulses, set to zero
        in a step without impulses; for the other arguments see ``begin``.
        """
        alone = not len(shared.shared) and self._bodies is None
        if not (alone and self._quiet.holds(rows, surface_nodes, kept, self.stops, loose, dt)):
            return False
        self.places, self._room.loaded.many[:] = _NONE, 0
        kept.pairs[:], kept.cracks[:] = 0.0, 0.0
        return True

    def begin(
        self, rows: ActiveRows, surface_nodes: SurfaceNodes, loose: Flags, shared: ActiveSum, size: float, dt: float
    ) -> None:  # fmt: skip
        """Numbers the contacts ``rows`` of a step ``dt``, s, and their nodes; ``shared``: sums over ranks; ``loose``
        (nodes,): nodes without tets; ``size`` of a face, m.
        """
        self._sum, found = shared, rows.room
        if rows.n > len(self._room.row) or surface_nodes.n > len(self._room.touched):
            self._room = _Room(
                int(_SPARE * rows.n), int(_SPARE * surface_nodes.n), len(self.stops.points), self._zones.many
            )
        room = self._room
        self._number(rows, self._zones.of(surface_nodes))
        self._fastest = self._loaded(surface_nodes)
        self._turn[:] = 0
        stops.find(
            room.braced,
            room.active,
            self.stops,
            self.places,
            surface_nodes.x,
            surface_nodes.part,
            surface_nodes.local,
            loose,
            size,
            dt,
        )
        stops.stop(room.active, room.braced)
        if self._bodies is not None:
            self._bodies.take_up(self.places, surface_nodes, self.scale)
        self._contacts = ActiveContacts(
            room.row, room.slots, room.reach, found.weights, found.normals, found.wanted, found.friction, found.pair
        )  # fmt: skip

    def _number(self, rows: ActiveRows, zone: Indices) -> None:
        """Orders the contacts by sets, all idle, and numbers their nodes and the shared ones."""
        room, n, shared, nodes = self._room, rows.n, self._sum.shared, rows.room.nodes
        many = self._scratch.zeros("many", self._passes.mark.many(n), len(room.loaded.many))
        room.touched[shared] = room.shared[shared] = 1
        self._passes.mark.run(n, room.touched, room.set_of, nodes, rows.found, zone, room.shared, many)
        room.shared[shared] = 0
        slots = slot_numbers.number(room.places, room.slot, room.touched)
        if slots != len(self.places) or self.places.base is not room.places.base:
            self.places = room.places[:slots]
        self._sum.number(room.slot)
        counts = many.sum(axis=0)
        begin = np.cumsum(counts) - counts
        begins = self._scratch.of("begins", len(many), np.int64, len(counts))
        np.cumsum(many, axis=0, out=begins)
        begins += begin - many
        self._passes.sort.run(
            n, room.row, room.slots, room.reach, begins, room.set_of, rows.found, nodes, room.slot
        )  # fmt: skip
        room.loaded.begin[:-1], room.loaded.begin[-1] = begin, n
        room.loaded.many[:] = 0

    def _loaded(self, surface_nodes: SurfaceNodes) -> float:
        fastest = self._scratch.of("fastest", self._passes.load.many(len(self.places)), np.float64)
        self._passes.load.run(
            len(self.places), self._room.active, self.places, surface_nodes.v, surface_nodes.mobility, fastest
        )
        return float(fastest.max(initial=0.0))

    def weigh(self) -> None:
        """Computes the row weights, completed over the ranks."""
        room = self._room
        table = self._sets.weigh.set(room.active, self._contacts, room.loaded)
        self._sets.complete(tasks.weigh, table, self._sum, room.active.row_weights, 0, _ROW_WEIGHTS)
        if self._bodies is not None:
            self._bodies.weigh(room.active)

    def resume(self, kept: Kept, ratio: float) -> None:
        """Warm start with ``ratio`` times the stored impulses ``kept``."""
        room = self._room
        table = self._sets.resume.set(room.active, self._contacts, room.loaded, kept, ratio, self.scale)
        self._sets.complete(tasks.resume, table, self._sum, room.active.moving_words, IMPULSE, 3)
        if self._bodies is not None:
            self._bodies.give(room.active)
        self._passes.give.run(len(self.places), room.active, self.scale, self._turn)
        stops.stop(room.active, room.braced)

    def sweep(self, many: int) -> None:
        """Runs ``many`` sweeps, in one call of the thread team if no other rank and no rigid body takes part."""
        room, n, turn, bodies, sets, passes = (
            self._room, len(self.places), self._turn, self._bodies, self._sets, self._passes,
        )  # fmt: skip
        turn[:] = 0, many
        table = sets.sweep.set(room.active, self._contacts, room.loaded, self._fastest, turn, self.scale)
        give, brace = (room.active, self.scale, turn), (room.active, room.braced, turn)
        if not len(self._sum.shared) and (bodies is None or not bodies.active):
            if not n:
                return
            stages = [sets.inner(tasks.sweep, table), passes.give.stage(n, *give), passes.brace.stage(1, *brace)]
            sets.repeat(stages, many)
            return
        for _ in range(many):
            sets.complete(tasks.sweep, table, self._sum, room.active.moving_words, IMPULSE, 3)
            if bodies is not None:
                bodies.give(room.active)
            passes.give.run(n, *give)
            passes.brace.run(1, *brace)

    def cost(self, books: Books, before: Floats, part: Indices) -> None:
        """Books the energy that the impulses take from the bodies, and the impulses between parts if a probe needs
        them; ``before`` (surface_nodes, 3): v(n-1/2), ``part`` (surface_nodes,).
        """
        self._add(books.account.words, before, books.account.scale, rubs=False)
        books.account.carry()
        for k in range(len(self._room.loaded.many) if len(books.pairs) else 0):
            impulse_work.between(books.pairs, self._room.loaded, self.places, part, self.scale, k)

    def heat(self, friction: Tally, before: Floats) -> None:
        """Books the work of friction, see impulse_work.heat."""
        self._add(friction.words, before, float(friction.scale[0]), rubs=True)
        friction.carry()

    def _add(self, words: Ints, before: Floats, joule: float, *, rubs: bool) -> None:
        room = self._room
        each = self._scratch.zeros("words", len(room.loaded.many), *words.shape)
        table = self._sets.cost.set(each, room.loaded, room.active, before, self.places, joule, rubs)
        self._sets.run(tasks.cost, table)
        words += each.sum(axis=0)

    def store(self, kept: Kept) -> None:
        """Stores the impulses of this step in ``kept``."""
        kept.pairs[:], kept.cracks[:] = 0.0, 0.0
        self._sets.run(tasks.store, self._sets.store.set(kept, self._room.loaded, self._contacts.pair))

    def leave(self, surface_nodes: SurfaceNodes, total: Ints, state: Nodes, parts: Ints, unsettled: Ints) -> bool:
        """Copies velocities to the local nodes, and adds impulses to ``total`` (surface_nodes, 3), to the sums of
        the ``parts`` (parts, 3) and to the residual ``unsettled`` (2,); returns whether there was any impulse.
        """
        room, n = self._room, len(self.places)
        stops.release(room.active, room.braced)
        many = self._passes.leave.many(n)
        left, pushes = self._scratch.zeros("left", many, 3), self._scratch.zeros("pushes", many, *parts.shape)
        some = surface_nodes.local, state.part, state.owned
        self._passes.leave.run(n, state.v, pushes, left, total, room.active, self.places, *some)
        parts += pushes.sum(axis=0)
        unsettled += left[:, :2].sum(axis=0)
        if self._bodies is not None:
            self._bodies.of_contact(parts)
            unsettled += self._bodies.unsettled()
        return bool(left[:, 2].any())

    def press(self, pressed: Ints) -> None:
        """Adds the impulses of rigid bodies in the step to ``pressed`` (nodes, 3), quanta, if ``pressed`` has rows."""
        if self._bodies is not None and len(pressed):
            self._bodies.add_pressed(pressed)

    def pushes(self) -> tuple[Indices, Floats]:
        """Rows of the contacts with an impulse in the step, and (k, 4) their impulses along the normal, and of
        friction, N s.
        """
        loaded = self._room.loaded
        ranges = [range(a, a + n) for a, n in zip(loaded.begin[:-1], loaded.many, strict=True)]
        some = np.concatenate([np.asarray(each, np.int64) for each in ranges])
        return loaded.row[some], np.column_stack([loaded.normal[some, PUSH], loaded.tangent[some, PUSH_T:]])


class _Room:
    """Allocates arrays for ``contacts`` contacts, ``nodes`` surface nodes, ``many`` stops and ``of`` zones."""

    def __init__(self, contacts: int, nodes: int, many: int, of: int) -> None:
        self.row, self.set_of = np.empty((2, contacts), np.int32)
        self.slots, self.reach = np.empty((contacts, 4), np.int32), np.empty(contacts)
        self.places, self.slot = np.empty((2, nodes + 1), np.int32)
        self.touched, self.shared = np.zeros((2, nodes), np.uint8)
        self.active, self.braced = ActiveNodes.of(nodes), Braced.room(many * nodes)
        self.loaded = Loaded.of(contacts, 2 * zones.sets(of))
