"""Solver of the impulses of a step. The input is the active contacts of the narrow phase; the output is the velocities
v(n+1/2).
"""

from typing import Protocol

import numpy as np

from ...kernels.jit import Kernel
from ...model.state import Floats, Indices, Ints
from ...parallel.program import Program, Span
from ...parallel.team import Stage, Team
from ..surface.records import SurfaceNodes
from . import impulse_work, layout, stages, zones
from .active import IMPULSE, PUSH, PUSH_T, ActiveNodes, Loaded
from .layout import CONTACTS_N, CRACKS_N, NODES_N, PAIRS_N, SLOTS_N
from .shared_sums import ActiveSum
from .stages import CONTACTS_OF_A_TASK, END, KEPT_OF_A_TASK, SLOTS_OF_A_TASK
from .step import SolverStep
from .stops import Braced, Stops
from .zones import Zones

_NONE: Indices = np.zeros(0, np.int32)
_ROW_WEIGHTS = 4
"""Number of columns of ``ActiveNodes.row_weights``."""
_SPARE = 1.25
"""Ratio of the number of allocated rows to the present number of nodes or contacts. While a body breaks, the numbers of
nodes and contacts increase in nearly every step, and each new allocation takes time because the operating system clears
new pages. Chosen value: a bar of glass has a quarter more rows after 400 steps."""


class Bodies(Protocol):
    """Interface of rigid bodies whose nodes are slots (rigid/rows.py)."""

    active: bool
    """True if any rank has an active contact with a rigid body."""

    def take_up(self, places: Indices, surface_nodes: SurfaceNodes, scale: float) -> None:
        """Finds the slots that belong to rigid bodies."""

    def weigh(self, active: ActiveNodes) -> None:
        """Sets the row weights of the slots of rigid bodies; to be called after all contacts have added their row
        weights. Collective.
        """

    def give(self, active: ActiveNodes) -> None:
        """Moves the rigid bodies by the impulses on their slots, and sets the velocities of the slots. Collective."""

    def unsettled(self) -> Ints:
        """Returns the residual of the sweeps; see sweep_count.py."""

    def of_contact(self, parts: Ints) -> None:
        """Adds the impulses of the step to the sums ``parts`` (parts, 3), quanta."""

    def add_pressed(self, pressed: Ints) -> None:
        """Adds the impulses of the step on rigid bodies to the impulses ``pressed`` (nodes, 3) on the nodes of this
        rank, quanta.
        """


