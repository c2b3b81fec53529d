"""Tests of the benchmarks: each benchmark runs on a small case."""

import time
from unittest.mock import Mock

import numpy as np
import pytest

from conoid.cases import messages
from conoid.worker.mesh.structured import structured

from . import accuracy, contact_cost, gates, growth, guard, switch, taylor_cost
from .gather_scatter import GatherScatter
from .refine import refined
from .scene import Ride, box, case
from .speed import METALS, measure, tables
from .stopwatch import take_turns
from .table import table


def test_works_take_turns_and_the_first_round_does_not_count() -> None:
    clock = iter(range(8))
    times = take_turns({"a": lambda: float(next(clock)), "b": lambda: float(next(clock))}, rounds=3)
    assert times["a"].seconds == (2.0, 4.0, 6.0)
    assert times["b"].best == 3.0
    assert times["b"].spread == pytest.approx(4.0 / 5.0)


def test_tables_are_markdown() -> None:
    text = table(["what", "n"], [["tets", 12960], ["none", None]])
    assert text.splitlines() == ["| what |      n |", "| ---- | -----: |", "| tets | 12,960 |", "| none |      - |"]


def test_refined_children_fill_their_parent_and_keep_its_motion() -> None:
    mesh = structured(box(48, "structured"))
    fine = refined(mesh)
    volumes = fine.mesh.volumes().reshape(-1, 8)
    assert (volumes > 0).all()
    assert volumes == pytest.approx(np.repeat(mesh.volumes()[:, None] / 8.0, 8, axis=1))
    assert fine.nodal(mesh.points) == pytest.approx(fine.mesh.points)
    assert len(fine.mesh.points) == len(np.unique(fine.mesh.points.round(12), axis=0))


def test_a_stretched_metal_yields_everywhere_once_it_has_left_the_elastic_range() -> None:
    ride = Ride(case("copper_taylor", "nodal", box(3_000, "structured")))
    ride.stretch(1e-3)
    assert ride.yielding() == 0.0
    ride.steps(5)
    assert ride.yielding() > 0.9


def test_gather_scatter_adds_forces_that_sum_to_zero() -> None:
    ride = Ride(case("steel", "standard", box(384, "structured")))
    ride.stretch(1e-5)
    kernel = GatherScatter(ride.sim)
    assert kernel.sweeps(2) > 0.0
    assert (kernel.force.sum(axis=0) == 0).all()


def test_speeds_and_their_gates() -> None:
    speeds = list(measure([box(384, "structured")], METALS[:1], rounds=1))
    assert {speed.form for speed in speeds} == {"standard", "nodal", "split"}
    assert all(0.0 < speed.median <= speed.best < speed.limit_best for speed in speeds)
    assert "384 tets" in tables(speeds)
    assert not list(gates.of_speed(speeds)), "the requirement is for 136,000 to 150,000 tets"


def test_mean_speed_weighs_stages_by_the_time_that_they_take() -> None:
    fast, slow = (taylor_cost.Stage("nodal", 0.5, 0.0, 1, 0.0, rate, rate, 0.0, 60.0) for rate in (8.0, 2.0))
    assert taylor_cost.mean_speed([fast, slow]) == pytest.approx((3.2, 3.2))


def test_a_coarse_bar_answers_every_reference() -> None:
    (answer,) = accuracy.measure([accuracy.Plan("taylor_42crmo4", 1.6, "standard")])
    assert answer.problem == ""
    assert answer.value("radius") == pytest.approx(4.3e-3, rel=0.1)
    assert "foot strain" in accuracy.report([answer])


