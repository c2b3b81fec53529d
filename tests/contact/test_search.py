"""Candidate pairs: no pair is missed, each pair is found once, and the memory does not depend on distances."""

import tracemalloc
from collections.abc import Iterator

import numpy as np
import pytest

from conoid.worker.contact.broad_phase import buckets, search
from conoid.worker.contact.broad_phase.boxes import Lines, Primitives
from conoid.worker.contact.broad_phase.buckets import Buckets, Table
from conoid.worker.contact.broad_phase.search import Finder
from conoid.worker.parallel.team import team

from ..worker.meshes import Floats
from .bodies import Flags, Indices, sheet
from .distances import point_triangle, segment_segment

SETS = 250
LOOKS = np.linspace(0.0, 1.0, 5)
"""Times of the horizon at which distances are measured, as fractions."""
NEVER_SELF = ~np.eye(3, dtype=bool)


class Cloud:
    """Random things: nodes, faces and edges of sizes up to 100:1, in three moving parts; some things are far away and
    fast.
    """

    def __init__(self, seed: int, n: int = 36) -> None:
        random = np.random.default_rng(seed)
        self.horizon = float(random.uniform(0.0, 2.0))
        corners = [random.normal(size=(n, k, 3)) * 10.0 ** random.uniform(-1.5, 0.5, (n, 1, 1)) for k in (1, 3, 2)]
        middles = random.uniform(-1.5, 1.5, (3, n, 1, 3)) * 10.0 ** (3.0 * (random.uniform(size=(3, n, 1, 1)) > 0.95))
        drift = random.normal(size=3) * 100.0
        sets = zip(middles, corners, strict=True)
        self.x = np.concatenate([(m + c - c.mean(axis=1, keepdims=True)).reshape(-1, 3) for m, c in sets])
        speed = 10.0 ** random.uniform(-2.0, 1.0, (len(self.x), 1))
        self.v = drift + speed * random.normal(size=self.x.shape)
        starts = np.array([0, n, 4 * n])
        self.nodes = self.things(starts[0] + np.arange(n)[:, None], random)
        self.faces = self.things(starts[1] + np.arange(3 * n).reshape(n, 3), random)
        self.edges = self.things(starts[2] + np.arange(2 * n).reshape(n, 2), random)
        self.part = random.integers(0, 3, len(self.x)).astype(np.int32)
        for things in (self.faces, self.edges):
            self.part[things.corners] = self.part[things.corners[:, :1]]

    @staticmethod
    def things(corners: "np.ndarray", random: np.random.Generator) -> Primitives:
        return Primitives(corners.astype(np.int32), 10.0 ** random.uniform(-2.0, 0.0, len(corners)))

    def at(self, things: Primitives, share: float) -> Floats:
        """Returns (n, k, 3) corners of the things after a fraction of the horizon."""
        return np.asarray((self.x + share * self.horizon * self.v)[things.corners])

    def find(
        self, small: Primitives, large: Primitives, rank: "np.ndarray | None" = None, allowed: Flags = NEVER_SELF
    ) -> Indices:
        v = self.v - self.v.mean(axis=0)
        return search.find(small, large, self.x, v, self.part, allowed, self.horizon, rank)


def clouds() -> Iterator[Cloud]:
    return map(Cloud, range(SETS))


def reached(cloud: Cloud, small: Primitives, large: Primitives, distance: Floats) -> Flags:
    """Returns (small, large) the pairs of parts in contact that come within reach, by their distances at the times
    TIMES.
    """
    near = distance.min(axis=0) < small.reach[:, None] + large.reach[None, :]
    of = [cloud.part[things.corners[:, 0]] for things in (small, large)]
    return np.asarray(near & NEVER_SELF[of[0][:, None], of[1][None, :]])


def as_matrix(pairs: Indices, rows: int, columns: int) -> Flags:
    """Returns the pairs as flags; no pair may be in the list twice."""
    counts = np.zeros((rows, columns), int)
    np.add.at(counts, tuple(pairs.T), 1)
    assert counts.max(initial=0) <= 1
    return np.asarray(counts > 0)


