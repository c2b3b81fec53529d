"""V24, H6, H8 in the whole solver: two tets pulled apart, a facet that opens and closes, free tets that oscillate."""

import math
from pathlib import Path

import numpy as np
import pytest

from conoid.cases import load
from conoid.cases.messages import Energy
from conoid.worker import simulation
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker.kernels import run
from ..worker.meshes import Floats

EDGE, ENERGY, STRENGTH, YOUNG, SPEED = 10e-3, 500.0, 1e6, 1e9, 0.25
AREA = math.sqrt(3.0) / 4.0 * EDGE**2
HEIGHT = math.sqrt(2.0 / 3.0) * EDGE


def shipped(name: str, *overrides: str) -> Simulation:
    data = load.read_data(load.shipped_path(name))
    case = load.parse_case(load.apply_overrides(data, [*overrides, "run.frames=0", "probes=[]", "reference=[]"]))
    return simulation.build(case, Path(), SerialComm())


def torn(lean: float, *overrides: str) -> Simulation:
    """Returns the shipped case of two tets, pulled apart along a line inclined by ``lean``, rad."""
    x, z = SPEED * math.sin(lean), SPEED * math.cos(lean)
    pull = [f"boundaries[{i}].{c}={s * v!r}" for i, s in ((0, 1.0), (1, -1.0)) for c, v in (("x", x), ("z", z))]
    stretch = f"parts[0].stretch.rate=[0,0,{z / HEIGHT!r}]"
    return shipped("two_tets", f"parts[0].mesh.lean={lean!r}", stretch, *pull, *overrides)


@pytest.mark.parametrize(
    "lean", [0.0, 60.0, *(pytest.param(lean, marks=pytest.mark.slow) for lean in (15.0, 30.0, 45.0, 63.0))]
)
def test_tearing_two_tets_takes_the_fracture_energy(lean: float) -> None:
    """The opening of the facet varies from pure opening to mostly shear. The energy from the energy ledger uses the
    area at which the facet broke, which is that of the mesh except elastic strain.
    """
    sim, area = torn(math.radians(lean)), 0.0
    energies: list[Energy] = []

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal area
        energies.append(sim.ledger.close(before))
        assert sim.fracture is not None
        assert sim.fracture.cohesion is not None
        if len(sim.fracture.cohesion.facets.tets):
            area = float(sim.fracture.cohesion.facets.constants.area[0])

    run(sim, look)
    assert sim.fracture is not None
    assert sim.fracture.broken == 1
    assert sim.model.nodes.n == 8
    assert area == pytest.approx(AREA, rel=3.0 * STRENGTH / YOUNG)
    assert energies[-1].fracture == pytest.approx(ENERGY * area, rel=1e-3)
    assert energies[-1].cohesive == 0.0
    assert sim.ledger.worst < 1e-4


@pytest.mark.parametrize("back", [0.0, 0.005, 0.02])
def test_energy_released_without_work_is_reported(back: float) -> None:
    """Halfway through the run a part of the energy is subtracted from the work; the last message reports the difference
    if it is above a hundredth.
    """
    sim, taken, area = torn(0.0), False, 0.0

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal taken, area
        assert sim.fracture is not None
        assert sim.fracture.cohesion is not None
        facets = sim.fracture.cohesion.facets
        if sim.ledger.close(before).fracture > 0.5 * ENERGY * AREA and not taken:
            area = float(facets.constants.area[0])
            facets.state.work[0, 0] -= back * ENERGY * area
            taken = True
            sim.ledger.close(before)

    run(sim, look)
    assert taken
    assert sim.ledger.unpaid == pytest.approx(back, rel=1e-6, abs=1e-9)
    warned = [text for text in sim.ledger.warnings(0.9) if "more than they had absorbed" in text]
    assert len(warned) == (back > 0.01)
    assert all("released 0.02 of" in text for text in warned)


