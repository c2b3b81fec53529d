"""Calls of the contact kernels for the tests: if the signature of a kernel changes, only this file changes."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from conoid.worker.contact.broad_phase.pairs import PairTable
from conoid.worker.contact.narrow_phase import edge_edge as edge_kernels
from conoid.worker.contact.narrow_phase import node_face as face_kernels
from conoid.worker.contact.narrow_phase import single_contact
from conoid.worker.contact.narrow_phase.rows import ActiveRows
from conoid.worker.contact.narrow_phase.tables import (
    DEEP,
    DEEP_SELF,
    PUSH_OUT,
    ContactRows,
    EdgeTable,
    FaceTable,
    Pairs,
    SlotTable,
    Step,
)
from conoid.worker.contact.solver.active import Kept
from conoid.worker.contact.solver.shared_sums import ActiveSum, SharedSums
from conoid.worker.contact.solver.solver import ActiveSet
from conoid.worker.contact.solver.step import SolverStep
from conoid.worker.contact.solver.stops import Stops
from conoid.worker.contact.surface.records import SurfaceNodes
from conoid.worker.model.state import Ints
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.fixed_point import Tally
from conoid.worker.parallel.team import team

from ..worker.meshes import Floats
from .bodies import Indices


def every_pair(tested: "np.ndarray", things: int) -> Indices:
    """Returns (p, 2) all pairs of one of the nodes ``tested`` and one of the ``things``, sorted by node, then by
    thing.
    """
    return np.column_stack([np.repeat(tested, things), np.tile(np.arange(things), len(tested))]).astype(np.int32)


def face_sizes(x: Floats, faces: Indices) -> Floats:
    """Returns (f,) face sizes: square roots of twice the areas, m."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    return np.asarray(np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1)))


def edge_sizes(x: Floats, edges: Indices) -> Floats:
    """Returns (e,) lengths of edges, m."""
    return np.asarray(np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1))


def edge_depths(x: Floats, edges: Indices) -> Floats:
    """Returns (e,) the largest depth of a contact of each edge, m. The depth is DEEP times the length of the edge or
    times the lowest height of the tets of its faces, at least DEEP_SELF times the length.
    """
    (a, b, c, d, e, f), size = edges.T, edge_sizes(x, edges)
    low = np.minimum(lowest_heights(x[np.stack([a, b, c, e], 1)]), lowest_heights(x[np.stack([a, b, d, f], 1)]))
    return np.asarray(np.maximum(DEEP * np.minimum(size, low), DEEP_SELF * size))


def lowest_heights(tets: Floats) -> Floats:
    """Returns (n,) lowest heights of tets (n, 4, 3), m: three times the volume over the largest face."""
    volumes = np.abs(np.linalg.det(tets[:, 1:] - tets[:, :1])) / 6.0
    one, two, three = (tets[:, [[0, 0, 0, 1], [1, 1, 2, 2], [2, 3, 3, 3]][k]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(two - one, three - one), axis=2)
    return np.asarray(3.0 * volumes / areas.max(axis=1))


def many(met: ContactRows) -> int:
    """Returns the number of active contacts."""
    return len(met.nodes)


def taken(met: ContactRows, rows: "np.ndarray") -> ContactRows:
    """Returns some of the active contacts, in the order of the given indices."""
    return ContactRows(*(column[rows] for column in met))


def moments(out: Floats) -> Floats:
    """Returns (n, 12) means of n and of n n (xx, yy, zz, yz, zx, xy) over the normals n (n, faces, 3) of the faces of
    nodes, and zero as the mean direction to the faces.
    """
    squares = np.einsum("nfi,nfj->nij", out, out) / out.shape[1]
    pairs = [squares[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))]
    return np.ascontiguousarray(np.column_stack([out.mean(axis=1), *pairs, np.zeros((len(out), 3))]))


