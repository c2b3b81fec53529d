"""Material state at the nodes: the mean of nonlinear pressures creates no energy when pores open and close."""

from typing import Any

import numpy as np
import pytest

from conoid.cases.model import materials
from conoid.worker.elements.averaging import AveragedElements
from conoid.worker.elements.matter import PORES_AT, PRESSURE_AT
from conoid.worker.model.rows import PORES, PRESSURE
from conoid.worker.simulation import Simulation

from .kernels import COPPER, Form, build, run, scene
from .meshes import Floats, block

MM = 1e-3
TORN = COPPER.model_copy(update={"spall": 1e9})


def rollers(size: float, *axes: str) -> tuple[dict[str, Any], ...]:
    """Returns planes of symmetry on both sides of the bar."""
    return tuple({"kind": "symmetry", "axis": axis, "at": at} for axis in axes for at in (0.0, size))


def to_and_fro(material: materials.Material, form: Form) -> Simulation:
    """Returns a bar whose ends move apart and together four times, so that pores open and close."""
    course = [(k * 1e-6, 1 - 2 * (k % 2)) for k in range(0, 9)]
    ends = [
        {"kind": "velocity", "low": low, "high": high, "x": x, "course": [(2 * t, f) for t, f in course]}
        for x, low, high in ((-60.0, (-1.0,) * 3, (1e-6, 1.0, 1.0)), (60.0, (4 * MM - 1e-6, -1.0, -1.0), (1.0,) * 3))
    ]
    case = scene(material, form, end=16e-6, viscosity={}, boundaries=(*ends, *rollers(MM, "y", "z")))
    return build(case, [block((8, 2, 2), 0.5 * MM, shake=0.0)])


def averaging(sim: Simulation) -> float:
    """Returns the largest magnitude of the term ``averaging`` over the largest energy."""
    worst, largest = 0.0, 0.0

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal worst, largest
        if sim.clock.step % 10 == 0:
            line = sim.ledger.close(before)
            largest = max(largest, line.initial, abs(line.external))
            worst = max(worst, abs(line.averaging))

    run(sim, look)
    return worst / largest


def test_pores_that_open_and_close_make_no_energy() -> None:
    """With the pressure of the mean strain, pores created 7 % of the energy in twice the time."""
    sim = to_and_fro(TORN, "nodal")
    assert averaging(sim) < 1e-4
    assert sim.ledger.making.worst.get("plastic", (0.0, 0.0))[0] < 1e-3


def test_the_pressure_of_a_tet_is_the_mean_of_four_nodes() -> None:
    """Each node has its own pores."""
    sim = to_and_fro(TORN, "nodal")
    run(sim, steps=60)
    assert isinstance(sim.elements, AveragedElements)
    matter, (part,) = sim.elements.means.matter, sim.model.blocks
    tets = np.asarray(part.tets, np.int64)
    assert part.row(PRESSURE) == pytest.approx(matter[tets, PRESSURE_AT].mean(axis=1), rel=1e-12)
    assert part.row(PORES) == pytest.approx(matter[tets, PORES_AT].mean(axis=1), rel=1e-12)
    assert np.ptp(matter[:, PORES_AT]) > 0.0
