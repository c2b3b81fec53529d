"""Detection of the active contacts of a step: registration of changed nodes, then the narrow phase of the candidate
pairs."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ...model.state import Block, Floats, Ints, Nodes
from ...parallel.passes import Pass
from ...parallel.team import Team
from .. import tasks
from ..broad_phase.registration import Registration
from ..exterior import Exterior
from ..scene.scene import Scene
from ..surface.families import Corners
from ..tasks import CONTACTS_OF_A_TASK, CRACKS_OF_A_TASK, FAMILIES_OF_A_TASK, PAIRS_OF_A_TASK, SLOTS_OF_A_TASK
from . import closing_speed
from .clearance import Clearance
from .corner_contact import NarrowSides
from .cracks import Cracks
from .node_face import nearest
from .tables import FAST, Step, StepRoom
from .tied import Tied

_KINEMATIC = 2.0
"""Inverse of the largest share of the altitude of a tet that a node may pass in a step."""
_FACES, _EDGES, _CRACKS = 0, 1, 2
"""Numbers of the kinds of contacts (rows.py): node-face, edge-edge, across cracks. Corner contacts have the next
numbers, one for each block."""
_JOIN = 0.6
"""Share of the distance from its line at which a slot must be registered again. In a step in which one rank has to
register slots, all other ranks register their slots beyond this share too, so that the ranks register in the same
step and wait for each other only once. No bit of the answer depends on this share."""

_NONE: Ints = np.zeros(0, np.int64)


@dataclass
class Detected:
    """Results of a detection; the active contacts are rows of the scene."""

    approach: float
    """Inverse of the step in which no node passes more than half of a tet with which it is in contact, or will be in
    contact in the next step, 1/s."""
    opening: Ints
    """Rows of the cracks that have become wide enough to open."""
    stray: bool
    """True if a slot will depart so far from its line in the next step that the slot must be registered again. After
    the reduction of the step: true if this holds on any rank."""

    @classmethod
    def nothing(cls) -> "Detected":
        """Returns the results before the first step."""
        return cls(0.0, np.zeros(0, np.int64), False)


@dataclass(frozen=True)
class Ahead:
    """Look-ahead time of the detection of contacts."""

    dt: float
    """Length of the time step, s."""
    most: float
    """Largest length of the next time step, s."""
    size: float
    """Typical size of a face, m."""
    rebound: float
    """Record of the step for kernels, see tables.Step."""

    def beyond(self, fastest: float) -> float:
        """Returns the largest length of the next step, s, if velocities that differ by up to ``fastest``, m/s, may
        close in this step a distance of FAST times the size of a face; else 0. Slower pairs cannot limit a step, so
        ranks that have only slow nodes need no data of other ranks.
        """
        return self.most if fastest * self.most > FAST * self.size else 0.0


class Detection:
    """Finds the active contacts of a rank, on the threads of its ``team``."""

    def __init__(self, team: Team, registered: Registration, *, lasting: bool = False) -> None:
        """``lasting``: True if the surface of the bodies does not change in the run."""
        self._registered, self._lasting, self.clearance = registered, lasting, Clearance()
        self.tied: Tied | None = None
        """Tied bonds of the slots of the scene."""
        self.found = Detected.nothing()
        """Results of the last step on this rank."""
        pairs, some = PAIRS_OF_A_TASK, CONTACTS_OF_A_TASK
        self._take = Pass(team, tasks.take, *tasks.TAKE, size=SLOTS_OF_A_TASK)
        self._rebound = Pass(team, tasks.rebound, *tasks.REBOUND, size=some)
        self._due_faces = Pass(team, tasks.due_faces, *tasks.DUE_FACES, size=pairs)
        self._node_face = Pass(team, tasks.node_face_pairs, *tasks.NODE_FACE, size=pairs)
        self._edge_edge = Pass(team, tasks.edge_edge_pairs, *tasks.EDGE_EDGE, size=pairs)
        self._approach = Pass(team, tasks.approach, *tasks.APPROACH, size=some)
        self._across = Pass(team, tasks.across_cracks, *tasks.ACROSS, size=CRACKS_OF_A_TASK)
        self._entering = Pass(team, tasks.entering_nodes, *tasks.ENTERING, size=FAMILIES_OF_A_TASK)
        self._ahead = Pass(team, tasks.ahead, *tasks.AHEAD, size=SLOTS_OF_A_TASK)
        self._scratch = StepRoom()
        self._rows_of_corner = 1
        """Number of rows reserved for each corner of a narrow side, on average over a task."""

    def take(self, now: Scene, nodes: Nodes) -> None:
        """Copies positions and velocities of local nodes to the scene."""
        own, surface_nodes = now.own, now.surface_nodes
        self._take.run(len(own.slots), surface_nodes.x, surface_nodes.v, own.slots, nodes.x, nodes.v, own.local)

    def retarget(self, now: Scene, share: float, give: float) -> None:
        """Sets the target velocities of active contacts: see restitution.rebound for ``share``, and ``hold_back`` if
        contact has no energy to ``give`` back (tables.PUSH_OUT).
        """
        if share > 0.0 or give == 0.0:
            rows = now.active
            self._rebound.run(rows.n, rows.room, rows.found, now.surface_nodes.v, now.slots.before, share, give == 0.0)

    def detect(
        self, now: Scene, surface: Exterior, mu: Floats, give: float, ahead: Ahead, redraw: bool, together: bool
    ) -> Detected:  # fmt: skip
        """Detects the active contacts of the step from positions and velocities of the scene's nodes.

        ``surface``: of this rank; ``mu`` (parts, parts): friction, NaN where two parts may not be in contact; ``give``:
        see tables.PUSH_OUT; ``redraw``: True if new short lines begin in this step (reference_motion.py); ``together``:
        True if any rank registers departed slots in this step.
        """
        surface_nodes, reference = now.surface_nodes, now.reference
        reference.advance(ahead.dt, ahead.most)
        if not redraw and self.clearance.holds(now) and self._far(now, together):
            return self.found
        begin, end, spread = self._moved(surface_nodes.x, surface_nodes.v, ahead.dt)
        reference.beyond = beyond = ahead.beyond(spread)
        if redraw:
            reference.shorten(surface_nodes.x)
            now.node_face.wake()
            now.edge_edge.wake()
        stray = self._renewed(now, together)
        step = Step.between(begin, end, surface_nodes.v, surface_nodes.part, mu, give, ahead.dt)
        step = step.followed(beyond, FAST * ahead.size, ahead.rebound, now.face_table(), self._scratch)
        if self.tied is not None:
            step = step._replace(tied=self.tied.bits(surface_nodes))
        now.active.begin(len(now.node_face), len(now.edge_edge), 3 * len(now.cracks))
        for block, corners in surface.narrow():
            self._corners(now, block, corners, surface.cracks, step)
        opening = self._cracks(now, ahead.size, step)
        limit = self._nodes_and_faces(now, step)
        self._edges(now, step)
        now.faces.fresh[:], now.edges.fresh[:], now.slots.fresh[:] = False, False, False
        self.found = Detected(_KINEMATIC * limit, opening, stray)
        if self._lasting and not now.active.n:
            self.clearance.measure(now, ahead.most, ahead.size)
        else:
            self.clearance.clear()
        return self.found

    def _moved(self, x: Floats, v: Floats, dt: float) -> tuple[Floats, Floats, float]:
        """Returns the positions of the slots at the beginning and at the end of a step ``dt``, s, without contact (see
        Step), and an upper bound of the difference of any two of their velocities, m/s; ``x``, ``v`` (slots, 3).
        """
        places, begin, end = self._scratch.lines(len(x))
        boxes = self._scratch.of("boxes", self._ahead.many(len(v)), np.float64, 6)
        self._ahead.run(len(x), places, boxes, x, v, dt)
        return begin, end, closing_speed.spread(boxes)

    def _far(self, now: Scene, together: bool) -> bool:
        """Measures the slots only; returns True if no pair has to be tested and no slot registered, so that there is no
        active contact.
        """
        of, reference, most = now.surface_nodes, now.reference, 0.5 * now.rules.skin
        strayed = self._registered.deviation.of_slots(reference, of.x, of.v, now.slots.tracked)
        if strayed > (_JOIN if together else 1.0) * most or not self.clearance.exceeds(reference):
            return False
        before, reference.strayed = reference.strayed, strayed
        self.found = Detected(0.0, self.found.opening, 2.0 * strayed - before > most)
        return True

    def _renewed(self, now: Scene, together: bool) -> bool:
        """Registers the slots that must be registered; returns True if a slot will depart too far in the next step, by
        linear extrapolation.
        """
        of, reference = now.surface_nodes, now.reference
        most, before = 0.5 * now.rules.skin, reference.strayed
        reference.strayed = self._registered.deviation.measure(
            reference, of.x, of.v, now.faces.corners, now.edges.corners, now.slots.tracked
        )  # fmt: skip
        due = reference.strayed > (_JOIN if together else 1.0) * most
        if due or now.pending:
            self._registered.renew(now, of.x, of.v, due)
            before = reference.strayed = reference.farthest(now.slots.tracked)
        return 2.0 * reference.strayed - before > most

    def _nodes_and_faces(self, now: Scene, step: Step) -> float:
        """Adds node-face contacts; returns the largest speed over the altitude of a tet, 1/s."""
        table, rows, end = now.node_face, now.active, now.reference.end
        slots, faces = now.slot_table(), now.face_table()
        pairs, n = table.arrays(), len(table)
        many, depth = self._due_faces.many(n), rows.depth
        due, counts = self._scratch.of("due", many), self._scratch.of("on faces", many)
        coming = self._scratch.of("coming", many, np.float64)
        self._due_faces.run(n, pairs, slots, faces, end + step.beyond, due)
        some = rows.room, depth, rows.begins(_FACES), pairs, slots, faces, step, end
        self._node_face.run(n, *some, due, counts, coming)
        begins = _offsets(len(due))
        table.take_tested(pairs.active, begins, due)
        before = rows.n
        rows.collect(_FACES, begins, counts)
        found, holder = rows.found[before : rows.n], rows.holder(now.surface_nodes.n)
        m = int(nearest(found, rows.room, depth, pairs, faces, step.part, holder))
        rows.n = before + m
        most = self._scratch.of("most", self._approach.many(m), np.float64)
        self._approach.run(m, rows.room, found, pairs, faces, step, most)
        return float(np.sqrt(max(coming.max(initial=0.0), most.max(initial=0.0))))

    def _edges(self, now: Scene, step: Step) -> None:
        """Adds edge-edge contacts."""
        table, rows, reference = now.edge_edge, now.active, now.reference
        pairs, n = table.arrays(), len(table)
        many = self._edge_edge.many(n)
        due, counts = self._scratch.of("tested", many), self._scratch.of("on edges", many)
        some = rows.room, rows.begins(_EDGES), pairs, now.edge_table(), step, reference.short.course, reference.end
        self._edge_edge.run(n, *some, due, counts)
        begins = _offsets(len(due))
        table.take_tested(pairs.active, begins, due)
        rows.collect(_EDGES, begins, counts)

    def _cracks(self, now: Scene, size: float, step: Step) -> Ints:
        """Adds contacts across cracks; returns the cracks that open."""
        rows, n = now.active, len(now.cracks)
        if not n:
            return _NONE
        many, scratch = self._across.many(n), self._scratch
        counts, wide, opening = scratch.of("across", many), scratch.of("wide", many), scratch.of("opening", n)
        self._across.run(n, rows.room, rows.begins(_CRACKS), opening, now.cracks, size, step, counts, wide)
        begins = CRACKS_OF_A_TASK * np.arange(len(wide))
        rows.collect(_CRACKS, 3 * begins, counts)
        return np.concatenate([opening[:0], *(opening[k : k + m] for k, m in zip(begins, wide, strict=True) if m)])

    def _corners(self, now: Scene, block: Block, corners: Corners, cracks: Cracks, step: Step) -> None:
        """Adds contacts at the ``corners`` of a block."""
        n = len(corners.start) - 1
        begins = corners.start[:n:FAMILIES_OF_A_TASK].astype(np.int64)
        counts, spaces = np.zeros(len(begins), np.int64), np.diff(np.append(begins, corners.start[-1]))
        narrow = NarrowSides(
            cracks.nodes, cracks.sides, block.tets, block.across, block.bond, cracks.families.ring, now.own.place
        )  # fmt: skip
        while True:
            each, rows = self._rows_of_corner, now.active
            kind = rows.more(each * len(corners.corners))
            self._entering.run(n, rows.room, rows.begins(kind), each, narrow, corners, step, counts)
            if (counts <= each * spaces).all():
                break
            self._rows_of_corner *= 2
        now.active.collect(kind, each * begins, counts)


@cache
def _offsets(many: int) -> Ints:
    """(many,) first pair of each task."""
    return PAIRS_OF_A_TASK * np.arange(many)