def step_of(x: Floats, v: Floats, part: "np.ndarray", dt: float, mu: Floats | None = None) -> Step:
    """Returns the step record of slots at ``x`` with velocities ``v``; without ``mu`` (parts, parts) the contacts have
    no friction.
    """
    friction = np.zeros((9, 9)) if mu is None else mu
    return Step.of(x, v, part.astype(np.int32), friction, PUSH_OUT, dt)


def slot_table(first: Indices, normals: Floats, left: Floats, course: Floats) -> SlotTable:
    """Returns slots that are all on the surface; see tables.SlotTable."""
    n = len(first)
    return SlotTable(normals, np.ones(n, bool), first, left, course, np.zeros(n, bool))


def face_table(corners: Indices, size: Floats, left: Floats) -> FaceTable:
    """Returns exposed faces, by ascending id."""
    n, none = len(corners), np.zeros(len(corners), bool)
    return FaceTable(corners, size, np.arange(n), ~none, left, none.copy())


def edge_table(corners: Indices, size: Floats, deep: Floats, left: Floats) -> EdgeTable:
    """Returns edges between exposed faces."""
    n = len(corners)
    return EdgeTable(corners, size, deep, np.ones(n, bool), left, np.zeros(n, bool))


def pair_table(pairs: Indices) -> PairTable:
    """Returns candidate pairs that have not been tested yet."""
    table = PairTable()
    table.add(np.asarray(pairs, np.int32))
    return table


def faces_met(pairs: Pairs, slots: SlotTable, faces: FaceTable, step: Step, end: float) -> tuple[ContactRows, int]:
    """Returns the active contacts of nodes and faces, and the number of tested pairs; ``pairs.active`` begins with the
    active contacts.
    """
    n = len(pairs.rows)
    room, depth, found = ContactRows.room(n), np.zeros(n), np.arange(n, dtype=np.int32)
    tested = int(face_kernels.due(pairs, slots, faces, end + step.beyond, 0, n))
    met, _ = face_kernels.node_face(room, depth, 0, pairs, slots, faces, step, end, 0, tested)
    earlier, last, listed = np.empty(n, np.int32), np.full(len(step.x), -1, np.int32), found[:met]
    single_contact.link(earlier, last, listed, room.nodes)
    single_contact.admitted(room, depth, pairs, slots, faces, step, listed, earlier, last, end, 0, met)
    held = single_contact.nearest(listed, room, depth, pairs, faces, step.part, earlier, last)
    assert (last == -1).all()
    return taken(room, found[:held]), tested


def edges_met(pairs: Pairs, edges: EdgeTable, step: Step, course: Floats, end: float) -> tuple[ContactRows, int]:
    """Returns the active contacts of edges, and the number of tested pairs; ``pairs.active`` begins with the active
    contacts.
    """
    room = ContactRows.room(len(pairs.rows))
    met, tested = edge_kernels.edge_edge(room, 0, pairs, edges, step, course, end, 0, len(pairs.rows))
    return taken(room, np.arange(met)), int(tested)


def node_face(
    x: Floats, v: Floats, faces: Indices, pairs: Indices, dt: float, part: "np.ndarray | None" = None,
    mu: Floats | None = None, out: Floats | None = None, normals: Floats | None = None,
) -> ContactRows:  # fmt: skip
    """Returns the contacts of nodes that pass a face; the nodes are of another part unless ``part`` is given. ``out``
    (n, faces, 3): unit normals of the faces of a node, which have equal areas, zero for a node without faces; or
    ``normals`` (n, 12), see SlotTable.
    """
    own = np.where(np.isin(np.arange(len(x)), faces), 0, 1) if part is None else part
    table, first = pair_table(pairs), np.full(len(x), -1, np.int32)
    table.hang(first, 0)
    if normals is None:
        normals = np.zeros((len(x), 12)) if out is None else moments(out)
    slots = slot_table(first, normals, np.zeros(len(x)), v.copy())
    of = face_table(faces, face_sizes(x, faces), np.zeros(len(faces)))
    met, tested = faces_met(table.arrays(), slots, of, step_of(x, v, own, dt, mu), 0.0)
    assert tested == len(pairs)
    return met