def test_no_node_that_comes_near_a_face_is_missed() -> None:
    seen = looked = 0
    for cloud in clouds():
        nodes, faces = cloud.nodes, cloud.faces
        distance = np.stack([point_triangle(cloud.at(nodes, s)[:, 0], cloud.at(faces, s)) for s in LOOKS])
        needed = reached(cloud, nodes, faces, distance)
        found = as_matrix(cloud.find(nodes, faces), len(nodes.corners), len(faces.corners))
        assert not (needed & ~found).any()
        looked, seen = looked + needed.size, seen + needed.sum()
    assert looked > 100_000
    assert 0.05 * looked < seen < 0.9 * looked


def test_no_edge_that_comes_near_an_edge_is_missed_and_each_pair_is_found_once() -> None:
    seen = looked = 0
    for seed, cloud in enumerate(clouds()):
        edges, n = cloud.edges, len(cloud.edges.corners)
        rank = np.random.default_rng(seed).permutation(n)
        distance = np.stack([segment_segment(cloud.at(edges, s)) for s in LOOKS])
        needed = reached(cloud, edges, edges, distance)
        found = as_matrix(cloud.find(edges, edges, rank), n, n)
        assert not (found & found.T).any()
        assert not (needed & ~(found | found.T)).any()
        assert (rank[:, None] < rank[None, :])[found].all()
        looked, seen = looked + needed.size, seen + needed.sum()
    assert looked > 100_000
    assert 0.05 * looked < seen < 0.9 * looked


@pytest.mark.parametrize("seed", range(20))
def test_two_ranks_that_see_each_others_edges_find_every_pair_once_between_them(seed: int) -> None:
    """Each rank lists its own edges first, then copies of the edges of the other rank, in any order."""
    cloud, n = Cloud(seed), 36
    half = np.random.default_rng(seed).permutation(n)
    total = np.zeros((n, n), int)
    for mine, theirs in ((half[:15], half[15:]), (half[15:], half[:15])):
        seen = np.concatenate([mine, theirs])
        large = Primitives(cloud.edges.corners[seen], cloud.edges.reach[seen])
        small = Primitives(large.corners[: len(mine)], large.reach[: len(mine)])
        pairs = seen[cloud.find(small, large, seen.astype(np.int64))]
        np.add.at(total, tuple(pairs.T), 1)
    alone = as_matrix(cloud.find(cloud.edges, cloud.edges, np.arange(n)), n, n)
    assert (np.tril(total) == 0).all()
    assert total.max() == 1
    distance = np.stack([segment_segment(cloud.at(cloud.edges, s)) for s in LOOKS])
    needed = np.triu(reached(cloud, cloud.edges, cloud.edges, distance), 1)
    assert not (needed & ~(total > 0)).any()
    assert not (needed & ~alone).any()


def test_candidates_are_the_boxes_that_touch() -> None:
    """The list of candidate pairs is not much longer than necessary: it contains pairs of boxes around the paths, in a
    moving frame.
    """
    for seed in range(50):
        cloud = Cloud(seed)
        frame = cloud.v.mean(axis=0)
        boxes = []
        for things in (cloud.nodes, cloud.faces):
            flown = cloud.x + cloud.horizon * (cloud.v - frame)
            path = np.concatenate([cloud.x[things.corners], flown[things.corners]], axis=1)
            boxes.append((path.min(axis=1) - things.reach[:, None], path.max(axis=1) + things.reach[:, None]))
        (low, high), (their_low, their_high) = boxes
        touch = ((low[:, None] <= their_high[None]) & (high[:, None] >= their_low[None])).all(axis=2)
        of = [cloud.part[things.corners[:, 0]] for things in (cloud.nodes, cloud.faces)]
        touch &= NEVER_SELF[of[0][:, None], of[1][None, :]]
        found = as_matrix(cloud.find(cloud.nodes, cloud.faces), *touch.shape)
        assert (found == touch).all()


def test_each_pair_is_found_once_where_all_meet_all() -> None:
    """At first the table has a tenth of the needed rows: the search is interrupted and continued."""
    n = 120
    cloud = Cloud(5, n)
    huge = Primitives(cloud.faces.corners, np.full(n, 1e5))
    assert as_matrix(cloud.find(cloud.nodes, huge, allowed=np.ones((3, 3), bool)), n, n).all()


