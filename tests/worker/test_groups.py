"""Records of the groups of tets of a run, and the costs of tets, candidate pairs and ranks."""

from typing import Any

import numpy as np
import pytest

from conoid.cases.estimates.balancing import WORK
from conoid.cases.model import materials, schema
from conoid.worker import step
from conoid.worker.migration.balance import Balance, Window
from conoid.worker.migration.groups import Groups
from conoid.worker.migration.meter import Costs, Meter, _candidates, on_parts
from conoid.worker.scene import domain
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import build, whole_of
from .meshes import block
from .simulations import on, tick

MM = 1e-3
MESH = block((7, 4, 4), 1e-3, seed=3)


def test_groups_do_not_depend_on_the_number_of_ranks() -> None:
    one = domain.cut(whole_of(MESH), 1)[0]
    sizes = np.bincount(one.tet_group)
    assert len(sizes) == len(one.groups) == domain.GROUPS
    assert sizes.max() - sizes.min() <= 2
    assert (one.groups[:, 3] == sizes).all()
    for ranks in (2, 3, 4, 8):
        for piece in domain.cut(whole_of(MESH), ranks):
            assert (piece.tet_group == one.tet_group[np.searchsorted(one.tet_ids, piece.tet_ids)]).all()
            assert (piece.node_group == one.node_group[piece.node_ids]).all()
            assert (piece.groups == one.groups).all()


@pytest.mark.parametrize("ranks", [2, 4, 16])
def test_ranks_begin_with_whole_groups_where_their_number_is_a_power_of_two(ranks: int) -> None:
    held = [set(piece.tet_group.tolist()) for piece in domain.cut(whole_of(MESH), ranks)]
    assert sum(map(len, held)) == len(set().union(*held)) == domain.GROUPS


def test_a_group_lies_round_its_centre() -> None:
    whole = whole_of(MESH)
    piece = domain.cut(whole, 1)[0]
    middle = whole.points[whole.tets].mean(axis=1)
    mean = np.array([middle[piece.tet_group == g].mean(axis=0) for g in range(domain.GROUPS)])
    assert piece.groups[:, :3] == pytest.approx(mean)


def test_a_mesh_of_few_tets_has_a_group_for_each() -> None:
    piece = domain.cut(whole_of(block((2, 1, 1), 1e-3)), 1)[0]
    assert sorted(piece.tet_group) == list(range(12))


# Contents of a record


BRITTLE = materials.Material(
    density=2500.0, elastic=materials.Elastic(young=70e9, poisson=0.2),
    brittle=materials.Brittle(strength=50e6, energy=20.0, scatter=materials.Scatter(modulus=5.0)),
)  # fmt: skip
MESHES = [block((4, 4, 4), MM, seed=3), moved(block((5, 5, 3), MM, seed=4), (-0.5 * MM, -0.5 * MM, 4.01 * MM))]
TETS = Costs(np.array([1e-9, 1e-6]), 0.0, 0.0, 0.0)
"""The costs are 1 ns for a tet of the first body and 1 us for a tet of the second body."""


def breaking() -> schema.Case:
    """Returns a brittle block that hits an eroding block."""
    motions: list[dict[str, Any]] = [
        {"velocity": (0.0, 0.0, 150.0), "fracture": schema.Fracture(delay=0.0)}, {"erosion": schema.Erosion()},
    ]  # fmt: skip
    return meeting_of(motions, material=BRITTLE, viscosity={})


def course(sim: Simulation) -> tuple[list[dict[str, Any]], Simulation]:
    """Returns the records of a run in which nodes separate, tets are removed twice, and the mesh is cut again between
    the two removals."""
    balance = Balance.of(sim)
    groups = Groups(sim, 1.5)
    step.prepare(sim)
    recorded = [groups.record(sim)]
    for moment in range(40):
        if moment == 20:
            sim, _ = balance.move(sim)
            groups.moved(sim)
        tick(sim, {10: np.arange(400, 500), 30: np.arange(450, 550)}.get(moment))
    return [*recorded, groups.record(sim)], sim


