"""V19, V20, H13, H25: bodies that slide, are stacked, or are struck in a stack. Loads act from the start of each run,
so the bodies oscillate."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from conoid.cases import load
from conoid.cases.messages import Energy
from conoid.worker import simulation
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker.kernels import run
from ..worker.meshes import Floats

G = 9.81


def shipped(name: str, *overrides: str) -> Simulation:
    data = load.toml_data(load.shipped_path(name).read_text(encoding="utf-8"))
    case = load.parse_case(load.apply_overrides(data, [*overrides, "probes=[]", "reference=[]"]))
    return simulation.build(case, Path(), SerialComm())


def mean(sim: Simulation, part: str, values: Floats) -> Floats:
    """Returns (3,) mass-weighted means of nodal values of a part."""
    nodes = sim.model.nodes
    mine = nodes.part == sim.model.parts.index(part)
    return np.asarray(np.average(values[mine], axis=0, weights=nodes.mass[mine]))


class Watch:
    """Values of a part in every step: time, position and velocity (3,) of the middle of the part, impulse (3,) and
    energy balance."""

    def __init__(self, part: str) -> None:
        self.part, self.lines = part, list[Energy]()
        self._rows, self._so_far = list[Floats](), np.zeros(3)

    def __call__(self, sim: Simulation, before: Floats) -> None:
        assert sim.contact is not None
        nodes, given = sim.model.nodes, sim.contact.impulses()[sim.model.parts.index(self.part)]
        middle = (mean(sim, self.part, values) for values in (nodes.x, nodes.v))
        self._rows.append(np.concatenate([[sim.clock.t, sim.clock.mean_dt], *middle, given - self._so_far]))
        self._so_far = given
        self.lines.append(sim.ledger.close(before))

    @property
    def table(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Returns (steps,) times, and (steps, 3) positions, velocities and contact forces, without the last step."""
        rows = np.array(self._rows[:-1])
        return rows[:, 0], rows[:, 2:5], rows[:, 5:8], rows[:, 8:11] / rows[:, 1:2]


def slid(*overrides: str) -> Watch:
    watch = Watch("block")
    run(shipped("sliding_block", *overrides), watch)
    return watch


WEIGHT = 1000.0 * 0.046 * 0.046 * 0.008 * G


def test_sliding_without_friction_changes_no_velocity_and_facets_are_not_felt() -> None:
    """The block slides 25 mm over facets of 10 mm, with contacts of 49 nodes of the block and 25 nodes of the plate
    at a time."""
    t, x, v, force = slid("contact.friction=0", "run.end_time=50 ms").table
    assert x[-1, 0] - x[0, 0] > 0.024
    assert np.abs(v[:, :2] - [0.5, 0.0]).max() < 1e-6 * 0.5
    settled = force[t > 0.03]
    assert len(settled) > 600
    assert settled[:, 2].mean() == pytest.approx(WEIGHT, rel=2e-3)
    assert np.abs(settled[:, 2] / WEIGHT - 1.0).max() < 0.05
    assert np.abs(settled[:, :2]).max() < 1e-4 * WEIGHT


def tilted(slope: float) -> list[str]:
    """Returns the scene with the plate as an incline; the block starts at rest."""
    across = G / np.hypot(1.0, slope)
    return [
        f"boundaries[0].acceleration=[{slope * across}, 0, {-across}]",
        "parts[1].velocity=[0, 0, 0]",
    ]


def test_a_block_on_a_steep_incline_slides_with_what_friction_leaves() -> None:
    watch = slid(*tilted(0.5), "run.end_time=40 ms")
    t, _, v, _ = watch.table
    across = G / np.hypot(1.0, 0.5)
    late = t > 0.02
    slope = np.polyfit(t[late], v[late, 0], 1)[0]
    assert slope == pytest.approx((0.5 - 0.3) * across, rel=5e-3)
    assert watch.lines[-1].residual < 1e-3
    heat = [line.friction for line in watch.lines]
    assert heat == sorted(heat)


