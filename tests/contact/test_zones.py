"""Zones of a surface_nodes: boxes with about as many nodes; and a step by many threads is that by one, to the bit."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from conoid.worker.contact.solver.solver import ActiveSet
from conoid.worker.contact.solver.zones import Zones
from conoid.worker.parallel.team import team

from .kernels import Solver, network


def nodes_of(x: "np.ndarray") -> Any:
    """What zones ask of a surface_nodes."""
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


@pytest.mark.parametrize("threads", [2, 5])
@pytest.mark.parametrize("seed", range(3))
def test_impulses_of_many_threads_are_those_of_one(threads: int, seed: int) -> None:
    """Of contacts within zones and across them, with friction and with impulses that were kept."""
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