def spin(seconds: float) -> None:
    """Uses CPU time."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def progress(step: int) -> messages.Progress:
    names = ("kinetic", "elastic", "plastic", "viscous", "contact", "external", "initial", "residual")
    energy = messages.Energy(**dict.fromkeys(names, 0.0))
    return messages.Progress(
        run="run", step=step, end_time=1.0, dt=1.0, limiter="", eta=0.0, energy=energy, updates_per_second=1.0
    )


@pytest.mark.parametrize("cost", [0.0, 1e-3])
def test_the_switch_finds_what_telling_costs(cost: float) -> None:
    """Each block has ten steps and takes 5 ms. A message costs the solver 1 ms, a fifth of a block, in either order of
    a pair.
    """
    slow, end, ready = Mock(), switch.End(), Mock()
    slow.tell = lambda message, blob: spin(cost)
    listener = switch.Switch(slow, switch.turns(20), ready, end)
    step = 0
    while not end.raised:
        listener.tell(progress(step))
        spin(5e-3)
        step += 10
    assert ready.call_count == 1
    pairs = switch.Pairs("live", listener.blocks)
    assert [block.live for block in pairs.blocks] == switch.turns(20)
    middle, low, high = pairs.ratio("cpu")
    assert low <= middle <= high
    assert middle == pytest.approx(1.0 + cost / 5e-3, abs=0.05)


def test_turns_are_balanced() -> None:
    turns = switch.turns(40)
    assert all(a is not b for a, b in zip(turns[::2], turns[1::2], strict=True))
    assert sum(turns[::2]) == 20
    assert turns[::2] != [True, False] * 20


def test_growth_is_that_of_a_tet_and_its_gates_are_for_elastic_tets() -> None:
    now = growth.here(3_000, 1, armed=True)
    assert now.tets == 3_072
    assert 0.0 < now.limit < now.best
    small, large = (
        growth.Growth(False, n, best, best, 0.0, 10.0, base=1_000, peak=1_000 + 300 * n, steady=1_000 + 200 * n)
        for n, best in ((1_000, 50.0), (5_000, 60.0))
    )
    assert large.bytes_a_tet(small) == large.bytes_each == (300.0, 200.0)
    dear = growth.Growth(True, 1_000, 500.0, 500.0, 0.0, 10.0, base=0, peak=10**9, steady=10**9)
    assert [gate.measured for gate in gates.of_growth([small, large, dear])] == ["300", "200", "1.20"]
    assert [line.split("|")[5].strip() for line in growth.report([small, large, dear]).splitlines()[2:5]] == [
        "1.00", "1.20", "1.00"
    ]  # fmt: skip


def test_an_armed_box_is_searched_for_cracks_and_contact_and_has_neither() -> None:
    ride = Ride(growth.scene(3_000, armed=True))
    ride.stretch(1e-7)
    ride.steps(20)
    fracture, contact = ride.sim.fracture, ride.sim.contact
    assert fracture is not None
    assert contact is not None
    assert (fracture.broken, contact.searches.many) == (0, 1)
    ride.stretch(1e-3)
    ride.steps(20)
    assert fracture.broken > 0, "it is armed"


def test_contact_domains_are_compared_rank_by_rank_over_both_runs() -> None:
    def run(faces: int, cpu: float) -> contact_cost.Run:
        course = [[0.0, faces, faces // 2], [1.0, 3 * faces, faces // 2]]
        return [
            {"course": course, "cpu": cpu * (rank + 1), "searching": cpu, "bytes": 8_000 * faces, "messages": 40}
            for rank in range(6)
        ]

    found = {"box": [run(40, 3.0), run(40, 5.0)], "arbitrary": [run(20, 2.0), run(20, 2.0)]}
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in contact_cost.domain_report(found, 8).splitlines()
    ]
    assert rows[2][:7] == ["faces of a search", *["80 / 40"] * 4, "2.00", "2.00"]
    assert rows[4] == ["contact, CPU s", "14 / 7", "24 / 12", "4 / 2", "24 / 12", "2.00", "2.00", "> 2 (fig. 5)"]
    assert rows[6][1:3] == ["40 / 20", "40 / 20"], "kB a step"


def paid(elements: float, contact: float, digest: str) -> guard.Paid:
    phases = {"elements": [elements], "contact": [contact], "fracture": [0.001]}
    outcome = {"phases": phases, "digest": digest, "elements": 10, "steps": 3, "worst_residual": 1e-6}
    return guard.Paid(outcome)


def test_the_guard_compares_medians_of_rounds_and_the_digests() -> None:
    rounds = [(paid(1.0, 3.0, "abcdefghi"), paid(1.0, contact, "abcdefghi")) for contact in (3.0, 6.0, 9.0)]
    found = guard.Compared(guard.QUICK[0], rounds)
    assert (found.ratio("contact"), found.ratio("elements"), found.ratio("fracture")) == (2.0, 1.0, 1.0)
    assert found.ratio() == pytest.approx(7.001 / 4.001)
    assert "equal, abcdefgh" in guard.report([found], guard.BASE)
    other = guard.Compared(guard.QUICK[0], [(rounds[0][0], paid(1.0, 3.0, "other"))])
    assert "another; residuals 1.0e-06, 1.0e-06" in guard.report([other], guard.BASE)