def test_pairs_and_their_order_are_the_same_on_any_number_of_threads() -> None:
    """With so many nodes and faces every loop has several tasks; the second search has enough memory at once."""
    cloud = Cloud(7, 3000)
    lines, finder = Lines(cloud.x, cloud.v - cloud.v.mean(axis=0), cloud.horizon, cloud.part), Finder(team(3))
    alone = cloud.find(cloud.nodes, cloud.faces)
    assert len(alone) > 10_000
    for _ in range(2):
        assert np.array_equal(finder.find(cloud.nodes, cloud.faces, lines, NEVER_SELF), alone)


def test_things_with_a_node_in_common_are_no_candidates() -> None:
    cloud = Cloud(3)
    nodes = Primitives(np.arange(len(cloud.x), dtype=np.int32)[:, None], np.full(len(cloud.x), 10.0))
    found = cloud.find(nodes, cloud.faces, allowed=np.ones((3, 3), bool))
    shared = (nodes.corners[found[:, 0]] == cloud.faces.corners[found[:, 1]]).any(axis=1)
    assert len(found) > 100
    assert not shared.any()


def test_only_parts_that_meet_are_candidates() -> None:
    allowed = np.array([[False, True, False], [True, True, False], [False, False, False]])
    met = set()
    for cloud in clouds():
        pairs = cloud.find(cloud.nodes, cloud.faces, allowed=allowed)
        of = cloud.part[cloud.nodes.corners[pairs[:, 0], 0]], cloud.part[cloud.faces.corners[pairs[:, 1], 0]]
        met |= set(zip(of[0].tolist(), of[1].tolist(), strict=True))
    assert met == {(0, 1), (1, 0), (1, 1)}


@pytest.mark.parametrize("empty", ["small", "large", "both"])
def test_without_primitives_there_are_no_candidates(empty: str) -> None:
    cloud = Cloud(1)
    none = Primitives(np.zeros((0, 3), np.int32), np.zeros(0))
    small = cloud.nodes if empty == "large" else none
    large = cloud.faces if empty == "small" else none
    assert cloud.find(small, large).shape == (0, 2)


