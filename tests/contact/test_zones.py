"""Zones of the surface nodes: boxes with about equal numbers of nodes; a step on many threads is bit-identical to a
step on one thread.
"""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from conoid.worker.contact.solver.slot_numbers import mark, number, offsets, set_offsets
from conoid.worker.contact.solver.solver import ActiveSet
from conoid.worker.contact.solver.zones import Zones, sets, tasks
from conoid.worker.parallel.team import team

from .kernels import Solver, network


def nodes_of(x: "np.ndarray") -> Any:
    """Returns surface nodes in the form that zones read."""
    return SimpleNamespace(x=x, n=len(x))


@pytest.mark.parametrize("threads", [2, 3, 16])
def test_zones_have_about_as_many_nodes_each_and_nodes_of_one_place_are_of_one(threads: int) -> None:
    x = np.random.default_rng(threads).normal(size=(4000, 3)) * [9.0, 3.0, 1.0]
    x[2000:] = x[:2000]
    zones = Zones(threads)
    zone = zones.of(nodes_of(x))
    counts = np.bincount(zone, minlength=zones.many)
    assert zones.many >= 4 * threads
    assert len(counts) == zones.many
    assert counts.max() <= 1.5 * counts.mean()
    assert np.array_equal(zone[2000:], zone[:2000])


def test_nodes_that_come_later_are_of_the_zone_of_their_place_and_the_others_stay() -> None:
    x = np.random.default_rng(1).uniform(size=(500, 3))
    zones, surface_nodes = Zones(2), nodes_of(x[:400])
    before = zones.of(surface_nodes).copy()
    surface_nodes.x, surface_nodes.n = np.concatenate([x[:400] + 0.5, x[:100]]), 500
    after = zones.of(surface_nodes)
    assert np.array_equal(after[:400], before)
    assert np.array_equal(after[400:], before[:100])


def test_one_thread_has_one_zone() -> None:
    zones = Zones(1)
    assert zones.many == 1
    assert not zones.of(nodes_of(np.zeros((7, 3)))).any()


def test_sets_of_one_colour_share_no_node() -> None:
    """Every contact belongs to one contact set, and most contacts belong to a set within a zone."""
    draw, nodes = np.random.default_rng(3), 600
    x = np.sort(draw.uniform(size=(nodes, 3)), axis=0)
    zones = Zones(2)
    rows = np.minimum(np.arange(nodes)[:, None] + draw.integers(0, 30, (nodes, 4)), nodes - 1).astype(np.int32)
    every, many = np.arange(nodes, dtype=np.int32), np.zeros((1, 2 * sets(zones.many)), np.int64)
    of, touched, shared = np.zeros(nodes, np.int32), np.zeros(nodes, np.uint8), np.zeros(nodes, np.uint8)
    mark(touched, of, rows, every, zones.of(nodes_of(x)), shared, many, 0, 0, nodes)
    _, (inner, starts) = tasks(zones.many)
    assert np.array_equal(np.sort(inner[:, 0]), sets(zones.many) + np.arange(sets(zones.many)))
    assert many[0, : sets(zones.many)].sum() == 0
    for first, last in pairwise(starts.tolist()):
        seen = np.concatenate([np.unique(rows[of == k]) for k, _ in inner[first:last]])
        assert len(seen) == len(np.unique(seen))
    assert nodes // 2 < many[0, inner[: zones.many, 0]].sum() < nodes


def test_nodes_are_numbered_in_their_order_by_ranges() -> None:
    random = np.random.default_rng(4)
    touched = (random.uniform(size=1000) < 0.3).astype(np.uint8)
    expected, size = np.flatnonzero(touched), 64
    starts = range(0, len(touched), size)
    counts = np.array([*(int(touched[k : k + size].sum()) for k in starts), -1])
    places, slot = np.full(1000, -1, np.int32), np.full(1000, -1, np.int32)
    assert offsets(counts, len(starts)) == len(expected)
    assert counts[-1] == -1
    for task in random.permutation(len(starts)):
        first = size * task
        number(places, slot, touched, counts[task], first, min(first + size, len(touched)))
    assert np.array_equal(places[: len(expected)], expected)
    assert np.array_equal(slot[expected], np.arange(len(expected)))
    assert not touched.any()


def test_the_rows_of_a_set_follow_each_other_task_after_task() -> None:
    many = np.random.default_rng(5).integers(0, 9, (6, 7))
    begin, begins = np.zeros(8, np.int64), np.full((6, 7), -1)
    set_offsets(begin, begins, many, 5)
    ends = np.cumsum(many[:5].T.reshape(-1))
    assert np.array_equal(begins[:5].T.reshape(-1), ends - many[:5].T.reshape(-1))
    assert np.array_equal(begin, np.append(begins[0], ends[-1]))
    assert (begins[5] == -1).all()


@pytest.mark.parametrize("threads", [2, 5])
@pytest.mark.parametrize("seed", range(3))
def test_impulses_of_many_threads_are_those_of_one(threads: int, seed: int) -> None:
    """The contacts are within zones and across zones, with friction and with stored impulses."""
    met, v, mobility = network(seed, friction=0.3)
    ends = []
    for many in (1, threads):
        solver = Solver(met, v, mobility)
        solver.active = ActiveSet(solver.scale, solver.active.stops, team(many))
        solver.begin(np.random.default_rng(seed).normal(size=v.shape))
        solver.step(9)
        ends.append((solver.v.copy(), solver.total.copy(), solver.push.copy(), solver.unsettled.copy()))
    for one, other in zip(*ends, strict=True):
        assert np.array_equal(one, other)


def test_a_step_alone_books_no_work_of_a_step_with_shared_nodes() -> None:
    """A rank that has lost its neighbours has no contacts in the contact sets at the border any more."""
    met, v, mobility = network(4, friction=0.3)
    nobody = np.zeros(0, np.int32)
    before = Solver(met, v, mobility)
    _, with_others = before.solve(9, np.arange(len(v) // 2, dtype=np.int32))
    after, fresh = Solver(met, v, mobility, active=before.active), Solver(met, v, mobility)
    for word, expected in zip(after.solve(9, nobody), fresh.solve(9, nobody), strict=True):
        assert np.array_equal(word, expected)
    assert with_others.any()