def test_groups_are_recorded_equally_on_any_number_of_ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each group contains the same tets and nodes for any number of ranks, also after motion. Removed nodes are in no
    group, and copies of nodes are in the group of their parents."""
    case = breaking()
    monkeypatch.setattr(Meter, "costs", lambda *_: TETS)
    (first, last), sim = on(1, case, MESHES, course)[0]
    assert first["tets"] == sim.model.groups[:, 3].tolist()
    assert (first["load"], first["cost"]) == ([0] * 256, 1.5)
    for recorded, _ in on(3, case, MESHES, course):
        assert recorded == [first, last]
    groups, nodes = np.array(first["centres"]), sim.model.nodes
    assert sim.contact is not None
    assert sum(last["outside"]) == sim.contact.outside > sum(first["outside"]) + 100
    assert sum(last["load"]) == 384 + 1000 * (450 - 150)
    for part in sim.model.blocks:
        away = np.linalg.norm(nodes.x0[part.tets].mean(axis=1) - groups[part.group], axis=1)
        assert away.max() < 2.0 * MM
    assert np.linalg.norm(nodes.x0 - groups[nodes.group], axis=1).max() < 2.0 * MM


def test_a_record_is_scheduled_by_the_time_of_the_run_and_costs_little() -> None:
    sim = build(breaking().model_copy(update={"run": schema.Run(end_time=1.0)}), MESHES)
    groups = Groups(sim, 0.0)
    began = groups._recorded
    assert groups.due(0.0, began + 0.25)
    groups._t, groups._took = 0.005, 1e-4
    assert [groups.due(t, began + s) for t, s in ((0.004, 1.0), (0.005, 1.0), (0.004, 11.0), (0.005, 0.03))] == [
        False, True, True, False,
    ]  # fmt: skip


# Costs of groups and ranks


def test_costs_add_up_to_the_work_of_all_ranks() -> None:
    """The sum of the costs of groups and of ranks is all measured work."""
    case = breaking()

    def measured(sim: Simulation) -> tuple[float, float]:
        step.prepare(sim)
        groups = Groups(sim, 0.0)
        groups.record(sim)
        then = sum(sim.timers.seconds[name] for name in WORK[1:]) + on_parts(sim).sum()
        for _ in range(5):
            tick(sim)
        now = sum(sim.timers.seconds[name] for name in WORK[1:]) + on_parts(sim).sum()
        recorded = groups.record(sim)
        return 1e-9 * (sum(recorded["load"]) + sim.comm.size * recorded["rank"]), (now - then) / 5

    for ranks in (1, 2):
        results = on(ranks, case, MESHES, measured)
        assert results[0][0] == pytest.approx(sum(work for _, work in results), abs=256e-9)


def test_a_proposed_cut_is_weighed_by_earlier_measurements() -> None:
    """The whole loss that causes the cut occurs between two reports."""

    def predicted(sim: Simulation) -> tuple[str | None, float]:
        balance = Balance.of(sim)
        step.prepare(sim)
        for _ in range(5):
            tick(sim)
        loads = {name: [2.0 + 2.0 * balance.trigger.cost, 1.0] for name in WORK}
        balance.look(Window(5, loads))
        cause = balance.cause(sim)
        return cause, sum(balance.move(sim)[1]["predicted"])

    for cause, weight in on(2, breaking(), MESHES, predicted):
        assert cause == "time lost exceeds the cost"
        assert weight > 50e-9 * sum(len(mesh.tets) for mesh in MESHES)


def test_candidates_cost_what_they_have_cost_where_they_are() -> None:
    """The cost of a candidate pair is within a factor of four of the mean, because a rank with few candidate pairs
    measures mostly noise."""
    assert _candidates(np.array([4.0, 1.0]), np.array([10.0, 10.0])) == pytest.approx([2.5, 10.0])
    assert _candidates(np.array([4.0, 4.0]), np.array([8.0, 12.0])) == pytest.approx([2.0, 3.0])
    assert _candidates(np.array([100.0, 0.0]), np.array([10.0, 10.0])) == pytest.approx([0.1, 0.8])
    assert _candidates(np.zeros(2), np.zeros(2)) == pytest.approx([0.0, 0.0])
