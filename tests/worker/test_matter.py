"""Matter at the nodes: a mean of pressures that are not linear makes no energy, whatever tears or is shocked."""

from typing import Any

import numpy as np
import pytest

from conoid.cases import materials
from conoid.worker.elements.averaging import AveragedElements
from conoid.worker.elements.matter import HEAT, PRESSURE_AT, RATIO
from conoid.worker.simulation import Simulation
from conoid.worker.state import PORES, PRESSURE, WORK_AVERAGED

from .kernels import COPPER, COPPER_GAS, Form, Patch, build, run, scene
from .meshes import Floats, block

MM = 1e-3
TORN = COPPER.model_copy(update={"spall": 1e9})
TORN_GAS = COPPER.model_copy(update={"spall": 1e9, "eos": COPPER_GAS.eos})
SOFT_GAS = COPPER_GAS.model_copy(update={"strength": COPPER.strength})


def rollers(size: float, *axes: str) -> tuple[dict[str, Any], ...]:
    """Planes of symmetry on both sides."""
    return tuple({"kind": "symmetry", "axis": axis, "at": at} for axis in axes for at in (0.0, size))


def to_and_fro(material: materials.Material, form: Form) -> Simulation:
    """A bar whose ends go apart and together four times: pores open and close."""
    course = [(k * 1e-6, 1 - 2 * (k % 2)) for k in range(0, 9)]
    ends = [
        {"kind": "velocity", "low": low, "high": high, "x": x, "course": [(2 * t, f) for t, f in course]}
        for x, low, high in ((-60.0, (-1.0,) * 3, (1e-6, 1.0, 1.0)), (60.0, (4 * MM - 1e-6, -1.0, -1.0), (1.0,) * 3))
    ]
    case = scene(material, form, end=16e-6, viscosity={}, boundaries=(*ends, *rollers(MM, "y", "z")))
    return build(case, [block((8, 2, 2), 0.5 * MM, shake=0.0)])


def shocked(material: materials.Material, form: Form) -> Simulation:
    """A column that meets a wall at 2 km/s, half of it behind the shock."""
    wall = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    held = (wall, *rollers(0.4 * MM, "x", "y"))
    case = scene(material, form, end=1e-6, velocity=(0.0, 0.0, -2000.0), viscosity={}, boundaries=held)
    return build(case, [block((2, 2, 40), 0.2 * MM, shake=0.0)])


def averaging(sim: Simulation) -> float:
    """The largest magnitude of the line, over the largest energy."""
    worst, largest = 0.0, 0.0

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal worst, largest
        if sim.clock.step % 10 == 0:
            line = sim.ledger.close(before)
            largest = max(largest, line.initial, abs(line.external))
            worst = max(worst, abs(line.averaging))

    run(sim, look)
    return worst / largest


@pytest.mark.parametrize("material", [TORN, TORN_GAS], ids=["linear", "gas"])
def test_pores_that_open_and_close_make_no_energy(material: materials.Material) -> None:
    """With the pressure of the mean strain the first made 7 % in twice the time."""
    sim = to_and_fro(material, "nodal")
    assert averaging(sim) < 1e-4
    assert sim.ledger.making.worst.get("plastic", (0.0, 0.0))[0] < 1e-3
    assert max(float(each.row(PORES).max()) for each in sim.model.blocks) >= 0.0


def test_a_shock_makes_no_energy() -> None:
    assert averaging(shocked(SOFT_GAS, "nodal")) < 1e-3


def test_the_pressure_of_a_tet_is_the_mean_of_four_nodes() -> None:
    """Each with its own ratio of volumes and heat: of a random motion, in plain numpy."""
    patch, dt = Patch(block((4, 4, 4), MM), COPPER_GAS, "nodal"), 1e-8
    patch.nodes.v[:] = np.random.default_rng(3).normal(size=patch.nodes.v.shape) * 200.0
    patch.nodes.x += dt * patch.nodes.v
    patch.advance(dt)
    assert isinstance(patch.elements, AveragedElements)
    matter = patch.elements._matter
    assert patch.get(PRESSURE) == pytest.approx(matter[patch.tets, PRESSURE_AT].mean(axis=1), rel=1e-12)
    chi = 1.0 - matter[:, RATIO]
    cold = 8930.0 * 3940.0**2 * chi
    squeezed = chi > 0.0
    cold[squeezed] *= (1.0 - 0.5 * 1.96 * chi[squeezed]) / (1.0 - 1.49 * chi[squeezed]) ** 2
    hot = 1.96 * 8930.0 * 3940.0**2 * matter[:, HEAT]
    assert matter[:, PRESSURE_AT] == pytest.approx((cold + hot) / (1.0 - 0.5 * 1.96 * chi), rel=1e-9, abs=1e-3)
    assert np.ptp(chi) > 0.01


def test_what_the_tets_do_is_what_the_nodes_store() -> None:
    """In steps of any motion single tets give and take, and all together nothing but terms of the third order."""
    patch, dt, speed = Patch(block((4, 4, 4), MM), COPPER_GAS, "nodal"), 1e-9, 200.0
    for seed in range(10):
        patch.nodes.v[:] = np.random.default_rng(seed).normal(size=patch.nodes.v.shape) * speed
        patch.nodes.x += dt * patch.nodes.v
        patch.advance(dt)
    single = patch.get(WORK_AVERAGED)
    assert abs(single.sum()) < 1e-4 * np.abs(single).sum()