def peak_of(away: float, coarse: int = 40) -> tuple[int, int]:
    """Returns the bytes that the search needs for two sheets, and the number of pairs; a hundredth of the nodes of the
    sheets is ``away``.
    """
    (x0, _), (x1, faces1) = sheet(40, 1.0), sheet(coarse, 40.0 / coarse)
    x1, faces1 = x1 + np.array([0.0, 0.0, 0.1]), faces1 + np.int32(len(x0))
    x = np.concatenate([x0, x1])
    nodes = np.arange(len(x0), dtype=np.int32)[:, None]
    random = np.random.default_rng(1)
    gone = random.choice(len(x0), len(x0) // 100, replace=False)
    x[gone] += away * random.normal(size=(len(gone), 3))
    part = np.repeat([0, 1], [len(x0), len(x1)]).astype(np.int32)
    faces = Primitives(faces1, np.full(len(faces1), 0.25 * 40.0 / coarse))
    tracemalloc.start()
    found = search.find(
        Primitives(nodes, np.full(len(nodes), 0.1)), faces, x, np.zeros_like(x), part, ~np.eye(2, dtype=bool), 1.0, None
    )
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak, len(found)


def test_memory_does_not_follow_the_extent() -> None:
    near, _ = peak_of(0.0)
    for away in (1e2, 1e4, 1e8, 1e12):
        assert peak_of(away)[0] < 1.2 * near


@pytest.mark.parametrize("coarse", [4, 400])
def test_memory_stays_with_the_number_of_things_where_sizes_differ_tenfold(coarse: int) -> None:
    """Faces are ten times as large, or as small, as their partners: the bytes for each candidate or thing are the same
    as for equal sizes.
    """
    equal, pairs = peak_of(0.0)
    other, their_pairs = peak_of(0.0, coarse)
    assert other / (their_pairs + 2 * coarse * coarse) < 4.0 * equal / (pairs + 2 * 40 * 40)


@pytest.mark.parametrize("size", [1e2, 1e3, 1e4])
def test_memory_does_not_follow_a_huge_thing(size: float) -> None:
    """A long edge lies across two sheets of short edges: the number of cells of the long edge does not depend on the
    distance of other things.
    """
    (x0, faces), (x1, _) = sheet(20, 1.0), sheet(20, 1.0)
    short = faces[:, :2]
    x = np.concatenate([x0, x1 + np.array([0.0, 0.0, 0.1]), [[-size, -size, -size], [size, size, size]]])
    corners = np.concatenate([short, short + len(x0), [[2 * len(x0), 2 * len(x0) + 1]]]).astype(np.int32)
    part = np.repeat([0, 1, 2], [len(x0), len(x0), 2]).astype(np.int32)
    edges = Primitives(corners, np.full(len(corners), 0.2))
    tracemalloc.start()
    found = search.find(edges, edges, x, np.zeros_like(x), part, NEVER_SELF, 1.0, np.arange(len(corners)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (found == len(corners) - 1).any(axis=1).sum() == 2 * len(short)
    assert peak < 4e6


def sorted_boxes(low: Floats, high: Floats, edge: float) -> Table:
    return Buckets(team(1)).sort(low, high, np.stack([low.min(axis=0), high.max(axis=0)]), edge)


def cells_of(table: Table, low: Floats, high: Floats) -> set[int]:
    """Returns the codes of all cells that a box touches."""
    first, last = (
        np.clip(np.floor((corner - table.origin) * table.inverse), 0, table.shape - 1).astype(np.int64)
        for corner in (low, high)
    )
    x, y, z = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij")
    return set((x + table.shape[0] * (y + table.shape[1] * z)).reshape(-1).tolist())


@pytest.mark.parametrize("spread", [(1.0, 1.0, 0.5), (1e9, 1.0, 0.5), (1.0, 1e3, 1e3), (1e15, 1e15, 1e15)])
@pytest.mark.parametrize("edge", [1e-3, 0.1, 10.0])
def test_position_codes_have_every_box_once_in_each_cell_that_it_touches(
    spread: tuple[float, ...], edge: float
) -> None:
    """The entries of a hash are contiguous in the table. Some boxes of the test are wide, and one box is a point."""
    random = np.random.default_rng(2)
    low: Floats = random.uniform(0.0, 1.0, (400, 3)) * np.array(spread)
    high: Floats = low + edge * random.uniform(0.0, 3.0, (400, 3)) * (
        1.0 + 10.0 * (random.uniform(size=(400, 1)) < 0.1)
    )
    low[0] = high[0]
    table = sorted_boxes(low, high, edge)
    assert 1.0 / table.inverse >= edge * (1.0 - 1e-12)
    assert (table.shape <= 2**20 + 1).all()
    touched = {j: cells_of(table, low[j], high[j]) for j in range(400)}
    wide = [j for j, cells in touched.items() if len(cells) > buckets._WIDE]
    assert sorted(table.wide.tolist()) == wide
    found: dict[int, list[int]] = {j: [] for j in touched}
    for bucket in range(2**table.bits):
        for entry in range(table.start[bucket], table.start[bucket + 1]):
            assert buckets.bucket_at(table.code[entry], table.bits) == bucket
            found[int(table.thing[entry])].append(int(table.code[entry]))
    assert table.start[0] == 0
    assert table.start[-1] == len(table.thing) == sum(map(len, found.values()))
    for j, cells in touched.items():
        assert sorted(found[j]) == ([] if j in wide else sorted(cells))
    assert bool(wide) == (max(spread) < 1e9)


def test_a_hash_holds_few_codes() -> None:
    """At most 16 entries have the same hash, for the cells of a full cube, of a layer and of a line."""
    for shape in ((16, 16, 16), (64, 64, 1), (4096, 1, 1), (1, 1, 4096)):
        low: Floats = np.ascontiguousarray(np.argwhere(np.ones(shape)) + 0.25)
        table = sorted_boxes(low, low + 0.5, 1.0)
        assert len(table.thing) == len(low)
        assert np.diff(table.start).max() <= 16