def test_the_traction_follows_the_law_in_every_step() -> None:
    """Checks the traction of each pair of nodes: a third of the area times strength (1 - opening / critical), or the
    secant.
    """
    sim = torn(math.radians(30.0))
    worst, seen, top = 0.0, 0, np.zeros(3)

    def look(sim: Simulation, _: Floats) -> None:
        nonlocal worst, seen, top
        assert sim.fracture is not None
        assert sim.fracture.cohesion is not None
        f, law = sim.fracture.cohesion.facets, sim.fracture.cohesion.facets.softening
        if not len(f.tets):
            return
        x, knee = sim.model.nodes.x, law.knee[0]
        one, two = x[f.nodes[0, :3]], x[f.nodes[0, 3:]]
        middle = 0.5 * (one + two)
        first = middle[1] - middle[0]
        normal = np.cross(first, middle[2] - middle[0])
        axes = np.stack([normal, first, np.cross(normal, first)])
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        opening = law.offset[0] + (two - one) @ axes.T
        opening[:, 0] = np.maximum(opening[:, 0], 0.0)
        size = np.linalg.norm(opening, axis=1)
        top = np.maximum(np.maximum(top, knee), size)
        traction = np.maximum(law.strength[0] * (1.0 - (top - knee) / law.critical[0]), 0.0) * size / top
        force = np.linalg.norm(f.state.pull[0], axis=1)
        worst = max(worst, float(np.abs(3.0 * force / f.constants.area[0] - traction).max()))
        seen += 1

    run(sim, look)
    assert seen > 500
    assert worst < 1e-9 * STRENGTH


def breathing(end: str, *sets: str) -> tuple[int, float, float]:
    """Returns how often the facet closed, the largest growth of the energy divided by the energy, and the worst
    residual.
    """
    sim = shipped("breathing_facet", f"run.end_time={end}", "run.residual_limit=1", *sets)
    totals, closed = list[float](), list[bool]()

    def look(sim: Simulation, before: Floats) -> None:
        line = sim.ledger.close(before)
        totals.append(line.kinetic + line.elastic + line.cohesive)
        assert sim.fracture is not None
        assert sim.fracture.cohesion is not None
        f, x = sim.fracture.cohesion.facets, sim.model.nodes.x
        if len(f.tets):
            gap = (x[f.nodes[0, 3:]] - x[f.nodes[0, :3]]).mean(axis=0)
            closed.append(float(np.linalg.norm(gap)) < 1e-5 * float(f.softening.critical[0, 0]))

    run(sim, look)
    return int(np.sum(np.diff(np.array(closed, int)) == 1)), max(totals) / totals[0] - 1.0, sim.ledger.worst


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("edges", "end", "least"),
    [("false", "0.3 ms", 30), pytest.param("false", "2 ms", 40, marks=pytest.mark.slow), ("true", "0.3 ms", 15)],
)
def test_a_facet_that_opens_and_closes_gains_no_energy(edges: str, end: str, least: int) -> None:
    """Contact has dissipated all but 0.001 of the energy after about fifty closings, 0.1 ms, or after half of these
    closings if the edges of the two tets also touch. The remaining energy does not grow.
    """
    cycles, growth, residual = breathing(end, f"contact.edges={edges}")
    print(f"{cycles} cycles, growth {growth:.2e}, residual {residual:.2e}")
    assert cycles > least
    assert growth < 1e-3
    assert residual < 1e-3


def rings(count: str, steps: int) -> tuple[float, float]:
    """Returns the largest growth of kinetic and elastic energy of free tets, and the drift of the mean energy over
    time.
    """
    sim = shipped("free_tets", f"parts[0].mesh.count={count}", "run.end_time=1")
    totals: list[float] = []
    every = max(steps // 1000, 1)

    def look(sim: Simulation, before: Floats) -> None:
        if sim.clock.step % every == 0:
            line = sim.ledger.close(before)
            totals.append(line.kinetic + line.elastic)

    run(sim, look, steps=steps)
    values = np.array(totals) / totals[0]
    tenth = len(values) // 10
    return float(values.max() - 1.0), float(values[-tenth:].mean() - values[:tenth].mean())


def test_free_tets_keep_their_energy() -> None:
    growth, drift = rings("[5, 5, 4]", 2000)
    print(f"growth {growth:.2e}, drift {drift:.2e}")
    assert growth < 1e-4
    assert abs(drift) < 1e-4


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_free_tets_keep_their_energy_for_a_hundred_thousand_steps() -> None:
    growth, drift = rings("[5, 5, 4]", 100_000)
    print(f"growth {growth:.2e}, drift {drift:.2e}")
    assert growth < 1e-4
    assert abs(drift) < 1e-4
