"""The bench still runs: each of its instruments on something small."""

import time
from unittest.mock import Mock

import numpy as np
import pytest

from conoid.cases import messages
from conoid.worker.mesh.structured import structured

from . import accuracy, gates, switch, taylor_cost
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
    """Burns CPU time."""
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
    """Blocks of ten steps and 5 ms; a message that costs the solver 1 ms is a fifth, whoever of a pair is first."""
    slow, end, ready = Mock(), switch.End(), Mock()
    slow.tell = lambda message: spin(cost)
    listener = switch.Switch(slow, switch.turns(20), ready, end)
    step = 0
    while not end.raised:
        listener.tell(progress(step))
        spin(5e-3)
        step += 10
    assert ready.call_count == 1
    pairs = switch.Pairs("live", listener.blocks)
    assert [block.told for block in pairs.blocks] == switch.turns(20)
    middle, low, high = pairs.ratio("cpu")
    assert low <= middle <= high
    assert middle == pytest.approx(1.0 + cost / 5e-3, abs=0.05)


def test_turns_are_balanced() -> None:
    turns = switch.turns(40)
    assert all(a is not b for a, b in zip(turns[::2], turns[1::2], strict=True))
    assert sum(turns[::2]) == 20
    assert turns[::2] != [True, False] * 20
