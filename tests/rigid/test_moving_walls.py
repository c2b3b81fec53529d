"""Moving and round walls: momentum to the bit, energy, and closed forms."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from conoid.cases.checks.boundary_checks import check_walls
from conoid.cases.messages import Energy
from conoid.cases.model import schema
from conoid.cases.model.materials import Elastic, Material
from conoid.worker.boundaries.moving_walls import MovingWalls
from conoid.worker.simulation import Simulation

from ..worker.kernels import build, run, scene
from ..worker.meshes import block
from ..worker.simulations import on

Floats = npt.NDArray[np.float64]
DENSITY, YOUNG, SIZE = 8000.0, 200e9, (3e-3, 3e-3, 12e-3)
THIN = Material(density=DENSITY, elastic=Elastic(young=YOUNG, poisson=0.0))
"""Material in which plane waves have the speed sqrt(E / density)."""
BAR = block((3, 3, 12), 1e-3)
MASS = DENSITY * SIZE[0] * SIZE[1] * SIZE[2]
PLANE: dict[str, Any] = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}


class Seen:
    """Quantities of a bar and the first wall of its case at each time."""

    def __init__(
        self, walls: list[schema.Wall], end: float, speed: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        case = scene(THIN, end=end, velocity=speed, boundaries=tuple(walls))
        self.energies: list[Energy] = []
        self.momenta: list[Floats] = []
        self.speeds: list[Floats] = []
        self.times: list[float] = []
        self.sim = run(build(case, [BAR]), self._watch)

    def _watch(self, sim: Simulation, before: Floats) -> None:
        self.energies.append(sim.ledger.close(before))
        self.momenta.append(sim.ledger.momentum.copy())
        self.speeds.append(sim.walls.speed[0].copy())
        self.times.append(sim.clock.t)

    @property
    def worst(self) -> float:
        return max(energy.residual for energy in self.energies)


def test_a_wall_with_a_mass_is_stopped_by_a_bar() -> None:
    """The speed of the wall falls as exp(-Z A t / M) until the wave returns (Goldsmith 1960, Impact, chapter 3, on
    rigid masses that hit rods). Momentum is conserved to round-off, and the momentum of the wall to the bit of its
    quanta.
    """
    mass, speed, wave = 0.3 * MASS, 20.0, float(np.sqrt(YOUNG / DENSITY))
    seen = Seen([schema.Wall(**PLANE, velocity=(0.0, 0.0, speed), mass=mass)], 4e-6)
    rate = DENSITY * wave * SIZE[0] * SIZE[1] / mass
    times, speeds = np.array(seen.times), np.array(seen.speeds)[:, 2]
    later = times > 0.3e-6  # the first layer of nodes has reached the velocity of the wall
    assert speeds[later] == pytest.approx(speed * np.exp(-rate * times[later]), abs=0.04 * speed)
    momenta = np.array(seen.momenta)
    assert np.ptp(momenta, axis=0).max() < 1e-14 * mass * speed
    assert seen.worst < 1e-4
    (walls,) = (bound for bound in seen.sim.boundaries if isinstance(bound, MovingWalls))
    quanta = np.rint(walls.given * walls.scale)
    assert (quanta == walls.given * walls.scale).all()
    assert quanta.sum(axis=0)[2] / walls.scale == pytest.approx(mass * (speed - speeds[-1]), rel=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_light_wall_is_stable(friction: float) -> None:
    """The wall has a thousandth of the mass of the nodes that it hits: the wall ends with the velocity of these nodes,
    and no energy is created.
    """
    wall = schema.Wall(**PLANE, velocity=(3.0, 0.0, 20.0), mass=1e-3 * MASS / 13, friction=friction)
    seen = Seen([wall], 2e-6)
    assert max(energy.kinetic + energy.elastic for energy in seen.energies) <= 1.0001 * seen.energies[0].initial
    assert abs(seen.speeds[-1][2]) < 1.0
    assert np.ptp(np.array(seen.momenta), axis=0).max() < 1e-13 * 1e-3 * MASS


def test_a_driven_wall_works_from_outside() -> None:
    """The driven wall follows its prescribed motion exactly, and its work is external work. A wall that starts at rest
    causes no loss of energy."""
    course = ((0.0, 0.0), (5e-6, 1.0), (10e-6, 0.0))
    seen = Seen([schema.Wall(**PLANE, velocity=(0.0, 0.0, 20.0), course=course)], 12e-6)
    assert seen.sim.walls.shapes.point[0] == pytest.approx([0.0, 0.0, 100e-6], abs=1e-15)
    end = seen.energies[-1]
    assert end.external == pytest.approx(end.kinetic + end.elastic, rel=1e-4)
    assert abs(end.contact) < 1e-4 * end.external
    assert seen.momenta[-1][2] > 0.0


def test_probes_measure_position_velocity_and_force_of_a_wall() -> None:
    """The position of a driven wall is the integral of its prescribed velocity. A free wall loses the impulse that it
    exerts on all parts.
    """
    fields = ("wall_position_z", "wall_velocity_z", "wall_impulse_z")
    probes = tuple(schema.Probe(name=name, field=name, wall="wall") for name in fields)  # type: ignore[arg-type]
    walls = {
        "driven": schema.Wall(**PLANE, velocity=(0.0, 0.0, 20.0), course=((0.0, 0.0), (4e-6, 1.0))),
        "free": schema.Wall(**PLANE, velocity=(0.0, 0.0, 20.0), mass=0.3 * MASS),
    }
    for name, wall in walls.items():
        case = scene(THIN, end=2e-6, boundaries=(wall,)).model_copy(update={"probes": probes})
        lines = list[list[float]]()

        def look(sim: Simulation, before: Floats, to: list[list[float]] = lines) -> None:
            to.append([sim.clock.t, *sim.probes.measure()])

        sim = run(build(case, [BAR]), look)
        t, position, velocity, impulse = np.array(lines).T
        assert position[-1] == pytest.approx(sim.walls.shapes.point[0, 2], rel=1e-12)
        if name == "driven":
            assert position == pytest.approx(20.0 * t * t / 8e-6, rel=1e-12, abs=1e-20)
            assert velocity == pytest.approx(20.0 * t / 4e-6, rel=0.01, abs=1e-12)
        else:
            assert 0.3 * MASS * (20.0 - sim.walls.speed[0, 2]) == pytest.approx(impulse[-1], rel=1e-12)
            assert sim.walls.before[0, 2] > velocity[-1] > sim.walls.speed[0, 2]


def test_a_driven_wall_equals_a_fixed_one_in_a_moving_frame() -> None:
    """A wall hits a bar at rest at 20 m/s, and a second bar hits a fixed wall at -20 m/s."""
    moving = Seen([schema.Wall(**PLANE, velocity=(0.0, 0.0, 20.0), friction=0.1)], 5e-6)
    fixed = Seen([schema.Wall(**PLANE, friction=0.1)], 5e-6, (0.0, 0.0, -20.0))
    shift = np.array([0.0, 0.0, 20.0 * 5e-6])
    assert moving.sim.model.nodes.x == pytest.approx(fixed.sim.model.nodes.x + shift, abs=1e-12)
    assert moving.energies[-1].elastic == pytest.approx(fixed.energies[-1].elastic, rel=1e-6)
    assert moving.energies[-1].contact == pytest.approx(fixed.energies[-1].contact, rel=1e-6)


ROUND = {
    "on a cylinder": schema.Wall(
        kind="wall", shape="cylinder", point=(1.5e-3, 0.0, -5e-3), axis=(0.0, 1.0, 0.0), radius=5e-3
    ),
    "on a sphere": schema.Wall(kind="wall", shape="sphere", point=(1.5e-3, 1.5e-3, -5e-3), radius=5e-3),
    "in a cylinder": schema.Wall(
        kind="wall", shape="cylinder", point=(1.5e-3, 0.0, 7.5e-3), axis=(0.0, 1.0, 0.0), radius=8e-3, side="inside"
    ),
    "in a sphere": schema.Wall(
        kind="wall", shape="sphere", point=(1.5e-3, 1.5e-3, 7.5e-3), radius=8e-3, side="inside", friction=0.2
    ),
}


@pytest.mark.parametrize("name", ROUND)
def test_no_node_ends_behind_a_round_wall(name: str) -> None:
    """After each step no node is deeper than the curvature of the surface along the motion of the step; the energy
    balance closes."""
    wall = ROUND[name]
    seen = Seen([wall], 8e-6, (0.0, 0.0, -50.0))
    radius, side = wall.radius or 0.0, 1.0 if wall.side == "outside" else -1.0
    away = seen.sim.model.nodes.x - np.array(wall.point)
    if wall.shape == "cylinder":
        away[:, 1] = 0.0
    gaps = side * (np.linalg.norm(away, axis=1) - radius)
    assert gaps.min() > -1e-5 * radius
    assert seen.momenta[-1][2] > 0.9 * seen.momenta[0][2]  # which is negative
    assert np.array([energy.contact for energy in seen.energies]).min() > -1e-9
    assert seen.worst < 1e-4


def test_a_wall_with_a_mass_is_the_same_on_any_number_of_ranks() -> None:
    wall = schema.Wall(**PLANE, velocity=(3.0, 0.0, 20.0), mass=0.1 * MASS, friction=0.2)
    case = scene(THIN, end=1.0, boundaries=(wall,))

    def ended(sim: Simulation) -> bytes:
        walls: bytes = run(sim, steps=60).walls.words()
        return walls

    alone = on(1, case, [BAR], ended)
    assert on(3, case, [BAR], ended) == alone * 3
    assert len(alone[0]) == 48


BALL: dict[str, Any] = {"kind": "wall", "shape": "sphere", "radius": 5e-3, "friction": 0.3}
MIRRORS = schema.Symmetry(kind="symmetry", axis="x"), schema.Symmetry(kind="symmetry", axis="y")


@pytest.mark.parametrize("rigid", [None, schema.Rigid()], ids=["deformable", "rigid"])
@pytest.mark.parametrize("cut", [True, False])
def test_a_wall_that_planes_of_symmetry_cut_stays_on_them(rigid: schema.Rigid | None, *, cut: bool) -> None:
    """The bar is a quarter that hits a quarter of a sphere: the other quarters push the sphere back to the axis.
    Without the planes the bar pushes the sphere aside.
    """
    ball = schema.Wall(**BALL, point=(0.0, 0.0, -5.01e-3), mass=0.3 * MASS)
    case = scene(THIN, end=3e-6, velocity=(0.0, 0.0, -20.0), boundaries=(*(MIRRORS if cut else ()), ball))
    case = case.model_copy(update={"parts": (case.parts[0].model_copy(update={"rigid": rigid}),)})
    residuals: list[float] = []
    sim = run(build(case, [BAR]), lambda sim, v: residuals.append(sim.ledger.close(v).residual))
    assert max(residuals) < 1e-3
    assert sim.ledger.momentum[2] == pytest.approx(-20.0 * MASS, rel=1e-12)
    x, y, z = sim.walls.speed[0]
    assert z < -1.0
    assert (x == y == 0.0) if cut else (x < -1e-3 and y < -1e-3)


def test_a_free_wall_must_not_move_across_a_plane_of_symmetry_that_cuts_it() -> None:
    """The plane acts on all parts that the wall stops; a wall beside the plane has a mirror image, and may move."""
    across, beside = (
        schema.Wall(**(PLANE | {"normal": normal}), mass=1.0, velocity=(3.0, 0.0, 2.0))
        for normal in ((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))
    )
    case = scene(THIN, end=1e-6)
    found, none = (
        [str(each) for each in check_walls(case.model_copy(update={"boundaries": (*MIRRORS, wall)}))]
        for wall in (across, beside)
    )
    assert found == [
        "boundaries[2].velocity[0] = '3 m/s': the plane of symmetry boundaries[0] cuts this wall, which cannot move "
        "across it; use 0"
    ]
    assert none == []
