"""Counts of fragments between frames: the sizes are those of the tables on any number of ranks, and the search of
fragments uses only a limited fraction of the time."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.worker import simulation, step
from conoid.worker.fracture import connectivity
from conoid.worker.output import counts
from conoid.worker.output.counts import Counter
from conoid.worker.parallel.comm import Comm, SerialComm
from conoid.worker.parallel.team import team
from conoid.worker.snapshots import share, table

from ..contact.ranks import on_ranks
from ..snapshots.shattered import PARTS, shattered
from .simulations import tick


@pytest.mark.parametrize("ranks", [1, 3])
def test_sizes_are_those_of_a_snapshot_on_any_number_of_ranks(ranks: int) -> None:
    body, threads = shattered(6, 60), team(2 if ranks == 1 else 1)
    shares = body.shares(ranks)

    def work(comm: Comm) -> tuple[int, list[int]]:
        mine = share.joined([shares[comm.rank]], PARTS)
        return counts.sizes(mine.model, connectivity.labels(mine.model, mine.held, comm), comm, threads)

    found = on_ranks(ranks, work)
    whole = body.whole(1)
    known = table.measured(whole, np.concatenate(connectivity.labels(whole.model, whole.held, SerialComm())))
    assert found[0] == table.by_size(known.size)
    assert sum(found[0][1]) == len(known.label) > 50
    assert found[1:] == [(0, [])] * (ranks - 1)


class Clock:
    """Clock that the test advances by the cost of each search of fragments, s."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(counts, "time", made)
    return made


def breaking(clock: Clock, cost: float) -> Any:
    """Returns the parts of a simulation that the counter reads; a search of fragments takes ``cost``, s."""
    model = SimpleNamespace(elements_global=10, nodes_global=5, parts=["one"], blocks=[], nodes=None)

    def look() -> None:
        clock.now += cost

    return SimpleNamespace(
        case=SimpleNamespace(run=SimpleNamespace(threads=1)),
        model=model, fracture=SimpleNamespace(broken=0), erosion=None, contact=None, comm=SerialComm(),
        shared_nodes=lambda: 0,
        record=SimpleNamespace(update=look, labels=[], count=3), clock=SimpleNamespace(step=0),
    )  # fmt: skip


def test_fragments_are_found_as_often_as_their_share_of_the_time_allows(clock: Clock) -> None:
    sim, counter, cost = breaking(clock, 0.1), Counter(), 0.1
    began, found = clock.now, 0
    while clock.now - began < 100.0:
        sim.clock.step += 1
        sim.fracture.broken += 1
        if counter.due(sim, clock.now, ending=False):
            counter.find(sim)
            found += 1
        clock.now += 0.25
    assert found * cost == pytest.approx(100.0 * counts.SHARE, rel=0.1)


def test_no_search_is_made_without_a_new_break(clock: Clock) -> None:
    sim, counter = breaking(clock, 0.001), Counter()
    assert counter.due(sim, clock.now, ending=False)
    counter.find(sim)
    assert not counter.due(sim, clock.now + 1e3, ending=True)
    sim.fracture.broken = 1
    assert counter.due(sim, clock.now + 1e3, ending=False)
    counter.find(sim)
    sim.fracture.broken = 2
    assert not counter.due(sim, clock.now, ending=False)
    assert counter.due(sim, clock.now, ending=True)
    sim.record = None
    assert not counter.due(sim, clock.now + 1e3, ending=True)


def test_counts_are_reported_when_they_have_changed(clock: Clock) -> None:
    sim, counter = breaking(clock, 0.0), Counter()
    counts = counter.changed(sim, 0)
    assert counts is not None
    assert (counts["fragments"], counts["counted"], counts["sizes"]) == (3, -1, [])
    assert counter.changed(sim, 0) is None
    sim.clock.step = 7
    counter.find(sim)
    counts = counter.changed(sim, 0)
    assert counts is not None
    assert counts["counted"] == 7
    assert counter.changed(sim, 1) is not None


ERODING = {
    "name": "eroding", "run": {"end_time": 1e-6, "frames": 0}, "numerics": {"pressure": "standard"},
    "parts": [
        {"name": name, "material": "copper_ofhc", "erosion": {"plastic_strain": 1.0}, "mesh": {
            "shape": "box", "low": [0, y, 0], "high": [8e-3, y + 1e-3, 1e-3], "element_size": 1e-3,
            "generator": "structured"}}
        for name, y in (("bar", 0.0), ("other", 2e-3))
    ],
}  # fmt: skip


@pytest.mark.parametrize("ranks", [1, 2])
def test_tets_cut_off_by_erosion_are_a_fragment(ranks: int) -> None:
    """A layer of tets in the middle of one of two bars is removed, so that the bar consists of two fragments."""

    def work(comm: Comm) -> list[int]:
        sim, counter, found = simulation.build(parse_case(ERODING), Path(), comm), Counter(), []
        step.prepare(sim)
        for x in (None, 4.5e-3):
            block = next(one for one in sim.model.blocks if one.part == 0)
            middle = sim.model.nodes.x[block.tets].mean(axis=1)[:, 0]
            gone = block.id[np.abs(middle - (x or -1.0)) < 5e-4]
            tick(sim, np.concatenate(comm.share(gone)))
            counter.find(sim)
            changed = counter.changed(sim, 0) or pytest.fail("no message")
            count, labels = counts.fragments(sim)
            assert [len(of) for of in labels] == [one.n for one in sim.model.blocks]
            found += [changed["fragments"], count, sum(changed["sizes"])]
        return found

    two, three = [2, 2, 2], [3, 3, 3]
    assert on_ranks(ranks, work)[0] == [*two, *three]
