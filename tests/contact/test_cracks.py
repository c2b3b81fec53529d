"""Cracks and node families: updates of their tables."""

from types import SimpleNamespace

import numpy as np
import pytest

from conoid.worker.contact.narrow_phase.cracks import Cracks
from conoid.worker.contact.narrow_phase.node_face import chain
from conoid.worker.contact.scene import split_update
from conoid.worker.contact.scene.split_pairs import Family, apart_from_edges, families, inherited
from conoid.worker.contact.surface.families import Families, TouchingRows
from conoid.worker.migration.parcel import joined, once
from conoid.worker.model.columns import Columns
from conoid.worker.model.state import Copies, Nodes
from conoid.worker.model.topology import Split
from conoid.worker.parallel.team import team


def cracks_of(n: int) -> Cracks:
    """Returns ``n`` cracks that have their number in all columns and no side on this rank."""
    number = np.arange(n)
    found = Cracks.none(np.arange(0))
    tets, nodes = np.column_stack([2 * number, 2 * number + 1]), np.repeat(number[:, None], 3, axis=1)
    found.add(4 * tets - 1, nodes.astype(np.int32), np.full((n, 2, 3), -1, np.int32))
    found.places[:], found.kept[:] = number[:, None], number[:, None]
    return found


@pytest.mark.parametrize("opened", [[], [0], [6], [5, 6], [0, 3, 6], [0, 1, 2, 3, 4, 5, 6]])
def test_cracks_that_open_leave_and_all_others_keep_their_columns(opened: list[int]) -> None:
    cracks = cracks_of(7)
    cracks.open(cracks.faces[opened, 0], [])
    left = cracks.nodes[:, 0]
    assert sorted(left) == [c for c in range(7) if c not in opened]
    assert np.array_equal((cracks.faces + 1) // 4, np.column_stack([2 * left, 2 * left + 1]))
    for column in (cracks.nodes, cracks.places):
        assert np.array_equal(column, np.repeat(left[:, None], 6, axis=1))
    assert np.array_equal(cracks.kept, np.repeat(left[:, None], 12, axis=1))


def test_a_crack_that_comes_after_others_have_opened_stands_behind_those_that_are_left() -> None:
    cracks = cracks_of(4)
    cracks.open(cracks.faces[[1], 0], [])
    more = cracks_of(9)
    cracks.add(more.faces[8:], more.nodes[8:, :3], np.full((1, 2, 3), -1, np.int32))
    assert cracks.nodes[:, 0].tolist() == [0, 3, 2, 8]
    assert cracks.places[3].tolist() == [-1] * 6


def test_a_rank_with_both_sides_of_a_crack_has_the_row_of_the_first() -> None:
    """Two ranks with one side each begin with different nodes, and the last bit of a normal depends on the first node.
    The rank of the first side has computed the crack for both ranks.
    """
    ids, places, zeros = np.array([10, 11, 12]), np.zeros(3, np.int32), np.zeros((3, 3))
    none, force = np.zeros(3), zeros.astype(np.int64)
    nodes = Nodes(ids, places, places, np.ones(3, bool), zeros, zeros, zeros, none, force, none)
    had = []
    for k, order in enumerate(([0, 1, 2], [1, 2, 0])):
        sides = np.full((1, 2, 3), -1, np.int32)
        sides[0, k] = 0
        one = Cracks.none(np.arange(0))
        one.add(np.array([[20, 36]]), np.array([order], np.int32), sides)
        one.sides, one.faces, one.kept = sides, np.array([[20, 36]]), np.full((1, 12), float(k))
        had.append(one.keep(ids))
    for every in (had, had[::-1]):
        table = joined(every)
        cracks = Cracks.resume(once(table, table["key"]), ids, [], nodes)
        assert cracks.nodes.tolist() == [[0, 1, 2, 0, 1, 2]]
        assert not cracks.kept.any()


def test_only_cracks_with_their_first_side_here_and_nodes_apart_have_slots() -> None:
    nodes = np.array([[0, 1, 2, 0, 1, 2], [0, 1, 2, 0, 1, 3], [0, 1, 2, 4, 1, 2], [0, 1, 2, 0, 5, 2]], np.int32)
    sides, places, pushes = np.zeros((4, 2, 3), np.int32), np.full((4, 6), -1, np.int32), np.zeros(6, bool)
    sides[2, 0, 1] = -1
    split_update._place(places, pushes, np.arange(4), nodes, sides, np.arange(6, dtype=np.int32))
    assert (places == np.where(np.array([[0], [1], [0], [1]]), nodes, -1)).all()
    assert np.flatnonzero(pushes).tolist() == [1, 2, 3, 5]


def test_every_copy_has_the_candidates_of_its_parent() -> None:
    pairs = np.array([[0, 7], [2, 8], [0, 9], [1, 7]], np.int32)
    first, following = np.full(6, -1, np.int32), np.empty(len(pairs), np.int32)
    chain(first, following, pairs, 0)
    family = np.array([[0, 4], [0, 5], [3, 2]], np.int32)
    assert sorted(inherited(family, first, following, pairs).tolist()) == [[4, 7], [4, 9], [5, 7], [5, 9]]


def test_a_family_has_the_first_and_the_last_copy_of_a_node() -> None:
    family = Family(*families(np.array([[3, 6], [3, 7], [-1, 5], [4, -1], [1, 8]], np.int32), 9))
    assert family.first.tolist() == [-1, 2, -1, 0, -1, -1, -1, -1, -1]
    assert family.member.tolist() == [[6, 0], [7, 1], [8, 1]]
    assert family.most == 2
    assert families(np.zeros((0, 2), np.int32), 2)[2] == 0


@pytest.mark.parametrize("second", [(0, 1), (1, 0)])
@pytest.mark.parametrize("now", [(0, 1), (3, 1), (1, 4), (3, 4)])
def test_edges_that_had_both_ends_in_common_are_a_pair_once_they_have_none(
    second: tuple[int, int], now: tuple[int, int]
) -> None:
    """The edges have any direction. In an earlier version edges of opposite directions were listed in two pairs."""
    family = Family(*families(np.array([[0, 3], [1, 4]], np.int32), 6))
    old = np.array([[0, 1, 2, 5], [*second, 2, 5]], np.int32)
    after = np.array([[0, 1, 2, 5], [*now, 2, 5]], np.int32)
    apart = not {0, 1} & set(now)
    for own in (True, False):
        found = apart_from_edges(old, after, family.first, np.array([own, True]))
        assert found.tolist() == ([[0, 1]] if apart and own else [])


def members(families: Families, node: int) -> list[int]:
    found = [node]
    while (following := int(families.ring[found[-1]])) != node:
        found.append(following)
    return sorted(found)


@pytest.mark.parametrize("root", [[], [4], [4, 4], [7, 2, 7, 2, 7, 9]])
def test_the_nodes_of_a_root_are_one_family(root: list[int]) -> None:
    every = Families.of(np.array(root, np.int64))
    for node, one in enumerate(root):
        assert members(every, node) == [k for k, other in enumerate(root) if other == one]


def test_copies_join_the_families_of_their_parents() -> None:
    none, copies = np.zeros(0, np.int32), np.array([1, 1, 2], np.int64)
    new = Copies(copies, np.arange(4, 7), np.zeros(3, np.int32), np.ones(3, bool), np.zeros(3))
    families, columns = Families.of(np.array([10, 11, 12, 11], np.int64)), Columns()
    columns.declare(families, **Families.COLUMNS)
    columns.extend(4, 3)
    columns.copy(copies, np.arange(4, 7))
    families.link(Split(new, 4, np.ones(1, np.int64), none.astype(np.int64), none, none, none, none))
    assert families.root.tolist() == [10, 11, 12, 11, 11, 11, 12]
    assert members(families, 3) == [1, 3, 4, 5]
    assert members(families, 6) == [2, 6]
    assert members(families, 0) == [0]


@pytest.mark.parametrize("seed", range(3))
def test_the_nodes_beside_cracks_are_those_of_their_tets_and_families(seed: int) -> None:
    """Random cracks between random tets, some of them on another rank, are compared with sets."""
    random = np.random.default_rng(seed)
    families = Families.of(random.integers(0, 25, 40))
    tets, n = random.integers(0, 40, (30, 4)).astype(np.uint32), 50
    nodes = random.integers(0, 40, (n, 3)).astype(np.int32)
    sides = np.stack([random.integers(0, 2, (n, 2)), random.integers(-1, 30, (n, 2)), np.zeros((n, 2), int)], axis=2)
    cracks = Cracks.none(np.arange(0))
    cracks.families = families
    cracks.add(np.zeros((n, 2), np.int64), nodes, sides.astype(np.int32))
    apart = random.uniform(size=(n, 3)) < 0.1
    cracks.nodes[:, 3:] = np.where(apart, families.ring[nodes], nodes)
    rows = np.flatnonzero(random.uniform(size=n) < 0.5)
    expected = set[int]()
    for r in rows[(cracks.nodes[rows, :3] != cracks.nodes[rows, 3:]).any(axis=1)]:
        expected |= {int(a) for b, e, _ in sides[r] if b == 0 and e >= 0 for a in tets[e]}
        pairs = cracks.nodes[r].reshape(2, 3).T
        expected |= {k for one, two in pairs.tolist() if one != two for k in members(families, one)}
    found = cracks.beside(rows, [SimpleNamespace(tets=tets)])  # type: ignore[list-item]
    assert sorted(found.tolist()) == sorted(expected)
    assert not families.marks.any()


def test_rows_with_a_marked_entry_are_found_in_order() -> None:
    random, n = np.random.default_rng(3), 9000
    table, marks = random.integers(0, 500, (n, 6)).astype(np.int32), np.zeros(500, np.uint8)
    marks[random.integers(0, 500, 20)] = 1
    found = TouchingRows(team(2)).of(table, marks)
    assert found.tolist() == np.flatnonzero(marks[table].any(axis=1)).tolist()
    assert len(TouchingRows(team(1)).of(table[:0], marks)) == 0
