"""The energy balance closes for any change of the step and for all boundaries and contacts."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from conoid.cases.messages import Energy
from conoid.cases.model import materials
from conoid.worker.errors import EnergyError
from conoid.worker.model.rows import WORK, WORK_PLASTIC, WORK_VISCOUS
from conoid.worker.simulation import Simulation

from .kernels import COPPER, COPPER_GAS, FORMS, GLASS, HARD, STEEL, STEEL_42CRMO4, Form, build, run, scene
from .meshes import Floats, block

MESH = block((3, 3, 6), 1e-3, seed=5)
WALL = {"kind": "wall", "point": (0.0, 0.0, -1e-4), "normal": (0.0, 0.0, 1.0)}
FLIGHT: dict[str, Any] = {"velocity": (0.0, 0.0, -100.0), "boundaries": (WALL,)}
PULL: dict[str, Any] = {
    "boundaries": ({"kind": "velocity", "low": (0.0, 0.0, 5.9e-3), "high": (1.0, 1.0, 1.0), "z": 20.0},)
}


def lines(sim: Simulation) -> list[Energy]:
    """Returns the energy balance of every step."""
    found: list[Energy] = []
    run(sim, lambda sim, before: found.append(sim.ledger.close(before)))
    return found


def worst(material: materials.Material, form: Form, **keys: Any) -> float:
    sim = build(scene(material, form, end=4e-6, **keys), [MESH])
    return max(line.residual for line in lines(sim))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "material",
    [STEEL, COPPER, STEEL_42CRMO4, COPPER_GAS, GLASS],
    ids=["elastic", "plastic", "hot", "gas", "brittle"],
)
def test_an_impact_closes_to_a_percent(material: materials.Material, form: Form) -> None:
    assert worst(material, form, viscosity={}, **FLIGHT) < 0.02


@pytest.mark.parametrize("frames", [0, 20])
@pytest.mark.parametrize("keys", [FLIGHT, PULL], ids=["wall", "pull"])
def test_every_line_closes_to_second_order(keys: dict[str, Any], frames: int) -> None:
    """The energy balance of elastic bodies closes also if the step changes before a frame or at the end of the run, and
    if a wall stops a whole face."""
    assert worst(STEEL, "standard", frames=frames, **keys) < 1e-3


@pytest.mark.parametrize("material", [STEEL, HARD], ids=["from the shape", "by rates"])
@pytest.mark.parametrize(("speed", "steps", "share"), [(800.0, 500, 0.005), (80.0, 2000, 0.001)])
def test_a_ringing_body_gains_no_energy(material: materials.Material, speed: float, steps: int, share: float) -> None:
    """A cube with random velocities oscillates without viscosity; its strains are as large as those of the plastic
    flow of an impact."""
    sim = build(scene(material, "standard", jitter=speed), [block((6, 6, 6), 1e-3)])
    found = []

    def look(sim: Simulation, before: Floats) -> None:
        if sim.clock.step % 25 == 0:
            found.append(sim.ledger.close(before).residual)

    run(sim, look, steps)
    assert max(found) < share


def test_what_unequal_steps_take_has_its_line() -> None:
    """A cube oscillates with steps of random lengths. The term ``stepping`` of each node is computed in plain numpy;
    the other terms close the balance."""
    sim = build(scene(STEEL, "standard", jitter=20.0, end=4e-6, dt_growth=2.0), [block((6, 6, 6), 1e-3)])
    random, taken, seen = np.random.default_rng(4), [0.0], []

    def look(sim: Simulation, before: Floats) -> None:
        nodes, clock, line = sim.model.nodes, sim.clock, sim.ledger.close(before)
        force, shorter = nodes.force[:, :3] / sim.scale, 0.25 * (clock.last_dt - clock.dt)
        assert line.stepping == pytest.approx(taken[0], rel=1e-9, abs=1e-12 * line.initial)
        seen.append((line.residual, abs(line.stepping) / line.initial))
        taken[0] += shorter * float((force * (before - nodes.v)).sum())
        clock._safety = random.uniform(0.2, 0.9)

    run(sim, look)
    residuals, shares = np.array(seen).T
    assert len(seen) > 50
    assert shares.max() > 1e-2
    assert residuals.max() < 2e-4


def test_plastic_work_and_viscous_work_never_fall() -> None:
    sim = build(scene(COPPER, "nodal", end=4e-6, viscosity={}, **FLIGHT), [MESH])
    energies = lines(sim)
    plastic = [line.plastic for line in energies]
    assert plastic == sorted(plastic)
    assert plastic[-1] > 0.2 * energies[0].initial
    assert all(line.viscous >= 0.0 for line in energies)
    assert energies[-1].viscous > 0.0


def test_without_viscosity_there_is_none() -> None:
    assert all(line.viscous == 0.0 for line in lines(build(scene(STEEL, end=1e-6, **FLIGHT), [MESH])))


def test_a_free_body_keeps_its_momentum_in_the_ledger() -> None:
    spin = {"centre": (1e-3, 1e-3, 1e-3), "rate": (2e4, 0.0, 5e4)}
    sim = build(scene(STEEL, end=2e-6, velocity=(3.0, -2.0, 1.0), spin=spin), [MESH])
    nodes = sim.model.nodes
    mass = float(nodes.mass.sum())

    def look(sim: Simulation, before: Floats) -> None:
        sim.ledger.close(before)
        assert sim.ledger.momentum == pytest.approx(first, rel=1e-12)
        assert sim.ledger.angular_momentum == pytest.approx(turning, rel=1e-12)

    first = (nodes.mass[:, None] * nodes.v).sum(axis=0)
    turning = (nodes.mass[:, None] * np.cross(nodes.x, nodes.v)).sum(axis=0)
    run(sim, look)
    assert abs(first).max() > mass
    assert abs(turning).min() > 1e-4 * mass


def test_the_parts_are_what_the_ledger_sums_up() -> None:
    """The scene has two plastic bodies without contact: one body moves freely, the other body hits a wall. A single
    part has no energy column of its own."""
    one = scene(COPPER, "standard", end=4e-6, viscosity={}, **FLIGHT)
    part = one.parts[0]
    slow = part.model_copy(update={"name": "slow", "velocity": (0.0, 0.0, 40.0)})
    sim = build(one.model_copy(update={"parts": (part, slow), "contact": None}), [MESH, MESH])
    line = lines(sim)[-1]
    body, other = sim.ledger.parts["body"], sim.ledger.parts["slow"]
    assert body.kinetic + other.kinetic == pytest.approx(line.kinetic, rel=1e-14)
    assert body.internal + other.internal == pytest.approx(line.elastic + line.plastic + line.viscous, rel=1e-14)
    assert other.kinetic == pytest.approx(0.16 * line.initial / 1.16, rel=1e-12)
    assert other.internal == pytest.approx(0.0, abs=1e-12 * line.initial)
    assert body.internal > 0.3 * line.initial
    alone = build(one, [MESH])
    lines(alone)
    assert alone.ledger.parts == {}


@pytest.mark.parametrize("row", [WORK, WORK_VISCOUS])
def test_a_work_that_is_not_a_number_is_no_residual_of_nothing(row: int) -> None:
    """A run without initial energy is also tested: this run ends by its limit of the residual."""
    sim = build(scene(STEEL, end=1e-6, viscosity={}), [MESH])
    run(sim)
    assert sim.ledger.close(sim.model.nodes.v).residual == 0.0
    sim.model.blocks[0].state[0, row, 3] = math.nan
    assert math.isnan(sim.ledger.close(sim.model.nodes.v).residual)


def test_motion_without_a_source_of_energy_ends_the_run() -> None:
    """A single negative term does not matter: plastic work is subtracted again here, and the sum of all terms
    closes."""
    sim = build(scene(COPPER, end=4e-6, **FLIGHT), [MESH])
    ran = False

    def gain(sim: Simulation, before: Floats) -> None:
        nonlocal ran
        if sim.clock.step != 5:
            return
        sim.ledger.close(before)
        sim.ledger.require(sim.case.run, 0.9, "now")
        gained = 0.2 * sim.ledger.initial
        (part,) = sim.model.blocks
        for row in (WORK, WORK_PLASTIC):
            part.row(row)[0] -= gained
        before *= math.sqrt(1.2)
        sim.model.nodes.v[:] *= math.sqrt(1.2)
        sim.ledger.close(before)
        with pytest.raises(
            EnergyError, match=r"the kinetic energy exceeds all received energy by 0\.\d+ of the largest"
        ):
            sim.ledger.require(sim.case.run, 0.9, "now")
        ran = True

    run(sim, gain)
    assert ran


def test_errors_are_shares_of_the_largest_energy_there_has_been() -> None:
    """A pressure acts from the start and gets all its work back: the error is a fraction of the largest work that the
    pressure has done."""
    push = {"kind": "traction", "pressure": 1e6}
    sim = build(scene(STEEL, end=10e-6, boundaries=(push,), viscosity={}), [block((1, 1, 1), 1e-3)])
    most, biggest, worst, shares = 0.0, 0.0, 0.0, list[float]()

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal most, biggest, worst
        line = sim.ledger.close(before)
        most = max(most, abs(line.external))
        if most > 0.0:
            largest = max(most, abs(line.elastic), line.kinetic)
            shares.append(max(abs(line.external), abs(line.elastic), line.kinetic) / largest)
            biggest = max(biggest, largest)
            worst = max(worst, abs(line.stepping) / biggest)

    run(sim, look)
    assert min(shares) < 0.5
    assert sim.ledger.making.worst["stepping"].share == pytest.approx(worst, rel=1e-12)


def named_safety(sim: Simulation) -> float:
    """Returns the dt_safety named in the warning about ``stepping``; 0 if there is no warning."""
    for text in sim.ledger.warnings(sim.case.numerics.dt_safety):
        if text.startswith("the term stepping"):
            return float(text.partition("numerics.dt_safety = ")[2].split()[0])
    return 0.0


def shattered(form: Form, safety: float) -> Simulation:
    """Returns a cube of steel that oscillates from random velocities of its nodes: its time step falls and does not
    recover."""
    return build(scene(STEEL, form, end=6e-6, jitter=800.0, dt_safety=safety), [block((4, 4, 4), 0.75e-3, shake=0.0)])


def crushed(form: Form, safety: float) -> Simulation:
    """Returns a bar without viscosity that a wall shortens: its time step falls with the shock and recovers."""
    part = {"velocity": (0.0, 0.0, -900.0), "boundaries": (WALL,)}
    return build(scene(STEEL, form, end=4e-6, dt_safety=safety, **part), [MESH])


def rebounding(form: Form, safety: float) -> Simulation:
    """Returns a cube of steel with random velocities between two walls, with several rebounds: its time step falls and
    recovers.
    """
    box = [{"kind": "wall", "point": (at,) * 3, "normal": normal} for at, normal in (
        (-1e-5, (0.0, 0.0, 1.0)), (3.01e-3, (0.0, 0.0, -1.0)),
    )]  # fmt: skip
    keys: dict[str, Any] = {"jitter": 900.0, "dt_safety": safety, "dt_growth": 1.2, "boundaries": box}
    return build(scene(STEEL, form, end=4e-6, **keys), [block((4, 4, 4), 0.75e-3, shake=0.0)])


@pytest.mark.parametrize("made", [shattered, rebounding])
@pytest.mark.parametrize("form", ["standard", "nodal"])
def test_what_is_advised_against_unequal_steps_helps(made: Callable[[Form, float], Simulation], form: Form) -> None:
    """With the safety factor that the warning names, the term ``stepping`` is within half of its limit."""
    sim = made(form, 0.9)
    lines(sim)
    safety = named_safety(sim)
    assert sim.ledger.making.worst["stepping"].share > 0.01
    assert 0.1 < safety < 0.9
    better = made(form, safety)
    lines(better)
    assert better.ledger.making.worst["stepping"].share < 0.01
    assert named_safety(better) == 0.0


def test_nothing_is_advised_where_steps_fall_and_cost_nothing() -> None:
    """In the shock at a wall the time step falls by a third."""
    sim = crushed("standard", 0.9)
    lines(sim)
    assert sim.ledger.making.worst["stepping"].share < 0.01
    assert named_safety(sim) == 0.0
