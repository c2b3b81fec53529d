"""Fracture on any number of ranks: equal digests, histories and counts, to the last bit."""

from collections import defaultdict
from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import h5py
import pytest

from conoid.cases.load import parse_case, read_data
from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout
from conoid.worker import simulation, step
from conoid.worker.model.topology import Split
from conoid.worker.parallel.comm import Comm
from conoid.worker.simulation import Simulation

from ..contact.ranks import on_ranks
from .scenes import CASE, FAST, SCENES

RANKS = (2, 3, 4, 7)
Answers = Callable[[int, str], Path]


def outcome(folder: Path) -> Outcome:
    return from_json((folder / layout.OUTCOME).read_bytes())


def marks(name: str, ranks: int = 1) -> list[pytest.MarkDecorator]:
    return [] if name == FAST and ranks < 3 else [pytest.mark.slow]


@pytest.mark.parametrize(
    ("name", "ranks"), [pytest.param(name, n, marks=marks(name, n)) for n in RANKS for name in SCENES]
)
def test_the_same_facets_break_on_any_number_of_ranks(name: str, ranks: int, breaking: Answers) -> None:
    one, many = breaking(1, name), breaking(ranks, name)
    first, other = outcome(one), outcome(many)
    assert (first.state, other.state) == ("succeeded", "succeeded")
    assert (first.ranks, other.ranks) == (1, ranks)
    assert other.digest == first.digest
    assert (other.steps, other.energy, other.eroded) == (first.steps, first.energy, first.eroded)
    assert other.fragments == first.fragments
    assert (other.inside, other.deepest, other.warnings) == (first.inside, first.deepest, first.warnings)
    assert (other.overlapping, other.overlap) == (first.overlapping, first.overlap)
    assert (many / layout.HISTORY).read_bytes() == (one / layout.HISTORY).read_bytes()
    fields = frame_fields(one)
    assert {
        "damage",
        "principal_stress",
        "stress",
        "contact_pressure",
        "strain",
        "density",
        "strain_rate",
    } <= fields.keys()
    assert fields == frame_fields(many)


def frame_fields(folder: Path) -> dict[str, bytes]:
    """Returns the fields of the tets and nodes in the last frame, except the field ``rank``."""
    with h5py.File(sorted((folder / layout.FRAMES).glob("*.vtkhdf"))[-1]) as file:
        groups = [file["VTKHDF"][group] for group in ("CellData", "PointData")]
        return {name: each[...].tobytes() for data in groups for name, each in data.items() if name != "rank"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in SCENES])
def test_the_scenes_break_thoroughly(name: str, breaking: Answers) -> None:
    end = outcome(breaking(1, name))
    assert (end.steps or 0) >= 30
    assert end.fragments is not None
    assert end.fragments > 50
    assert (end.eroded or 0) > 20
    assert end.energy is not None
    assert end.energy.residual < 1e-3
    assert end.energy.contact != 0.0
    assert (end.energy.friction > 0.0) == (name != "smooth")


def shared(sim: Simulation) -> dict[str, Any]:
    """Returns the tables of the contact scene of a rank as ids in their order. The tables are the nodes that the rank
    has, may push and has as copies, and, for each other rank, the nodes that the two ranks sum, and that this rank
    sends and receives.
    """
    assert sim.contact is not None
    now, nodes = sim.contact.searches.scene, sim.model.nodes
    assert now is not None
    ids = now.surface_nodes.id
    return {
        "holds": set(nodes.id.tolist()), "pushes": set(ids[now.slots.pushes].tolist()),
        "lacks": sorted(ids[now.surface_nodes.local < 0].tolist()),
        "sums": {some.rank: ids[some.nodes].tolist() for some in now.messages.company.neighbours},
        "sends": {some.rank: nodes.id[some.nodes].tolist() for some in now.messages.copies.sends},
        "receives": {some.rank: ids[some.nodes].tolist() for some in now.messages.copies.receives},
    }  # fmt: skip


def test_all_ranks_have_the_sharers_of_separating_nodes() -> None:
    """After every split the lists of two ranks are equal, in the same order, with each node once. If any rank may push
    a node, all ranks that push or have the node take part in the sum over the node. A rank receives each ghost node
    once.
    """
    case, ranks = parse_case(read_data(CASE)), 3

    def work(comm: Comm) -> list[list[dict[str, Any]]]:
        sim = simulation.build(case, Path(), comm)
        assert sim.contact is not None
        separate, seen = sim.contact.separate, []

        def watched(split: Split) -> None:
            separate(split)
            if sim.contact is not None and sim.contact.searches.scene is not None:
                seen.append(comm.share(shared(sim)))

        sim.contact.separate = watched  # type: ignore[method-assign]
        step.prepare(sim)
        for _ in range(25):
            step.first_half(sim)
            step.second_half(sim)
        sim.free()
        return seen

    splits = on_ranks(ranks, work)[0]
    assert len(splits) > 10
    assert any(rank["lacks"] for rank in splits[-1])
    for split in splits:
        members = defaultdict[int, set[int]](set)
        for node in set[int]().union(*(rank["pushes"] for rank in split)):
            members[node] = {r for r, rank in enumerate(split) if node in rank["holds"] | rank["pushes"]}
        for one, other in permutations(range(ranks), 2):
            mine, theirs = split[one], split[other]
            listed = mine["sums"].get(other, [])
            assert listed == theirs["sums"].get(one, [])
            assert len(set(listed)) == len(listed)
            assert {node for node, who in members.items() if {one, other} <= who} <= set(listed)
            assert mine["sends"].get(other) == theirs["receives"].get(one)
        for rank in split:
            assert sorted(node for some in rank["receives"].values() for node in some) == rank["lacks"]