@pytest.mark.slow
def test_a_block_on_a_gentle_incline_stays() -> None:
    """The slope of the incline is 0.25 with mu = 0.3: the block moves by less than 1e-6 of the edge of a tet in 1000
    steps, and no energy is created."""
    watch = slid(*tilted(0.25), "run.end_time=120 ms")
    _, x, _, force = watch.table
    before, after = x[-2000:-1000].mean(axis=0), x[-1000:].mean(axis=0)
    assert np.abs(after - before).max() < 1e-6 * 8e-3
    assert force[-1000:, 0].mean() == pytest.approx(-0.25 * force[-1000:, 2].mean(), rel=1e-3)
    early, late = watch.lines[len(watch.lines) // 4], watch.lines[-2]
    assert late.kinetic < early.kinetic
    assert late.friction >= early.friction
    assert late.residual < 1e-3


# Stacks ---------------------------------------------------------------------------------------------------------------

STACK = ("block", "first", "second", "third", "fourth")
SMALL_AND_FAST = [
    "parts[4].mesh.low=[-1e-3, -2e-3, 0]", "parts[4].mesh.high=[2e-3, 1e-3, 12e-3]", "parts[4].velocity[2]=-300 m/s",
]  # fmt: skip


def heights(sim: Simulation, part: str, top: bool) -> tuple[Floats, Callable[[Floats], Floats]]:
    """Returns (k, 3) nodes of the top or bottom of a part, and the height of this surface at points (m, 3); NaN outside
    of the surface."""
    nodes = sim.model.nodes
    mine = nodes.part == sim.model.parts.index(part)
    z = np.where(mine, nodes.x0[:, 2], -np.inf if top else np.inf)
    x = nodes.x[np.abs(z - (z.max() if top else z.min())) < 1e-9]
    surface = LinearNDInterpolator(x[:, :2], x[:, 2])
    return x, lambda points: np.asarray(surface(points[:, :2]))


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_no_node_of_a_stack_that_is_struck_comes_to_the_far_side_of_a_plate(friction: float) -> None:
    """A small block hits the stack beside its middle and bends the plates. Nodes of a plate penetrate the neighbouring
    plates by at most 2 % of their thickness, 2 mm.
    """
    sim = shipped("plate_stack", *SMALL_AND_FAST, f"contact.friction={friction}")
    deepest: list[float] = []

    def look(sim: Simulation, before: Floats) -> None:
        line = sim.ledger.close(before)
        assert line.contact >= 0.0
        if sim.clock.step % 20 == 0:
            for upper, lower in pairwise(STACK):
                (above, bottom), (below, top) = heights(sim, upper, top=False), heights(sim, lower, top=True)
                deepest.extend(
                    [float(np.nanmax(top(above) - above[:, 2])), float(np.nanmax(below[:, 2] - bottom(below)))]
                )

    run(sim, look)
    assert max(deepest) < 0.02 * 2e-3
    assert sim.ledger.worst < 0.01
    speeds = [float(mean(sim, part, sim.model.nodes.v)[2]) for part in STACK]
    assert speeds == sorted(speeds, reverse=True)
    assert sim.contact is not None
    assert sim.contact.last_push > 5e-6


RESTING = """
name = "resting"
[materials.rubber]
density = 1000
elastic.young = "1 MPa"
elastic.poisson = 0.3
[numerics]
pressure = "standard"
viscosity = { linear = 1.0 }
[run]
end_time = "60 ms"
frames = 0
[contact]
friction = FRICTION
[[boundaries]]
kind = "gravity"
acceleration = [0, 0, -9.81]
[[boundaries]]
kind = "wall"
point = [0, 0, 0]
normal = [0, 0, 1]
parts = ["low"]
"""
BLOCK = """
[[parts]]
name = "NAME"
material = "rubber"
[parts.mesh]
shape = "box"
generator = "structured"
low = [-WIDTH, -WIDTH, LOW]
high = [WIDTH, WIDTH, HIGH]
element_size = SIZE
"""


def resting(friction: float) -> Simulation:
    """Returns three stacked blocks of 8 mm on a wall, whose meshes do not match."""
    text = RESTING.replace("FRICTION", str(friction))
    for k, (name, size, width) in enumerate((("low", 8e-3, 20e-3), ("middle", 5e-3, 18e-3), ("top", 6e-3, 15e-3))):
        values = {"NAME": name, "SIZE": size, "WIDTH": width, "LOW": 8e-3 * k, "HIGH": 8e-3 * (k + 1)}
        block = BLOCK
        for key, value in values.items():
            block = block.replace(key, str(value))
        text += block
    return simulation.build(load.parse_toml(text), Path(), SerialComm())


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_blocks_in_a_stack_at_rest_do_not_drift(friction: float) -> None:
    """The blocks move by less than a thousandth of the edge of a tet, vertically by their weight or horizontally,
    and no block rebounds."""
    sim = resting(friction)
    places: list[Floats] = []
    lines: list[Energy] = []

    def look(sim: Simulation, before: Floats) -> None:
        if sim.clock.step % 20 == 0:
            places.append(np.concatenate([mean(sim, part, sim.model.nodes.x) for part in sim.model.parts]))
            lines.append(sim.ledger.close(before))

    run(sim, look)
    assert np.abs(np.array(places) - places[0]).max() < 1e-3 * 5e-3
    assert all(line.contact + line.friction >= 0.0 for line in lines)
    swings = [fifth.max() for fifth in np.array_split([line.kinetic for line in lines], 5)]
    assert swings[-1] < 2.0 / 3.0 * swings[0]
    assert (np.diff(swings) < -0.05 * swings[-1]).all(), "12 ms, about a swing, each: one that has not lost has bounced"
    assert sim.ledger.worst < 1e-3
