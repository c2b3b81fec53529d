"""Deactivated pairs are not in contact: random motions, jumps of velocity and cracks are compared with tests of all
pairs.
"""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import parse_case, read_data
from conoid.worker import simulation, step
from conoid.worker.accounts.digest import digest
from conoid.worker.contact.broad_phase.deviation import Deviation
from conoid.worker.contact.broad_phase.pairs import PairTable
from conoid.worker.contact.broad_phase.reference_motion import Lines, ReferenceMotion
from conoid.worker.contact.narrow_phase.tables import ContactRows, EdgeTable, FaceTable, Pairs, SlotTable, Step
from conoid.worker.model.columns import Columns
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.parallel.team import team

from ..worker.meshes import Floats
from .bodies import Flags, Indices
from .kernels import (
    edge_depths,
    edge_sizes,
    edge_table,
    edges_met,
    face_sizes,
    face_table,
    faces_met,
    moments,
    pair_table,
    slot_table,
    step_of,
)
from .shards import CORNERS, EDGES, FACES

SHARDS, STEPS = 60, 40
SHORT = 8
"""Number of steps between two renewals of the reference lines of the pairs."""


def apart(one: "np.ndarray", two: "np.ndarray") -> Indices:
    """Returns (p, 2) all rows of ``one`` combined with all rows of ``two`` that belong to another tet of the cloud."""
    pairs = np.stack(np.meshgrid(np.arange(len(one)), np.arange(len(two)), indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(pairs[one[pairs[:, 0]] != two[pairs[:, 1]]], np.int32)


def wake(pairs: Pairs) -> Pairs:
    """Marks all pairs as untested."""
    pairs.until[:], pairs.speed[:], pairs.turned[:] = -np.inf, np.nan, False
    return pairs


def known_of(pairs: Pairs, one: Flags, two: Flags) -> Flags:
    """Returns (p,) pairs with valid bounds and without a change in the flags ``one`` and ``two``."""
    return np.asarray(~np.isneginf(pairs.until) & ~one[pairs.rows[:, 0]] & ~two[pairs.rows[:, 1]])


class Tables:
    """Pairs of nodes and faces, pairs of edges, and the contacts of a step."""

    def __init__(self, nodes: Indices, ridges: Indices, every: bool) -> None:
        """Creates the object; with ``every``, no pair is deactivated."""
        self.node_face, self.edge_edge, self._every = pair_table(nodes), pair_table(ridges), every
        self.tested, self.unforced = 0, 0
        """Number of tested pairs, and number of tested pairs that had valid bounds."""

    def meet(self, shards: "Shards", dt: float) -> list[ContactRows]:
        """Returns the active contacts of nodes and of edges in a step."""
        if self._every:
            wake(self.node_face.arrays())
            wake(self.edge_edge.arrays())
        first = np.full(len(shards.x), -1, np.int32)
        self.node_face.hang(first, 0)
        slots, faces, edges, of = shards.tables(first, dt)
        end, pairs, two = shards.reference.end, self.node_face.arrays(), self.edge_edge.arrays()
        known, familiar = known_of(pairs, slots.fresh, faces.fresh), known_of(two, edges.fresh, edges.fresh)
        nodes, some = faces_met(pairs, slots, faces, of, end)
        ridges, few = edges_met(two, edges, of, slots.course, end)
        self.tested += some + few
        self.unforced += int(known[pairs.active[:some]].sum() + familiar[two.active[:few]].sum())
        return [nodes, ridges]


class Shards:
    """Tets that move, rotate, get other velocities and break; some faces and nodes are not on the surface at first. The
    normals of a node point approximately away from its tet; one node in four has normals that are compatible with every
    face.
    """

    def __init__(self, seed: int, violence: float) -> None:
        self.draw, self.violence = np.random.default_rng(seed), violence
        draw, shard, first = self.draw, np.arange(SHARDS), 4 * np.arange(SHARDS)
        self.x = (draw.uniform(-2.5, 2.5, (SHARDS, 1, 3)) + CORNERS).reshape(-1, 3)
        self.v = np.repeat(draw.normal(0.0, 0.4, (SHARDS, 3)), 4, axis=0)
        self.shard, self.face_shard = np.repeat(shard, 4), np.repeat(shard, 4)
        self.faces = (first[:, None, None] + FACES).reshape(-1, 4).astype(np.int32)
        self.edges = (first[:, None, None] + EDGES).reshape(-1, 6).astype(np.int32)
        self.size, self.length = face_sizes(self.x, self.faces), edge_sizes(self.x, self.edges)
        self.deep = edge_depths(self.x, self.edges)
        self.exposed = draw.uniform(size=len(self.faces)) < 0.8
        self.ridges = np.asarray((draw.uniform(size=(len(self.edges), 2)) < 0.9).all(axis=1))
        self.on_surface = draw.uniform(size=len(self.x)) < 0.9
        outward = np.tile(CORNERS - CORNERS.mean(axis=0), (SHARDS, 1))
        self.normals = self.facing(outward)
        self.reference = ReferenceMotion(self.x, self.v, len(self.faces), len(self.edges), np.zeros(3), np.inf)
        self.settle()

    def settle(self) -> None:
        """Clears all flags of changes."""
        self.face_fresh, self.edge_fresh = np.zeros(len(self.faces), bool), np.zeros(len(self.edges), bool)
        self.node_fresh = np.zeros(len(self.x), bool)

    def facing(self, outward: Floats) -> Floats:
        """Returns (n, 9) mean normals of nodes that are directed approximately along ``outward`` (n, 3)."""
        out = outward[:, None] + self.draw.normal(0.0, 0.3, (len(outward), 3, 3))
        out /= np.linalg.norm(out, axis=2, keepdims=True)
        out[self.draw.uniform(size=len(outward)) < 0.25] = 0.0
        return moments(out)

    def pairs(self) -> tuple[Indices, Indices]:
        """Returns all pairs of nodes and faces, and all pairs of edges, of different tets."""
        ridges = apart(np.repeat(np.arange(SHARDS), 6), np.repeat(np.arange(SHARDS), 6))
        return apart(self.shard, self.face_shard), ridges[ridges[:, 0] < ridges[:, 1]]

    def tables(self, first: Indices, dt: float) -> tuple[SlotTable, FaceTable, EdgeTable, Step]:
        """Returns slots, faces, edges and the step as records for kernels."""
        reference, part = self.reference, self.shard % 3
        slots = slot_table(first, self.normals, reference.short.left, reference.short.course)
        slots = slots._replace(on_surface=self.on_surface, fresh=self.node_fresh)
        faces = face_table(self.faces, self.size, reference.faces)._replace(exposed=self.exposed, fresh=self.face_fresh)
        edges = edge_table(self.edges, self.length, self.deep, reference.edges)
        edges = edges._replace(meets=self.ridges, fresh=self.edge_fresh)
        return slots, faces, edges, step_of(self.x, self.v, part, dt)

    def knock(self) -> None:
        """Gives another velocity to one of ten nodes."""
        some = self.draw.uniform(size=(len(self.v), 1)) < 0.1
        self.v = self.v + self.violence * self.draw.normal(0.0, 1.0, self.v.shape) * some

    def uncover(self) -> None:
        """Adds faces, edges and nodes to the surface; some nodes get other mean normals."""
        faces = self.draw.uniform(size=len(self.faces)) < 0.02
        edges = self.draw.uniform(size=len(self.edges)) < 0.02
        nodes = self.draw.uniform(size=len(self.x)) < 0.02
        self.exposed, self.face_fresh = self.exposed | faces, self.face_fresh | faces
        self.ridges, self.edge_fresh = self.ridges | edges, self.edge_fresh | edges
        self.on_surface, self.node_fresh = self.on_surface | nodes, self.node_fresh | nodes
        self.normals[nodes] = self.facing(self.draw.normal(size=(int(nodes.sum()), 3)))

    def split(self, *tables: Tables) -> None:
        """Separates some corners: a copy gets half of the faces and edges of its parent; one edge vanishes."""
        n = len(self.x)
        some = self.draw.choice(n, 3, replace=False)
        copies = np.arange(n, n + 3, dtype=np.int32)
        columns = Columns()
        for lines in (self.reference.searched, self.reference.short):
            columns.declare(lines, **Lines.COLUMNS)
        columns.extend(n, 3)
        self.reference.begin_at(n, self.x[some], self.v[some])
        columns.copy(some.astype(np.int64), copies.astype(np.int64))
        self.v = np.concatenate([self.v, self.v[some] + self.violence * self.draw.normal(size=(3, 3))])
        for name in ("x", "shard", "normals", "on_surface"):
            setattr(self, name, np.concatenate([getattr(self, name), getattr(self, name)[some]]))
        self.node_fresh = np.append(self.node_fresh, np.zeros(3, bool))
        for parent, copy in zip(some, copies, strict=True):
            for corners, fresh in ((self.faces, self.face_fresh), (self.edges, self.edge_fresh)):
                rows = np.flatnonzero((corners == parent).any(axis=1) & (self.draw.uniform(size=len(corners)) < 0.5))
                corners[rows] = np.where(corners[rows] == parent, copy, corners[rows])
                fresh[rows] = True
        gone = int(self.draw.integers(len(self.edges)))
        self.edges[gone, 1], self.edge_fresh[gone] = self.edges[gone, 0], True
        more = apart(self.shard[some], self.face_shard) + np.array([n, 0], np.int32)
        for table in tables:
            table.node_face.add(more)

    def renew(self, *tables: Tables) -> None:
        """Removes the pairs of some nodes and faces, and adds these pairs again."""
        nodes, faces = (self.draw.uniform(size=len(of)) < 0.05 for of in (self.x, self.faces))
        for table in tables:
            rows = table.node_face.rows
            again = rows[nodes[rows[:, 0]] | faces[rows[:, 1]]]
            table.node_face.drop(nodes, faces)
            table.node_face.add(again)

    def begin(self, dt: float, short: bool, *tables: Tables) -> None:
        """Begins a step; with ``short`` the pairs get new reference lines."""
        self.reference.advance(dt)
        if short:
            self.reference.shorten(self.x)
            for table in tables:
                table.node_face.wake()
                table.edge_edge.wake()
        Deviation(team(1)).measure(
            self.reference, self.x, self.v, self.faces, self.edges, np.ones(len(self.x), bool)
        )  # fmt: skip


def equal(one: list[ContactRows], two: list[ContactRows]) -> bool:
    """Returns whether two sets of contacts are bit-identical in all columns, and in the same order."""
    columns = ContactRows._fields
    pairs = [(getattr(a, name), getattr(b, name)) for a, b in zip(one, two, strict=True) for name in columns]
    return all(np.array_equal(a, b) for a, b in pairs)


def flown(seed: int, violence: float, blind: bool = False) -> tuple[int, int, float, float]:
    """Returns the number of steps whose contacts differ from those of all pairs, the number of contacts, and two
    fractions of pairs. The fractions are those of tested pairs, and of pairs that were tested without a change;
    ``blind``: the distance of slots from their lines is treated as zero.
    """
    shards = Shards(seed, violence)
    some, every = (Tables(*shards.pairs(), every=flag) for flag in (False, True))
    wrong, met = 0, 0
    for number in range(STEPS):
        dt = float(shards.draw.uniform(0.005, 0.02))
        shards.knock()
        if number % 5 == 4:
            shards.uncover()
            shards.split(some, every)
        if number % 7 == 3:
            shards.renew(some, every)
        shards.begin(dt, number % SHORT == SHORT - 1, some, every)
        if blind:
            for left in (shards.reference.short.left, shards.reference.faces, shards.reference.edges):
                left[:] = 0.0
        found, expected = some.meet(shards, dt), every.meet(shards, dt)
        wrong += not equal(found, expected)
        met += sum(len(rows.nodes) for rows in expected)
        shards.settle()
        shards.x = shards.x + dt * shards.v
    return wrong, met, some.tested / every.tested, some.unforced / every.tested


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("violence", [0.0, 0.02, 0.5])
def test_a_deactivated_pair_is_not_in_contact(seed: int, violence: float) -> None:
    """In every step the contacts are bit-identical. Most tested pairs have changed, and few other pairs are tested."""
    wrong, met, tested, unforced = flown(seed, violence)
    assert wrong == 0
    assert met > 20
    assert tested < 1.0 / SHORT + 0.1
    assert unforced < 0.01


def test_contacts_are_missed_where_leaving_a_line_does_not_count() -> None:
    """Control: with the distance from the reference lines treated as zero, the check of equal contacts fails."""
    assert sum(flown(seed, 0.5, blind=True)[0] for seed in range(4)) > 0


class Pair:
    """A node far above one face, with the table of their pair."""

    def __init__(self) -> None:
        self.x = np.array([[0.2, 0.2, 9.0], *CORNERS])
        self.table, self.first = pair_table(np.zeros((1, 2), np.int32)), np.full(5, -1, np.int32)
        self.table.hang(self.first, 0)
        self.left, self.exposed, self.on_surface = np.zeros(5), np.ones(1, bool), np.ones(5, bool)
        self.face_fresh, self.node_fresh = np.zeros(1, bool), np.zeros(5, bool)

    def tested(self) -> int:
        """Returns the number of pairs that the next step tests."""
        still = np.zeros_like(self.x)
        slots = slot_table(self.first, np.zeros((5, 9)), self.left, still)
        slots = slots._replace(fresh=self.node_fresh, on_surface=self.on_surface)
        faces = face_table(np.array([[1, 2, 3, 4]], np.int32), np.ones(1), np.zeros(1))
        faces = faces._replace(fresh=self.face_fresh, exposed=self.exposed)
        of = step_of(self.x, still, np.array([1, 0, 0, 0, 0]), 1.0)
        return faces_met(self.table.arrays(), slots, faces, of, 1.0)[1]


@pytest.mark.parametrize("cause", ["corners", "normals", "lines", "stray"])
def test_a_pair_is_tested_again_when_something_has_changed(cause: str) -> None:
    """The changes are: new corners of the face, new mean normals of the node, new reference lines of all slots, or a
    node that has departed from its line.
    """
    pair = Pair()
    assert [pair.tested() for _ in range(3)] == [1, 0, 0]
    pair.face_fresh[0], pair.node_fresh[0] = cause == "corners", cause == "normals"
    pair.left[0] = 8.9 if cause == "stray" else 0.0
    if cause == "lines":
        pair.table.wake()
    assert pair.tested() == 1


def test_a_pair_stays_deactivated_while_its_node_departs_by_less_than_the_slack() -> None:
    pair = Pair()
    pair.tested()
    pair.left[0] = 8.5
    assert pair.tested() == 0


@pytest.mark.parametrize("kind", ["face", "node"])
def test_a_pair_inside_a_body_is_tested_when_it_becomes_surface(kind: str) -> None:
    """New reference lines do not activate the pair; the surface flag does."""
    pair = Pair()
    flags, fresh = (pair.exposed, pair.face_fresh) if kind == "face" else (pair.on_surface, pair.node_fresh)
    flags[0] = False
    assert pair.tested() == 0
    pair.table.wake()
    assert pair.tested() == 0
    flags[0], fresh[0] = True, True
    assert pair.tested() == 1


def columns_of(table: PairTable) -> Floats:
    """Returns (p, 9) all columns of each pair."""
    return np.column_stack([table.rows, table.until, table.speed, table.turned, table.kept])


def random_table(seed: int) -> PairTable:
    """Returns pairs of 20 things with 15 things, which differ in all columns."""
    draw = np.random.default_rng(seed)
    rows = draw.permutation(np.stack(np.meshgrid(np.arange(20), np.arange(15)), axis=-1).reshape(-1, 2))[:200]
    table = pair_table(rows)
    table.until[:], table.speed[:], table.kept[:] = (
        draw.normal(size=200),
        draw.normal(size=200),
        draw.normal(size=(200, 4)),
    )
    table.turned[:] = draw.uniform(size=200) < 0.5
    return table


@pytest.mark.parametrize("seed", range(5))
def test_pairs_keep_all_their_columns_when_others_are_dropped(seed: int) -> None:
    draw, table = np.random.default_rng(seed), random_table(seed)
    one, two = draw.uniform(size=20) < 0.3, draw.uniform(size=15) < 0.2
    stays = ~(one[table.rows[:, 0]] | two[table.rows[:, 1]])
    expected = columns_of(table)[stays]
    table.drop(one, two)
    assert 0 < len(table) == stays.sum() < 200
    assert np.array_equal(columns_of(table), expected)
    assert len(table.next) == len(table)


@pytest.mark.parametrize("seed", range(5))
def test_pairs_are_carried_over_to_other_numbers_in_the_order_of_the_first_with_what_they_keep(seed: int) -> None:
    draw, table = np.random.default_rng(seed), random_table(seed)
    one, two = draw.permutation(20).astype(np.int32), draw.permutation(15).astype(np.int32)
    one[draw.uniform(size=20) < 0.3], two[0] = -1, -1
    expected = columns_of(table)
    expected[:, 0], expected[:, 1] = one[table.rows[:, 0]], two[table.rows[:, 1]]
    expected = expected[(expected[:, :2] >= 0).all(axis=1)]
    expected = expected[np.argsort(expected[:, 0], kind="stable")]
    assert np.array_equal(columns_of(table.carried(one, two)), expected)


def test_the_chains_of_pairs_hold_each_pair_of_a_node_once() -> None:
    """Pairs that were appended to the table are also in the chains of pairs."""
    table, first = random_table(1), np.full(20, -1, np.int32)
    table.hang(first, 0)
    table.add(np.array([[3, 16], [3, 17], [4, 16]], np.int32))
    table.hang(first, 200)
    for node in range(20):
        chain, p = [], int(first[node])
        while p >= 0:
            chain.append(p)
            p = int(table.next[p])
        assert sorted(chain) == np.flatnonzero(table.rows[:, 0] == node).tolist()


def test_a_line_begins_again_at_its_slot_with_the_mean_velocity() -> None:
    draw = np.random.default_rng(3)
    x, course, now = draw.normal(size=(6, 3)), draw.normal(size=(6, 3)), draw.normal(size=(6, 3))
    lines, some = Lines(x, course), np.arange(6) < 4
    lines.begin_anew(some, now, 2.0)
    assert lines.course[:4] == pytest.approx((now - x)[:4] / 2.0)
    assert (lines.x + 2.0 * lines.course)[:4] == pytest.approx(now[:4])
    assert np.array_equal(lines.course[4:], course[4:])
    assert np.array_equal(lines.x[4:], x[4:])
    assert lines.since.tolist() == [2.0] * 4 + [0.0] * 2


def test_how_far_a_slot_leaves_its_line_is_the_larger_of_the_steps_beginning_and_end() -> None:
    x, course = np.zeros((3, 3)), np.tile([1.0, 0.0, 0.0], (3, 1))
    now = np.array([[2.0, 0.0, 0.0], [2.0, 0.3, 0.0], [2.0, 0.0, 0.4]])
    v, corners = np.array([[1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [1.0, 0.0, 1.0]]), np.array([[0, 1, 2]], np.int32)
    motion = ReferenceMotion(x, course, 1, 1, np.zeros(3), np.inf)
    motion.advance(2.0)
    motion.advance(0.3, 0.2)
    most = Deviation(team(1)).measure(motion, now, v, corners, corners[:, :2].copy(), np.array([True, True, False]))
    for lines in (motion.searched, motion.short):
        assert lines.left == pytest.approx([0.0, 0.3, 0.9])
    assert (most, motion.faces[0], motion.edges[0]) == pytest.approx((0.3, 0.9, 0.3))


def test_lines_are_copied_to_other_slots() -> None:
    """New slots begin at their positions; all other slots keep their reference lines, at any time."""
    draw = np.random.default_rng(4)
    old = Lines(draw.normal(size=(4, 3)), draw.normal(size=(4, 3)))
    old.begin_anew(np.arange(4) < 2, draw.normal(size=(4, 3)), 1.0)
    x, course = draw.normal(size=(5, 3)), draw.normal(size=(5, 3))
    new = Lines(x, course)
    new.take_over(np.array([3, -1, 0, 4], np.int32), old, 2.5)
    for here, there in ((3, 0), (0, 2), (4, 3)):
        for name in ("x", "course", "since"):
            assert np.array_equal(getattr(new, name)[here], getattr(old, name)[there])
    for slot in (1, 2):
        assert (new.x + 2.5 * new.course)[slot] == pytest.approx(x[slot])
        assert np.array_equal(new.course[slot], course[slot])
        assert new.since[slot] == 2.5


def test_a_body_that_breaks_comes_to_the_same_when_every_pair_is_tested(monkeypatch: pytest.MonkeyPatch) -> None:
    """The results are bit-identical, including pairs of copies and of faces with new corners."""
    case = parse_case(read_data(Path(__file__).parents[1] / "parallel" / "breaking.toml"))
    arrays = PairTable.arrays

    def end() -> tuple[str | None, int]:
        sim = simulation.build(case, Path(), SerialComm())
        step.prepare(sim)
        for _ in range(40):
            step.first_half(sim)
            sim.clock.frame += sim.clock.frame_due
            step.second_half(sim)
        assert sim.fracture is not None
        return digest(sim.model, sim.comm, []), sim.fracture.broken

    left_alone = end()
    monkeypatch.setattr(PairTable, "arrays", lambda table: wake(arrays(table)))
    assert end() == left_alone
    assert left_alone[1] > 100
