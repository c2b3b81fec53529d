"""The impulses of a step: from the active contacts that the narrow phase has found to the velocities v(n+1/2)."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..parallel.fixed_point import Tally
from ..state import Flags, Floats, Indices, Ints, Nodes
from . import booking, held, need, stops, sweeps
from .account import Account
from .active import IMPULSE, PUSH, PUSH_T, ActiveContacts, ActiveNodes, Kept, Loaded
from .company import ActiveSum
from .narrow_phase import ContactRows
from .records import Crowd
from .stops import Braced, Stops

_ROW_WEIGHTS = 4
"""Columns of ``ActiveNodes.row_weights``."""
_SPARE = 1.25
"""Times the nodes there are, room is made for: while a body breaks they become more in nearly every step, and the
system clears every page of memory that is new. Chosen: a bar of glass has a quarter more after 400 steps."""


class ActiveSet:
    """The active contacts of a rank in a step, and the slots of their nodes; the first slots are of shared nodes."""

    def __init__(self, scale: float, near: Stops) -> None:
        """``scale``: quanta per N s, a power of two; ``near``: walls and planes of symmetry."""
        self.scale, self.stops = scale, near
        self.places: Indices = np.zeros(0, np.int32)
        """(slots,) where the nodes of the last step stand in the crowd."""
        self._slot: Indices = np.zeros(0, np.int32)
        """(crowd,) slot of each node, -1 for none; within a step only."""
        self._room = _Room(0, 0, 0)

    def go_on(self, scale: float, sides: Floats) -> None:
        """Of a run that goes on; ``sides`` as of its stops."""
        self.scale, self.stops = scale, self.stops._replace(sides=sides.reshape(self.stops.sides.shape))

    def begin(
        self, found: ContactRows, n: int, crowd: Crowd, loose: Flags, shared: ActiveSum, size: float, dt: float
    ) -> None:
        """Takes up the first ``n`` contacts that were ``found`` in a step ``dt``, s, and the nodes whose sums are
        ``shared``; ``loose`` (nodes,): those without tets; ``size``: of a face, m.
        """
        self._sum = shared
        if len(self._slot) != crowd.n:
            self._slot = np.full(crowd.n, -1, np.int32)
        if len(found.nodes) > self._room.contacts or crowd.n > self._room.nodes:
            self._room = _Room(len(found.nodes), int(_SPARE * crowd.n), len(self.stops.points))
        room, slot = self._room, self._slot
        self._first = held.number_shared(room.places, slot, shared.shared)
        self._n, border = held.number(
            room.slots, room.reach, room.places, slot, room.rows, found.nodes, n, self._first
        )  # fmt: skip
        self.places = room.places[: self._n]
        shared.number(slot)
        self._fastest = held.load(room.active, self.places, crowd.v, crowd.mobility)
        stops.find(room.braced, room.active, self.stops, self.places, crowd.x, crowd.part, crowd.local, loose, size, dt)
        stops.stop(room.active, room.braced)
        self._contacts = ActiveContacts(
            room.slots, found.weights, found.normals, found.wanted, found.friction, found.pair, room.reach
        )  # fmt: skip
        self._parts = room.loaded.part(0, border, room.rows[0]), room.loaded.part(border, n, room.rows[1])

    def weigh(self) -> None:
        """Row weights, completed over the ranks."""
        active = self._room.active

        def add(part: Loaded) -> None:
            sweeps.add_row_weights(active, self._contacts, part.idle[: part.many[1]])

        self._complete(add, active.row_weights, 0, _ROW_WEIGHTS)

    def resume(self, kept: Kept, ratio: float) -> None:
        """Begins with ``ratio`` times what contacts have ``kept`` of the step before."""
        active, contacts = self._room.active, self._contacts

        def begin(part: Loaded) -> None:
            sweeps.load_kept(part, contacts, active, kept)
            sweeps.resume(active, part, kept, contacts.pair, ratio, self.scale)

        self._complete(begin, active.moving_words, IMPULSE, 3)
        sweeps.give(active, self._n, self.scale)
        stops.stop(active, self._room.braced)

    def sweep(self, many: int) -> None:
        """So many sweeps."""
        active, contacts, scale, braced = self._room.active, self._contacts, self.scale, self._room.braced
        if not self._first:
            sweeps.sweep_all(active, self._parts[1], contacts, braced, self._fastest, self._n, scale, many)
            return

        def correct(ahead: float, part: Loaded) -> None:
            sweeps.correct(active, part, contacts, self._fastest, ahead, scale)

        for k in range(many):
            self._complete(partial(correct, sweeps.momentum(k, many)), active.moving_words, IMPULSE, 3)
            if k + 1 == many:
                need.measure(active, self._n)
            sweeps.give(active, self._n, scale)
            stops.stop(active, braced)

    def _complete(self, work: Callable[[Loaded], None], words: Ints, first: int, columns: int) -> None:
        """Does the work of all contacts, and completes these columns of the ``words`` of shared nodes; contacts without
        shared nodes are worked on while the sums of the others travel.
        """
        border, inner = self._parts
        work(border)
        self._sum.begin(words, first, columns)
        work(inner)
        self._sum.finish(words, first, columns)

    def cost(self, account: Account, before: Floats) -> None:
        """Books what the impulses take from the bodies; ``before`` (crowd, 3): v(n-1/2)."""
        for part in self._parts:
            booking.cost(account.words, part, self._room.active, before, self.places, account.scale)
        account.carry()

    def heat(self, friction: Tally, before: Floats) -> None:
        """Books the work of friction, see booking.heat."""
        for part in self._parts:
            booking.heat(friction.words, part, self._room.active, before, self.places, float(friction.scale[0]))
        friction.carry()

    def store(self, kept: Kept) -> None:
        """What contacts have ``kept`` of this step."""
        kept.pairs[:], kept.cracks[:] = 0.0, 0.0
        for part in self._parts:
            sweeps.store(kept, part, self._contacts.pair)

    def leave(self, crowd: Crowd, total: Ints, state: Nodes, parts: Ints, unsettled: Ints) -> bool:
        """Gives velocities to the nodes that are held here, and impulses to ``total`` (crowd, 3), to the sums of the
        ``parts`` (parts, 3) and to what is ``unsettled`` (2,); whether any was pushed.
        """
        stops.let_go(self._room.active, self._room.braced)
        some = crowd.local, state.part, state.owned
        return bool(held.leave(state.v, parts, unsettled, total, self._slot, self._room.active, self.places, *some))

    def pushes(self) -> tuple[Indices, Floats]:
        """Which contacts have asked for an impulse in the step, and (k, 4) their impulses along the normal, and of
        friction, N s.
        """
        some = [(part, int(part.many[0])) for part in self._parts]
        pushes = [np.column_stack([p.normal[:k, PUSH], p.tangent[:k, PUSH_T:]]) for p, k in some]
        return np.concatenate([p.row[:k] for p, k in some]), np.concatenate(pushes)


class _Room:
    """Arrays for as many contacts, nodes of the crowd, and stops."""

    def __init__(self, contacts: int, nodes: int, many: int) -> None:
        self.contacts, self.nodes = contacts, nodes
        self.slots = np.empty((contacts, 4), np.int32)
        self.reach = np.empty(contacts)
        self.rows = np.empty((2, contacts), np.int32)
        self.places = np.empty(nodes, np.int32)
        self.active, self.loaded, self.braced = ActiveNodes.of(nodes), Loaded.of(contacts), Braced.room(many * nodes)