def edge_edge(
    x: Floats, v: Floats, edges: Indices, pairs: Indices, dt: float, mu: Floats | None = None, *, never: int = 0
) -> ContactRows:  # fmt: skip
    """Returns the contacts of edges that pass an edge; ``never``: number of pairs that are deactivated permanently."""
    table = pair_table(pairs)
    of = edge_table(edges, edge_sizes(x, edges), edge_depths(x, edges), np.zeros(len(edges)))
    step = step_of(x, v, np.zeros(len(x)), dt, mu)
    met, tested = edges_met(table.arrays(), of, step, np.zeros_like(x), 0.0)
    assert tested == len(pairs) - never
    return met


def column(n: int) -> ContactRows:
    """Returns ``n`` nodes in a row along x; each node touches the next node."""
    nodes = np.column_stack([np.arange(1, n), np.arange(n - 1), np.arange(n - 1), np.arange(n - 1)]).astype(np.int32)
    weights, normals = np.tile([1.0, -1.0, 0.0, 0.0], (n - 1, 1)), np.tile([1.0, 0.0, 0.0], (n - 1, 1))
    none = np.full(n - 1, -1, np.int32)
    return ContactRows(nodes, weights, normals, np.zeros(n - 1), np.zeros(n - 1), none)


def unit(random: np.random.Generator, n: int) -> Floats:
    """Returns (n, 3) random directions."""
    directions = random.normal(size=(n, 3))
    return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])


def network(
    seed: int, meetings: int = 30, nodes: int = 25, friction: float = 0.0, wanted: float = 0.0, one_normal: bool = False
) -> tuple[ContactRows, Floats, Floats]:
    """Returns random contacts with common nodes, of nodes with faces and of edges; also returns velocities, and masses
    with ratios up to 1000:1.
    """
    random = np.random.default_rng(seed)
    rows = np.array([random.choice(nodes, 4, replace=False) for _ in range(meetings)], np.int32).reshape(-1, 4)
    share, s, t = random.dirichlet(np.ones(3), meetings), random.uniform(size=meetings), random.uniform(size=meetings)
    faces = np.column_stack([np.ones(meetings), -share])
    edges = np.column_stack([1.0 - t, t, s - 1.0, -s])
    weights = np.where(random.uniform(size=(meetings, 1)) < 0.7, faces, edges)
    normals = np.tile(unit(random, 1), (meetings, 1)) if one_normal else unit(random, meetings)
    want, mu = -wanted * random.uniform(size=meetings), np.full(meetings, friction)
    mobility = np.repeat(10.0 ** random.uniform(-1.5, 1.5, (nodes, 1)), 3, axis=1)
    pair = np.arange(meetings, dtype=np.int32)
    return ContactRows(rows, weights, normals, want, mu, pair), 10.0 * random.normal(size=(nodes, 3)), mobility


