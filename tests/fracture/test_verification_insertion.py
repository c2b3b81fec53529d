"""H5, H7, H17, V25, H27: effect of a breaking facet on its neighbours, and the place at which a body breaks."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from conoid.cases import load
from conoid.worker import simulation, step
from conoid.worker.mesh.faces import FACES
from conoid.worker.model.rows import PRESSURE
from conoid.worker.model.state import CHUNK, Ints
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker import formulas
from ..worker.kernels import run
from ..worker.meshes import Floats

YOUNG, DENSITY, STRENGTH = 72e9, 2500.0, 60e6
"""Material without lateral contraction, so that the wave speed is that of bars."""
C = (YOUNG / DENSITY) ** 0.5
BAR = """
name = "bar"
contact = {contact}
[materials.glass]
density = 2500
elastic = {{ young = 72e9, poisson = 0 }}
brittle = {{ strength = {strength}, energy = {energy} }}
[[parts]]
name = "bar"
material = "glass"
stretch = {{ rate = [0, 0, {rate}] }}
fracture = {{ model = "{model}", delay = 0 }}
[parts.mesh]
shape = "box"
low = [0, 0, {low}]
high = [{wide}, {wide}, {high}]
generator = "structured"
element_size = {size}
[numerics]
pressure = "standard"
dt_safety = {safety}
viscosity = "none"
[run]
end_time = {end}
frames = 0
"""


def bar(extra: str = "", **keys: Any) -> Simulation:
    """Returns a square bar along z; ``extra``: additional tables of the case."""
    given: dict[str, Any] = {
        "contact": "{ friction = 0 }", "strength": STRENGTH, "energy": 5.0, "rate": 0.0, "model": "instant", "low": 0.0,
        "high": 8e-3, "wide": 2e-3, "size": 1e-3, "safety": 0.5, "end": 1e-6, **keys,
    }  # fmt: skip
    case = load.parse_toml(BAR.format(**given) + extra)
    return simulation.build(case, Path(), SerialComm())


def drawn(low: float, high: float, rate: float) -> str:
    """Returns boundaries that continue the initial stretch at the ends of a bar."""
    return "".join(
        f'[[boundaries]]\nkind = "velocity"\nlow = [-1, -1, {z - 1e-6}]\nhigh = [1, 1, {z + 1e-6}]\nz = {rate * z}\n'
        for z in (low, high)
    )


def test_a_cohesive_facet_that_breaks_leaves_the_acceleration_as_it_is() -> None:
    """Under slow uniform tension all facets of a plane break at once; no nodal acceleration changes by more than 1 % of
    the effect of losing its traction.
    """
    rate = 100.0
    sim = bar(drawn(0.0, 8e-3, rate), rate=rate, model="cohesive", end=10e-6, contact='"none"')
    fracture = sim.fracture
    assert fracture is not None
    assert fracture.cohesion is not None
    cohesion, advance = fracture.cohesion, fracture.advance
    jumps, alone = list[float](), list[float]()

    def watched(agreed: int, touched: Ints) -> None:
        nodes, broken = sim.model.nodes, fracture.broken
        before = nodes.force / (nodes.scale * nodes.mass[:, None])
        x = nodes.x.copy()
        advance(agreed, touched)
        if fracture.broken == broken:
            return
        after = nodes.force / (nodes.scale * nodes.mass[:, None])
        parent = np.array([int(np.flatnonzero((x == place).all(axis=1))[0]) for place in nodes.x])
        copies = nodes.n - len(before)
        tets = sim.elements
        jumps.append(float(np.abs(after - before[parent]).max()))
        facets = cohesion.facets
        held = facets.state.pull.copy()
        facets.state.pull[:] = 0.0
        tets.again(nodes.scale)
        alone.append(float(np.abs(nodes.force / (nodes.scale * nodes.mass[:, None])).max()))
        facets.state.pull[:] = held
        tets.again(nodes.scale)
        assert copies > 0

    fracture.advance = watched  # type: ignore[method-assign]
    run(sim)
    print(f"{len(jumps)} events, jumps {max(jumps):.3g} of {alone[0]:.3g} m/s^2: {max(jumps) / alone[0]:.2e}")
    assert jumps[0] < 0.01 * alone[0]


def test_facets_that_open_evenly_do_not_touch() -> None:
    """Under uniform tension all planes break at once: the layers separate, without contact. After the motion is
    reversed the layers are in contact.
    """
    rate = 1000.0
    sim = bar(drawn(0.0, 8e-3, rate), rate=rate, end=1e-3)
    pushed = 0.0

    def go_on(end: float) -> None:
        nonlocal pushed
        while sim.clock.t < end:
            step.first_half(sim)
            assert sim.contact is not None
            pushed = max(pushed, float(np.abs(sim.contact.books.contact_loss).max()), sim.contact.last_push)
            step.second_half(sim)

    step.prepare(sim)
    go_on(1.1e-6)
    assert sim.fracture is not None
    assert sim.fracture.broken >= 7 * 8
    assert pushed == 0.0
    sim.model.nodes.v *= -1.0
    go_on(2.2e-6)
    assert pushed > 0.0


LENGTH, LAYER, PULSE, BEGIN = 20e-3, 0.4e-3, 8e-3, 4e-3


def shape(z: Floats) -> Floats:
    """Returns a smooth pulse that begins at z = BEGIN, m, without a jump that would excite oscillations between
    layers.
    """
    return np.where((z > BEGIN) & (z < BEGIN + PULSE), np.sin(np.pi * (z - BEGIN) / PULSE) ** 2, 0.0)


def pulse(peak: float, model: str, end: float) -> Simulation:
    """Returns a bar in which a compression pulse of ``peak``, Pa, moves towards the far end."""
    sim = bar(low=0.0, high=LENGTH, wide=2 * LAYER, size=LAYER, end=end, model=model)
    nodes, block = sim.model.nodes, sim.model.blocks[0]
    nodes.v[:, 2] = peak / (DENSITY * C) * shape(nodes.x[:, 2])
    fine = np.linspace(0.0, LENGTH, 8001)
    moved = -peak / YOUNG * cumulative_simpson(shape(fine), x=fine, initial=0.0)
    nodes.x[:, 2] += np.interp(nodes.x[:, 2], fine, moved)
    stretch = formulas.gradients(nodes.x[block.tets])[0] / formulas.gradients(nodes.x0[block.tets])[0]
    pressure = np.zeros(block.state.shape[0] * CHUNK)
    pressure[: block.n] = -YOUNG / 3.0 * np.log(stretch)
    block.state[:, PRESSURE, :] = pressure.reshape(-1, CHUNK)
    return sim


def first_spall(peak: float) -> tuple[float, float]:
    """Returns position, m, and time, s, at which incident and reflected pulse first add up to the strength, in closed
    form.
    """
    z = np.linspace(0.0, LENGTH, 8001)
    for t in np.arange(0.0, 3e-6, 1e-9):
        stress = peak * (shape(2.0 * LENGTH - z - C * t) - shape(z - C * t))
        if stress.max() >= STRENGTH:
            return float(z[stress.argmax()]), float(t)
    raise AssertionError("the pulse is too weak")


@pytest.mark.parametrize(("ratio", "model"), [(1.1, "instant"), (1.1, "cohesive"), (1.5, "cohesive"), (2.5, "instant")])
def test_a_pulse_spalls_a_bar_where_it_should(ratio: float, model: str) -> None:
    """The bar breaks within one layer of the predicted plane, and within the travel time of a layer. Shear counts in a
    cohesive facet, so that a pulse of twice the strength would break the facet already in compression.
    """
    where, when = first_spall(ratio * STRENGTH)
    sim = pulse(ratio * STRENGTH, model, when + 2.0 * LAYER / C)
    found: list[tuple[float, float]] = []

    def look(sim: Simulation, _: Floats) -> None:
        block = sim.model.blocks[0]
        if sim.fracture is not None and sim.fracture.broken and not found:
            tet, face = np.nonzero(block.bond)
            z = sim.model.nodes.x0[block.tets[tet[:, None], FACES[face]].astype(np.int64), 2]
            found.extend((float(row.mean()), sim.clock.t) for row in z)

    run(sim, look)
    places = np.array([place for place, _ in found])
    print(
        f"{ratio} {model}: at {places.min() * 1e3:.3f} to {places.max() * 1e3:.3f} mm, {found[0][1] * 1e6:.3f} us; "
        f"{where * 1e3:.3f} mm, {when * 1e6:.3f} us; {sim.fracture and sim.fracture.broken} facets"
    )
    assert np.abs(places - where).max() <= LAYER
    assert found[0][1] == pytest.approx(when, abs=LAYER / C)


@pytest.mark.parametrize("model", ["instant", "cohesive"])
def test_a_pulse_below_the_strength_breaks_nothing(model: str) -> None:
    """The pulse has 0.95 of the strength and is reflected at the free end, so that the bar does not break."""
    sim = run(pulse(0.95 * STRENGTH, model, 3e-6))
    assert sim.fracture is not None
    assert sim.fracture.broken == 0
    assert sim.model.nodes.n == sim.model.nodes_global == 51 * 9


SYMMETRIC = '[[boundaries]]\nkind = "symmetry"\naxis = "z"\n'


def dissipated(low: float, extra: str) -> tuple[float, int, float]:
    """Returns results of a bar from ``low`` to 8 mm that is pulled apart: energy dissipated by fracture, J, number of
    broken facets, and worst residual.
    """
    rate, size = 2000.0, 0.25e-3
    sim = bar(drawn(low, 8e-3, rate) if low else drawn(8e-3, 8e-3, rate) + extra, low=low, rate=rate,
              model="cohesive", energy=0.5, end=1.5e-6, size=size, wide=2.0 * size)  # fmt: skip
    lost = 0.0

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal lost
        if sim.clock.step % 20 == 0:
            lost = sim.ledger.close(before).fracture

    run(sim, look)
    assert sim.fracture is not None
    return lost, sim.fracture.broken, sim.ledger.worst


def test_half_a_bar_with_a_symmetry_plane_takes_half_the_energy() -> None:
    """All 63 planes between the 64 layers of the whole bar break, and 31 planes of the half bar break: the symmetry
    plane is not a facet.
    """
    whole, half = dissipated(-8e-3, ""), dissipated(0.0, SYMMETRIC)
    print(f"whole {whole}, half {half}, {whole[0] / half[0]:.3f} to 1")
    assert whole[0] == pytest.approx(2.0 * half[0], rel=0.05)
