"""Detection of the active contacts of a step. First changed nodes are registered; then the narrow phase tests the
candidate pairs."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ...model.state import Block, Floats, Ints, Nodes
from ...parallel.arguments import Arguments
from ...parallel.program import Program, Span
from ...parallel.team import Team
from ..broad_phase.registration import Registration
from ..exterior import Exterior
from ..scene.scene import Scene
from ..surface.families import Corners
from . import layout, stages
from .clearance import Clearance
from .corner_contact import NarrowSides
from .cracks import Cracks
from .rows import gathered
from .stages import (
    CONTACTS_OF_A_TASK,
    CRACKS_OF_A_TASK,
    FAMILIES_OF_A_TASK,
    PAIRS_OF_A_TASK,
    SIDES_OF_A_TASK,
    SLOTS_OF_A_TASK,
)
from .tables import FAST, Step, StepRoom
from .tied import Tied

_KINEMATIC = 2.0
"""Inverse of the largest fraction of the altitude of a tet that a node may pass in one step."""
_FACES, _EDGES, _CRACKS, _CORNERS = 0, 1, 2, 3
"""Numbers of the kinds of contacts (rows.py): node-face, edge-edge, across cracks, at corners. Each block has a
separate number for contacts at corners."""
_JOIN = 0.6
"""Fraction of the distance from its line at which a slot must be registered again. If at least one rank must register
slots in a step, all other ranks register their slots that have departed by more than the fraction ``_JOIN``. Therefore
ranks register in the same steps and wait for each other less often. The answer does not depend on ``_JOIN``."""

_NONE: Ints = np.zeros(0, np.int64)


@dataclass
class Detected:
    """Results of a detection. The active contacts are in the scene, as rows."""

    approach: float
    """Inverse of the largest time step, 1/s, in which no node passes more than half of a tet with which it is in
    contact, or will be in contact in the next step."""
    opening: Ints
    """Rows of the cracks that are wide enough to open, that is, to become part of the surface."""
    stray: bool
    """True if a slot will depart so far from its line in the next step that it must be registered again. After the
    reduction of the step the value is True if it was True on any rank."""

    @classmethod
    def nothing(cls) -> "Detected":
        """Returns the results before the first step."""
        return cls(0.0, np.zeros(0, np.int64), False)


@dataclass(frozen=True)
class Ahead:
    """Parameters of the detection for the time after the step."""

    dt: float
    """Length of the time step, s."""
    most: float
    """Largest length of the next time step, s."""
    size: float
    """Typical size of a face, m."""
    rebound: float
    """Largest velocity change divided by the closing speed; see tables.Step."""
    give: float = 0.0
    """Fraction of a penetration that is corrected; see tables.PUSH_OUT."""


class Detection:
    """Finds the active contacts of a rank, on the threads of its ``team``."""

    def __init__(self, team: Team, registered: Registration, *, lasting: bool = False) -> None:
        """``lasting``: True if the surface of the bodies is constant during the run."""
        self._registered, self._lasting, self.clearance = registered, lasting, Clearance()
        self.tied: Tied | None = None
        """Tied bonds of the slots of the scene."""
        self.found = Detected.nothing()
        """Results of the last step on this rank."""
        self._handle, self._team = layout.handle(), team
        self._counts, self._reals, control = np.zeros(layout.COUNTS, np.int64), np.zeros(layout.REALS), np.zeros(1, int)
        self._handle.set(layout.NUMBERS, self._counts, self._reals, control)
        self._program = Program(team, self._stages(), control)
        self._corner_tables: list[Arguments] = []
        self._families = np.zeros(0, np.int64)
        """(blocks,) number of families in each block."""
        self._scratch, self._sizes, self._sums = StepRoom(), tuple[int, ...](), list[np.ndarray]()
        self._rows_of_corner = 1
        """Number of rows that are reserved for each corner of a narrow side, as a mean over a task."""

    def _stages(self) -> list[Span]:
        """Returns the stages of a step, in the order of their numbers."""
        slots, pairs, some, sides = SLOTS_OF_A_TASK, PAIRS_OF_A_TASK, CONTACTS_OF_A_TASK, SIDES_OF_A_TASK
        every = [
            (stages.take, layout.OWN_N, slots), (stages.ahead, layout.SLOTS_N, slots), (stages.spread, layout.ONE, 1),
            (stages.leave, layout.SLOTS_N, slots), (stages.largest_faces, layout.FACES_N, sides),
            (stages.largest_edges, layout.EDGES_N, sides), (stages.check, layout.ONE, 1),
            (stages.across, layout.CRACKS_N, CRACKS_OF_A_TASK), (stages.due, layout.FACE_PAIRS_N, pairs),
            (stages.on_faces, layout.FACE_PAIRS_N, pairs), (stages.link, layout.ONE, 1),
            (stages.admit, layout.ON_FACES, some), (stages.nearest, layout.ONE, 1),
            (stages.approach, layout.ON_FACES, some), (stages.on_edges, layout.EDGE_PAIRS_N, pairs),
            (stages.collect, layout.ONE, 1), (stages.retarget, layout.RETARGETED, some),
        ]  # fmt: skip
        return [Span(kernel, self._handle.address, self._counts, at, size) for kernel, at, size in every]

    def take(self, now: Scene, nodes: Nodes) -> None:
        """Copies positions and velocities of local nodes to the scene."""
        of, own, lines, counts = now.surface_nodes, now.own, now.reference, self._counts
        n = of.n
        tasks = -(-n // SLOTS_OF_A_TASK)
        places, self._begin, self._end = self._scratch.lines(n)
        boxes = self._scratch.of("boxes", tasks, np.float64, 6)
        strayed, searched, short = self._scratch.of("strayed", tasks, np.float64), lines.searched, lines.short
        self._handle.set(
            layout.OWN, own.slots, own.local, nodes.x, nodes.v, of.x, of.v, places, now.slots.before, boxes,
            searched.left, searched.x, searched.course, short.left, short.x, short.course, now.slots.tracked, strayed,
            lines.faces, now.faces.corners, lines.edges, now.edges.corners,
        )  # fmt: skip
        faces, edges = len(now.faces.corners), len(now.edges.corners)
        counts[: layout.CRACKS_N] = len(own.slots), n, faces, edges
        counts[layout.ONE] = 1
        self._program.run(stages.TAKE, stages.AHEAD)

    def detect(
        self, now: Scene, surface: Exterior, mu: Floats, ahead: Ahead, redraw: bool, together: bool
    ) -> Detected:  # fmt: skip
        """Detects the active contacts of the step from positions and velocities of the scene's nodes.

        ``surface``: surface of this rank; ``mu`` (parts, parts): coefficient of friction, NaN if two parts cannot be in
        contact; ``redraw``: True if new short lines begin in this step (reference_motion.py); ``together``: True if any
        rank registers departed slots in this step.
        """
        reference = now.reference
        reference.advance(ahead.dt, ahead.most)
        if not redraw and self.clearance.holds(now) and self._far(now, together):
            return self.found
        stray = self._moved(now, ahead, redraw, together)
        of = now.surface_nodes
        step = Step.between(self._begin, self._end, of.v, of.part, mu, ahead.give, ahead.dt)
        step = step.followed(reference.beyond, FAST * ahead.size, ahead.rebound, now.face_table(), self._scratch)
        if self.tied is not None:
            step = step._replace(tied=self.tied.bits(of))
        opening = self._met(now, surface, step)
        now.faces.fresh[:], now.edges.fresh[:], now.slots.fresh[:] = False, False, False
        self.found = Detected(_KINEMATIC * float(np.sqrt(self._reals[layout.LIMIT])), opening, stray)
        if self._lasting and not now.active.n:
            self.clearance.measure(now, ahead.most, ahead.size)
        else:
            self.clearance.clear()
        return self.found

    def retarget(self, now: Scene, share: float, give: float) -> None:
        """Sets the target velocities of active contacts. ``share``: see restitution.rebound; ``give``: fraction of a
        penetration that is corrected (tables.PUSH_OUT). If ``give`` is 0, contact has no energy to return, and
        ``hold_back`` is applied.
        """
        counts = self._counts
        counts[layout.RETARGETS] = (share > 0.0) + 2 * (give == 0.0)
        if counts[layout.RETARGETS]:
            counts[layout.RETARGETED], self._reals[layout.SHARE] = now.active.n, share
            self._program.run(stages.RETARGET, stages.CORNERS_FROM)

    def _moved(self, now: Scene, ahead: Ahead, redraw: bool, together: bool) -> bool:
        """Measures the motion of the slots in the step, and registers the slots that must be registered. Returns True
        if a slot will depart too far in the next step, by linear extrapolation.
        """
        of, reference, reals = now.surface_nodes, now.reference, self._reals
        reals[:] = ahead.dt, ahead.most, FAST * ahead.size, reference.t, reference.end, 0.0, 0.0, 0.0, ahead.size, 0.0
        if redraw:
            reference.shorten(of.x)
            now.node_face.wake()
            now.edge_edge.wake()
        self._program.run(stages.AHEAD, stages.ACROSS)
        reference.beyond = float(reals[layout.BEYOND])
        before, most = reference.strayed, 0.5 * now.rules.skin
        reference.strayed = float(reals[layout.STRAYED])
        due = reference.strayed > (_JOIN if together else 1.0) * most
        if due or now.pending:
            self._registered.renew(now, of.x, of.v, due)
            before = reference.strayed = reference.farthest(now.slots.tracked)
        return 2.0 * reference.strayed - before > most

    def _far(self, now: Scene, together: bool) -> bool:
        """Measures the motion of the slots only. Returns True if no pair must be tested and no slot must be registered;
        in this case no contact is active.
        """
        of, reference, most = now.surface_nodes, now.reference, 0.5 * now.rules.skin
        strayed = self._registered.deviation.of_slots(reference, of.x, of.v, now.slots.tracked)
        if strayed > (_JOIN if together else 1.0) * most or not self.clearance.exceeds(reference):
            return False
        before, reference.strayed = reference.strayed, strayed
        self.found = Detected(0.0, self.found.opening, 2.0 * strayed - before > most)
        return True

    def _met(self, now: Scene, surface: Exterior, step: Step) -> Ints:
        """Finds the active contacts of the step. Returns the cracks that open."""
        rows, counts = now.active, self._counts
        narrow = surface.narrow()
        self._reserve(now, narrow)
        counts[layout.FIRST] = self._corners(now, narrow, surface.cracks, step) if narrow else 0
        opening = self._bound(now, step)
        self._program.run(stages.ACROSS, stages.RETARGET)
        rows.n = int(counts[layout.FOUND])
        if not counts[layout.WIDE]:
            return _NONE
        wide = self._sums[-1]
        begins = CRACKS_OF_A_TASK * np.arange(len(wide))
        return np.concatenate([opening[k : k + m] for k, m in zip(begins, wide, strict=True) if m])

    def _reserve(self, now: Scene, narrow: list[tuple[Block, Corners]]) -> None:
        """Reserves the rows for the contacts of the step."""
        corners = [self._rows_of_corner * len(each.corners) for _, each in narrow]
        now.active.begin(len(now.node_face), len(now.edge_edge), 3 * len(now.cracks), *corners)

    def _bound(self, now: Scene, step: Step) -> Ints:
        """Sets the arguments of the stages. Returns the array of the cracks that open."""
        rows, counts, on, off, m = now.active, self._counts, len(now.node_face), len(now.edge_edge), len(now.cracks)
        if (sizes := (on, off, m)) != self._sizes:
            self._sizes, self._sums = sizes, self._rooms(*sizes)
        (opening, due, *_, tested, _, _, _), one, two = self._sums, now.node_face.arrays(), now.edge_edge.arrays()
        self._handle.set(
            layout.ROWS, *rows.room, rows.found, rows.depth, rows.earlier, rows.holder(now.surface_nodes.n), *step,
            *one, *now.slot_table(), *now.face_table(), *two, *now.edge_table(), now.reference.short.course,
            now.cracks, *self._sums,
        )  # fmt: skip
        counts[layout.CRACKS_N : layout.FIRST] = m, on, off
        counts[layout.FACE_ROWS :] = rows.begins(_FACES), rows.begins(_EDGES), rows.begins(_CRACKS)
        now.node_face.take_tested(one.active, _offsets(len(due)), due)
        now.edge_edge.take_tested(two.active, _offsets(len(tested)), tested)
        return opening

    def _rooms(self, on: int, off: int, m: int) -> list[np.ndarray]:
        """Returns working arrays for ``on`` node-face pairs, ``off`` edge-edge pairs and ``m`` cracks; see CRACKS and
        SUMS in layout.py.
        """
        faces, edges, cracks = -(-on // PAIRS_OF_A_TASK), -(-off // PAIRS_OF_A_TASK), -(-m // CRACKS_OF_A_TASK)
        some, real = self._scratch.of, np.float64
        return [
            some("opening", m), some("due", faces), some("on faces", faces), some("coming", faces, real),
            some("most", faces, real), some("tested", edges), some("on edges", edges), some("across", cracks),
            some("wide", cracks),
        ]  # fmt: skip

    def _corners(self, now: Scene, narrow: list[tuple[Block, Corners]], cracks: Cracks, step: Step) -> int:
        """Adds the contacts at the corners of all blocks; returns the number of these contacts."""
        if len(narrow) != len(self._corner_tables):
            self._prepare(len(narrow))
        n = 0
        while True:
            every = enumerate(narrow)
            found = [self._at_block(now, k, block, corners, cracks, step) for k, (block, corners) in every]
            self._at_corners.run()
            if all((counts <= self._rows_of_corner * spaces).all() for counts, _, spaces in found):
                break
            self._rows_of_corner *= 2
            self._reserve(now, narrow)
        for k, (counts, begins, _) in enumerate(found):
            first = now.active.begins(_CORNERS + k)
            n = int(gathered(now.active.found, n, first + self._rows_of_corner * begins, counts))
        return n

    def _prepare(self, blocks: int) -> None:
        """Makes the program that processes the corners of ``blocks``."""
        self._families = np.zeros(blocks, np.int64)
        self._corner_tables = [Arguments(*stages.AT_CORNERS) for _ in range(blocks)]
        some = enumerate(self._corner_tables)
        every = [Span(stages.at_corners, t.address, self._families, k, FAMILIES_OF_A_TASK) for k, t in some]
        self._at_corners = Program(self._team, every, np.zeros(1, np.int64))

    def _at_block(
        self, now: Scene, k: int, block: Block, corners: Corners, cracks: Cracks, step: Step
    ) -> tuple[Ints, Ints, Ints]:  # fmt: skip
        """Sets the arguments of the stage of block number ``k``. Returns three arrays with one value for each task:
        number of contacts, which the stage sets; first corner; and number of corners.
        """
        n = len(corners.start) - 1
        begins = corners.start[:n:FAMILIES_OF_A_TASK].astype(np.int64)
        counts = self._scratch.of(f"at corners {k}", len(begins))
        sides = cracks.nodes, cracks.sides, block.tets, block.across, block.bond, cracks.families.ring, now.own.place
        self._families[k] = n
        each = now.active.begins(_CORNERS + k), self._rows_of_corner
        self._corner_tables[k].set(now.active.room, *each, NarrowSides(*sides), corners, step, counts)
        return counts, begins, np.diff(np.append(begins, corners.start[-1]))


@cache
def _offsets(many: int) -> Ints:
    """(many,) index of the first pair of each task."""
    return PAIRS_OF_A_TASK * np.arange(many)