class Solver:
    """Sweeps over contacts of nodes with a mobility (nodes, 3), 1/kg; impulses are in quanta of 1 / ``scale`` N s."""

    def __init__(
        self, met: ContactRows, v: Floats, mobility: Floats, scale: float = 2.0**40, active: ActiveSet | None = None,
        stops: Stops | None = None,
    ) -> None:  # fmt: skip
        """Creates the sweeps; ``active``: arrays of another step, to be used again. ``stops``: all nodes are at the
        origin, the first node belongs to part 0, all other nodes belong to part 1.
        """
        self.met, self.v, self.scale, n = met, v.copy(), scale, len(v)
        self.unsettled = np.zeros(2, np.int64)
        self.total = np.zeros((n, 3), np.int64)
        nothing, every, part = np.zeros((0, 3)), np.arange(n, dtype=np.int32), np.ones(n, np.int32)
        part[0] = 0
        none = Stops(nothing, nothing, np.zeros((0, 2)), np.zeros(0), np.zeros(0, bool))
        self.active = active or ActiveSet(scale, stops or none, team(1))
        self._surface_nodes = SurfaceNodes(np.arange(n), every, part, part, mobility, np.zeros((n, 3)), self.v, self.v)
        self._nodes: Any = SimpleNamespace(v=self.v, part=part, owned=np.ones(n, bool))
        loss, words = np.zeros(n), np.zeros((2, 2), np.int64)
        account: Any = SimpleNamespace(scale=1.0, words=words, carry=lambda: None)
        self.books: Any = SimpleNamespace(
            contact_loss=loss, external_work=loss, account=account, friction=Tally(np.ones(2)),
            parts=np.zeros((2, 3), np.int64), pairs=np.zeros((0, 0, 3)),
        )  # fmt: skip
        self.before = np.zeros((n, 3))
        self.begin(np.zeros((n, 3)))

    def begin(self, x: Floats) -> None:
        """Begins a step with the nodes at ``x``."""
        self._surface_nodes.x, met = x, self.met
        rows = ActiveRows(met, np.arange(many(met), dtype=np.int32), n=many(met))
        nothing = Kept(*np.zeros((2, 0, 4)))
        self._step = SolverStep(
            rows, self._surface_nodes, self.before, self.total, self._nodes, np.zeros(len(x), bool), self.books,
            self.unsettled, nothing, 1.0, 1, rubs=True, size=1.0, dt=1.0,
        )  # fmt: skip
        self.active.bind(self._step)
        self.active.begin(SharedSums([], SerialComm()).agree(rows, self._surface_nodes.local))
        self.active.weigh()

    def _go_on(self, **changes: Any) -> None:
        self._step = replace(self._step, **changes)
        self.active.bind(self._step)

    @property
    def push(self) -> Floats:
        """Returns (n, 4) impulses of contacts along the normal and of friction, N s."""
        push = np.zeros((many(self.met), 4))
        rows, push_of = self.active.pushes()
        push[rows] = push_of
        return push

    def sweep(self, times: int = 1) -> Floats:
        """Returns the velocities after ``many`` sweeps without momentum."""
        self._go_on(sweeps=1)
        for _ in range(times):
            self.active.sweep()
            self._leave()
        return self.v

    def step(self, sweeps: int) -> Floats:
        """Returns the velocities after a step of ``many`` sweeps with momentum."""
        self._go_on(sweeps=sweeps)
        self.active.sweep()
        self._leave()
        return self.v

    def _leave(self) -> None:
        self.active.leave()
        assert (self.total.sum(axis=0) == 0).all()

    @property
    def kept(self) -> Kept:
        """Returns the stored impulses of the step; the arrays had other values before."""
        kept = Kept(*np.full((2, many(self.met), 4), np.nan))
        self._go_on(kept=kept)
        self.active.store()
        return kept

    def resume(self, kept: Kept, ratio: float = 1.0) -> None:
        """Applies a warm start with ``ratio`` times the impulses ``kept``."""
        self._go_on(kept=kept, ratio=ratio)
        self.active.resume()
        self._leave()

    def solve(self, sweeps: int, shared: Indices) -> tuple[Ints, Ints]:
        """Runs a whole step in which other ranks share the nodes ``shared`` and have no impulses; returns the words of
        the work along the normals and of the work of friction.
        """
        self.books.account.words, self.books.friction = np.zeros((2, 2), np.int64), Tally(np.ones(2))
        self._step = replace(self._step, sweeps=sweeps, kept=Kept(*np.zeros((2, many(self.met), 4))))
        nobody, none = np.zeros((0, 2), np.int64), np.zeros(0, np.int32)
        self.active.solve(self._step, ActiveSum([], none, shared, nobody, SerialComm()))
        return self.books.account.words, self.books.friction.words

    def heat(self, v_old: Floats) -> float:
        """Returns the work of friction, J, of the contacts that have an impulse, computed with the velocities
        ``v_old``.
        """
        self.books.friction = Tally(np.ones(2))
        self._go_on(before=v_old)
        self.active.work()
        return float(self.books.friction.total(SerialComm())[0])