class ActiveSet:
    """Active contacts of a rank in a step, and the slots of the nodes of these contacts."""

    def __init__(self, scale: float, near: Stops, team: Team, bodies: Bodies | None = None) -> None:
        """``scale``: quanta per N s, a power of two; ``near``: walls and symmetry planes; ``bodies``: rigid bodies."""
        self.scale, self.stops, self._bodies = scale, near, bodies
        self.places: Indices = np.zeros(0, np.int32)
        """(slots,) rows, in the scene, of the nodes that were slots in the last step."""
        self.tests_rest = True
        """True if the solver first tests whether the contacts of a step need impulses."""
        self._zones = Zones(team.threads)
        self._room = _Room(0, 0, near.sides.shape, self._zones.many)
        self._handle, (self._counts, self._reals) = layout.handle(), layout.numbers()
        self._program = self._stages(team)
        self._stored = True

    def go_on(self, scale: float, sides: Floats) -> None:
        """Sets the scale, and the ``sides`` of the stops; to be called after a restart or a repartition."""
        self.scale, self._stored = scale, True
        self.stops = self.stops._replace(sides=sides.reshape(self.stops.sides.shape))

    def _stages(self, team: Team) -> Program:
        """Returns the stages of a step, in the order of their numbers."""
        table, counts, control = self._handle.address, self._counts, np.zeros(1, np.int64)
        self._handle.set(layout.STEP, counts, self._reals, control)
        border, inner = zones.tasks(self._zones.many)

        def spans(at: int, size: int, *kernels: Kernel) -> list[Stage | Span]:
            return [Span(each, table, counts, at, size) for each in kernels]

        def by_set(tasks: tuple[Ints, Ints], *kernels: Kernel) -> list[Stage | Span]:
            return [Stage(each, table, *tasks) for each in kernels]

        some, slots, kept = CONTACTS_OF_A_TASK, SLOTS_OF_A_TASK, KEPT_OF_A_TASK
        alone = layout.ONE, 1
        every = [
            *spans(CONTACTS_N, some, stages.quiet), *spans(*alone, stages.rest),
            *spans(CONTACTS_N, some, stages.mark), *spans(NODES_N, slots, stages.count),
            *spans(*alone, stages.order), *spans(NODES_N, slots, stages.number),
            *spans(CONTACTS_N, some, stages.sort), *spans(SLOTS_N, slots, stages.load), *spans(*alone, stages.begin),
            *by_set(inner, stages.weigh, stages.resume), *spans(SLOTS_N, slots, stages.give),
            *by_set(inner, stages.sweep), *spans(SLOTS_N, slots, stages.give), *spans(*alone, stages.turn),
            *spans(PAIRS_N, kept, stages.clear_pairs), *spans(CRACKS_N, kept, stages.clear_cracks),
            *by_set(inner, stages.store, stages.work), *spans(SLOTS_N, slots, stages.leave),
            *by_set(border, stages.weigh, stages.resume, stages.sweep, stages.store, stages.work),
        ]  # fmt: skip
        return Program(team, every, control)

    def bind(self, step: SolverStep) -> None:
        """Begins a step. Sets the arguments of all stages."""
        self._step, rows, nodes = step, step.rows, step.nodes
        if rows.n > len(self._room.row) or nodes.n > len(self._room.touched):
            of = int(_SPARE * rows.n), int(_SPARE * nodes.n)
            self._room = _Room(*of, self.stops.sides.shape, self._zones.many)
        room, books, found, state = self._room, step.books, rows.room, step.state
        self._handle.set(
            layout.ROWS, *found, rows.found,
            nodes.x, nodes.v, nodes.mobility, nodes.part, nodes.local, step.before, step.total, self._zones.of(nodes),
            *room.arrays, room.row, room.slots, room.reach, found.weights, found.normals, found.wanted, found.friction,
            found.pair, *step.kept, *self.stops, step.loose, state.v, state.part, state.owned,
            books.contact_loss, books.external_work, *room.sums,
        )  # fmt: skip
        counts, reals = self._counts, self._reals
        kept = len(step.kept.pairs), len(step.kept.cracks)
        counts[:] = rows.n, nodes.n, counts[SLOTS_N], *kept, 1, 0, step.sweeps, 3 if step.rubs else 1
        joules = books.account.scale, float(books.friction.scale[0])
        reals[:] = step.dt, step.ratio, self.scale, reals[layout.FASTEST], step.size, *joules

    def solve(self, step: SolverStep, shared: ActiveSum) -> bool:
        """Computes the impulses of a step, applies them, and adds their work to the accounts. ``shared``: sums over
        ranks. Returns True if a node of this rank received an impulse.
        """
        self.bind(step)
        if not len(shared.shared) and self._bodies is None:
            return self._solved()
        self.begin(shared)
        for stages_of in (self.weigh, self.resume, self.sweep, self.store, self.work):
            stages_of()
        return self.leave()

    def _solved(self) -> bool:
        """Runs all stages in one call. If no contact needs an impulse, the velocities do not change."""
        if self._step.rows.n and self._program.run(stages.QUIET if self.tests_rest else stages.MARK, END) == END:
            self._stored = True
            self._numbered()
            self._booked()
            return self._left()
        self.places, self._room.loaded.many[:] = _NONE, 0
        if self._stored:
            self._program.run(stages.CLEAR_PAIRS, stages.STORE)
            self._stored = False
        return False

    def begin(self, shared: ActiveSum) -> None:
        """Gives numbers to the contacts and to their nodes. ``shared``: sums over ranks."""
        room, self._sum = self._room, shared
        room.touched[shared.shared] = room.shared[shared.shared] = 1
        self._program.run(stages.MARK, stages.SORT)
        room.shared[shared.shared] = 0
        self._numbered()
        shared.number(room.slot)
        self._program.run(stages.SORT, stages.WEIGH)
        if self._bodies is not None:
            self._bodies.take_up(self.places, self._step.nodes, self.scale)

    def _numbered(self) -> None:
        slots, room = int(self._counts[SLOTS_N]), self._room
        if slots != len(self.places) or self.places.base is not room.places:
            self.places = room.places[:slots]

    def _complete(self, border: int, inner: int, words: Ints, first: int, columns: int) -> None:
        """Runs two stages over all contacts, and completes ``columns`` columns of ``words`` over the ranks. While the
        sums of contacts with shared slots are exchanged, the contacts without shared slots are computed.
        """
        if not len(self._sum.shared):
            self._program.run(inner, inner + 1)
            return
        self._program.run(border, border + 1)
        self._sum.begin(words, first, columns)
        self._program.run(inner, inner + 1)
        self._sum.finish(words, first, columns)

    def weigh(self) -> None:
        """Computes the row weights and completes them over the ranks."""
        active = self._room.active
        self._complete(stages.WEIGH_BORDER, stages.WEIGH, active.row_weights, 0, _ROW_WEIGHTS)
        if self._bodies is not None:
            self._bodies.weigh(active)

    def resume(self) -> None:
        """Warm start: applies the stored impulses of the last step."""
        active = self._room.active
        self._complete(stages.RESUME_BORDER, stages.RESUME, active.moving_words, IMPULSE, 3)
        if self._bodies is not None:
            self._bodies.give(active)
        self._program.run(stages.START, stages.SWEEP)

    def sweep(self) -> None:
        """Runs the sweeps. If no other rank and no rigid body takes part, all sweeps are run in one call."""
        active, bodies, counts = self._room.active, self._bodies, self._counts
        counts[layout.TURN] = 0
        if not len(self._sum.shared) and (bodies is None or not bodies.active):
            self._program.run(stages.SWEEP, stages.CLEAR_PAIRS)
            return
        for turn in range(self._step.sweeps):
            counts[layout.TURN] = turn
            self._complete(stages.SWEEP_BORDER, stages.SWEEP, active.moving_words, IMPULSE, 3)
            if bodies is not None:
                bodies.give(active)
            self._program.run(stages.GIVE, stages.TURN_OVER)

    def store(self) -> None:
        """Stores the impulses of this step."""
        self._stored = True
        self._program.run(stages.CLEAR_PAIRS, stages.WORK)
        self._program.run(stages.STORE_BORDER, stages.WORK_BORDER)

    def work(self) -> None:
        """Adds the energy that the impulses take from the bodies, the work of friction, and, if a probe needs them, the
        impulses between parts.
        """
        self._program.run(stages.WORK, stages.LEAVE)
        self._program.run(stages.WORK_BORDER, stages.WORK_BORDER + 1)
        self._booked()

    def _booked(self) -> None:
        step, room = self._step, self._room
        books = step.books
        words = books.account.words
        words += room.along.sum(axis=0)
        books.account.carry()
        if step.rubs:
            books.friction.words += room.rub.sum(axis=0)
            books.friction.carry()
        for k in range(len(room.loaded.many) if len(books.pairs) else 0):
            impulse_work.between(books.pairs, room.loaded, self.places, step.nodes.part, self.scale, k)

    def leave(self) -> bool:
        """Copies velocities to the local nodes. Adds the impulses to three sums: the impulses of the scene, the
        impulses of the parts, and the residual. Adds half of the work of the impulses. Returns True if there was any
        impulse.
        """
        self._program.run(stages.LEAVE, END)
        return self._left()

    def _left(self) -> bool:
        step, tasks = self._step, -(-len(self.places) // SLOTS_OF_A_TASK)
        left = self._room.left[:tasks].sum(axis=0)
        step.books.parts += self._room.parts[:tasks].sum(axis=0)
        step.unsettled[:] += left[:2]
        if self._bodies is not None:
            self._bodies.of_contact(step.books.parts)
            step.unsettled[:] += self._bodies.unsettled()
        return bool(left[2])

    def press(self, pressed: Ints) -> None:
        """Adds the impulses of rigid bodies in the step to ``pressed`` (nodes, 3), quanta. Does nothing if ``pressed``
        has no rows.
        """
        if self._bodies is not None and len(pressed):
            self._bodies.add_pressed(pressed)

    def pushes(self) -> tuple[Indices, Floats]:
        """Returns the rows of the contacts with an impulse in the step, and (k, 4) their normal impulses and friction
        impulses, N s.
        """
        loaded = self._room.loaded
        some = np.concatenate([np.arange(a, a + n) for a, n in zip(loaded.begin[:-1], loaded.many, strict=True)])
        return loaded.row[some], np.column_stack([loaded.normal[some, PUSH], loaded.tangent[some, PUSH_T:]])


class _Room:
    """Working arrays for ``contacts`` contacts and ``nodes`` surface nodes. ``sides``: numbers of stops and of parts;
    ``of``: number of zones.
    """

    def __init__(self, contacts: int, nodes: int, sides: tuple[int, ...], of: int) -> None:
        stops, parts, sets = *sides, 2 * zones.sets(of)
        tasks, ranges = -(-contacts // CONTACTS_OF_A_TASK), -(-nodes // SLOTS_OF_A_TASK)
        self.row, self.set_of = np.empty((2, contacts), np.int32)
        self.slots, self.reach = np.empty((contacts, 4), np.int32), np.empty(contacts)
        self.places, self.slot = np.empty(nodes, np.int32), np.empty(nodes, np.int32)
        self.touched, self.shared = np.zeros((2, nodes), np.uint8)
        self.active, self.braced = ActiveNodes.of(nodes), Braced.room(stops * nodes, ranges)
        self.loaded = Loaded.of(contacts, sets)
        self.along, self.rub = np.zeros((2, sets, 2, 2), np.int64)
        self.left, self.parts = np.zeros((ranges, 3), np.int64), np.zeros((ranges, parts, 3), np.int64)
        self.arrays = (
            *self.active, self.row, self.slots, self.reach, self.set_of, self.places, self.slot, self.touched,
            self.shared, *self.loaded, *self.braced,
        )  # fmt: skip
        flags, (many, begins) = np.zeros(tasks, np.int64), np.zeros((2, tasks, sets), np.int64)
        counted, fastest = np.zeros(ranges, np.int64), np.zeros(ranges)
        self.sums = flags, many, begins, counted, fastest, self.along, self.rub, self.left, self.parts
