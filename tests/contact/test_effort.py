"""As many sweeps as are needed: a step that leaves contacts too deep calls for more in the next one."""

from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data
from conoid.worker import simulation, step
from conoid.worker.contact import effort
from conoid.worker.contact.effort import TOLERANCE, Effort
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.state import Model

from .kernels import Solver, column

CASE = Path(__file__).parents[2] / "cases" / "hard" / "wedge_glass.toml"


def test_what_sweeps_have_left_undone_is_told() -> None:
    """The last of twelve nodes runs into the others, which five sweeps have not all reached."""
    v = np.zeros((12, 3))
    v[0, 0] = 100.0
    solver = Solver(column(12), v, np.ones((12, 3)))
    solver.sweep(5)
    left = np.diff(solver.v[:, 0]).min()
    assert solver.active.short() == pytest.approx(-left)
    first = solver.active.short()
    solver.sweep(200)
    assert solver.active.short() < 0.05 * first


def test_sweeps_follow_what_is_left() -> None:
    needed, counts = Effort(5), []
    for short in (0.5, 2.0, 2.0, 2.0, 0.5, 0.1, 0.1, 0.1):
        needed.settle(short * TOLERANCE)
        counts.append(needed.sweeps)
    assert counts == [5, 10, 20, 20, 20, 10, 5, 5]


def inside(model: Model, depth: float) -> int:
    """How many nodes lie deeper than ``depth``, m, below every face of a tet of another part."""
    x, part, count = model.nodes.x, model.nodes.part, 0
    for block in model.blocks:
        corners = x[block.tets]
        inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
        shares = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
        altitudes = 1.0 / np.linalg.norm(shares, axis=1)
        for node in np.flatnonzero(
            (part != block.part) & ((x > corners.min((0, 1))) & (x < corners.max((0, 1)))).all(axis=1)
        ):
            share = np.einsum("ti,tij->tj", x[node] - corners[:, 0], shares)
            share[:, 0] += 1.0
            count += bool(((share * altitudes).min(axis=1) > depth).any())
    return count


def looks(safety: float) -> list[int]:
    """How many nodes are inside by a hundredth of a face, every 20 steps."""
    case = parse_case(apply_overrides(read_data(CASE), ["run.frames=0", f"numerics.dt_safety={safety}"]))
    sim = simulation.build(case, Path(), SerialComm())
    step.prepare(sim)
    assert sim.contact is not None
    size, counts = sim.contact.exterior.size, []
    while not sim.clock.done:
        step.first_half(sim)
        step.second_half(sim)
        if sim.clock.step % 20 == 0:
            counts.append(inside(sim.model, 0.01 * size))
    return counts


def test_a_wedge_sinks_less_into_the_glass_that_it_shatters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Than with five sweeps in every step; means of two runs, for dust is chaos."""
    needed = [looks(safety) for safety in (0.9, 0.89)]
    monkeypatch.setattr(effort, "_MOST", 1)
    five = [looks(safety) for safety in (0.9, 0.89)]
    assert np.mean(np.concatenate(needed)) < 0.6 * np.mean(np.concatenate(five))
