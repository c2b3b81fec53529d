"""Rigid bodies in whole cases: all contacts, walls, constraints and prescribed motion; energy and momentum balances."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from conoid.cases.messages import Energy
from conoid.cases.model import schema
from conoid.cases.model.measures import Beyond
from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.errors import PhysicsError
from conoid.worker.mesh.model import TetMesh
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved, rotation
from ..worker.kernels import build, run
from ..worker.meshes import block
from ..worker.simulations import kept_again, on, tick

Floats = npt.NDArray[np.float64]
PLATE = block((6, 6, 3), 1e-3)
BOX = moved(block((2, 2, 2), 1e-3), (2.1e-3, 2.3e-3, 3.02e-3))
TILTED = moved(block((2, 2, 2), 1e-3), (2.1e-3, 2.3e-3, 3.6e-3), rotation((1.0, 2.0, 0.3), 0.5))
ABOVE = moved(block((2, 2, 2), 1e-3), (1.9e-3, 2.0e-3, 6.1e-3), rotation((1.0, 0.0, 1.0), 0.3))
GROUND = schema.Wall(kind="wall", point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), friction=0.3)
RIGID = schema.Rigid()


def rigid_case(
    motions: Sequence[dict[str, Any]], boundaries: Sequence[schema.Boundary] = (), **keys: Any
) -> schema.Case:
    """Returns a case of bodies in contact, with the given keys of parts and the given boundaries."""
    contact = keys.pop("contact", {})
    case = meeting_of(motions, contact, **keys)
    return case.model_copy(update={"boundaries": tuple(boundaries)})


class Seen:
    """Quantities of a run at each time."""

    def __init__(self, case: schema.Case, meshes: Sequence[TetMesh], steps: int = -1) -> None:
        self.energies: list[Energy] = []
        self.momenta: list[Floats] = []
        self.speeds: list[Floats] = []
        self.rates: list[Floats] = []
        self.centres: list[Floats] = []
        self.sim = run(build(case, meshes), self._watch, steps)

    def _watch(self, sim: Simulation, before: Floats) -> None:
        self.energies.append(sim.ledger.close(before))
        self.momenta.append(np.concatenate([sim.ledger.momentum, sim.ledger.angular_momentum]))
        if sim.rigid is not None:
            bodies = sim.rigid.bodies
            self.speeds.append(bodies.speed.copy())
            self.rates.append(bodies.rates(bodies.momentum))
            self.centres.append(bodies.centre.copy())

    @property
    def worst(self) -> float:
        """Returns the largest residual of the energy balance."""
        return max(energy.residual for energy in self.energies)

    @property
    def drift(self) -> float:
        """Returns the largest change of the linear momentum, over the size of the momentum."""
        p: Floats = np.array(self.momenta)[:, :3]
        return float(np.ptp(p, axis=0).max()) / float(np.abs(p).max())


def test_energy_and_momentum_at_the_start_are_those_of_the_mesh() -> None:
    """The reference values are sums over the nodes of a deformable body with the same motion."""
    motion = {"velocity": (30.0, -20.0, 50.0), "spin": schema.Spin(centre=(1e-3, 0.0, 2e-3), rate=(3e3, 9e3, -5e3))}
    seen = [Seen(rigid_case([{**motion, **how}], contact=None), [TILTED], 1) for how in ({}, {"rigid": RIGID})]
    energy, momenta = ([getattr(each, name)[0] for each in seen] for name in ("energies", "momenta"))
    assert energy[1].initial == pytest.approx(energy[0].initial, rel=1e-13)
    assert momenta[1] == pytest.approx(momenta[0], rel=1e-9, abs=1e-12 * np.abs(momenta[0]).max())


@pytest.mark.parametrize(("mesh", "friction"), [(BOX, 0.0), (TILTED, 0.3)])
def test_a_rigid_box_hits_a_plate(mesh: TetMesh, friction: float) -> None:
    """Momentum is conserved to round-off, and the impulses of the two parts are opposite to the bit; the energy is as
    accurate as without a rigid body."""
    motions: list[dict[str, Any]] = [{}, {"rigid": RIGID, "velocity": (0.0, 0.0, -100.0)}]
    seen = Seen(rigid_case(motions, contact={"friction": friction}, end=6e-6), [PLATE, mesh])
    assert seen.sim.contact is not None
    given = seen.sim.contact.books.parts
    assert (given.sum(axis=0) == 0).all()
    assert given[1, 2] > 0
    assert seen.drift < 1e-14
    assert seen.worst < 1e-4
    assert seen.speeds[-1][0, 2] > 0.0
    first, last = seen.energies[0], seen.energies[-1]
    assert first.kinetic > last.kinetic + last.elastic > 0.5 * first.kinetic


def test_rigid_bodies_rebound_by_newtons_law() -> None:
    """The corner of a small cube hits a rod off its centre, with restitution 1: J = 2 v / (1/m + 1/M + d^2 / I) along x
    for an arm d about y (Goldsmith 1960, Impact, chapter 2).
    """
    rod, axis = block((2, 2, 16), 1e-3), (0.0, 1.0, -1.0)
    cube = TetMesh(
        (block((2, 2, 2), 1e-3).points - 1e-3) @ rotation(axis, np.arccos(1.0 / np.sqrt(3.0))).T,
        block((2, 2, 2), 1e-3).tets,
    )
    cube = moved(cube, np.array([-1e-5, 1e-3, 13.4e-3]) - cube.points[np.argmax(cube.points[:, 0])])
    mass, little, speed, arm, inertia = 1.0, 0.25, 20.0, 5.4e-3, (3e-5, 3e-5, 1e-6, 0.0, 0.0, 0.0)
    motions: list[dict[str, Any]] = [
        {"rigid": schema.Rigid(mass=mass, centre=(1e-3, 1e-3, 8e-3), inertia=inertia)},
        {"rigid": schema.Rigid(mass=little), "velocity": (speed, 0.0, 0.0)},
    ]
    seen = Seen(rigid_case(motions, contact={"restitution": 1.0}, end=2e-6), [rod, cube])
    impulse = 2.0 * speed / (1.0 / little + 1.0 / mass + arm**2 / inertia[1])
    assert seen.speeds[-1][:, 0] == pytest.approx([impulse / mass, speed - impulse / little], rel=1e-3)
    assert seen.rates[-1][0, 1] == pytest.approx(impulse * arm / inertia[1], rel=1e-3)
    assert seen.energies[-1].kinetic == pytest.approx(0.5 * little * speed**2, rel=1e-3)
    assert seen.drift < 1e-14


def test_a_rigid_box_lands_flat_and_slides_to_rest() -> None:
    """In this test a box lands on a wall, with friction and gravity: there is no rotation and no rebound, and the
    sliding distance is that of Coulomb's law, v^2 / (2 mu g)."""
    gravity = schema.Gravity(kind="gravity", acceleration=(0.0, 0.0, -1e4))
    case = rigid_case([{"rigid": RIGID, "velocity": (2.0, 0.0, 0.0)}], [GROUND, gravity], contact=None, end=1e-3)
    seen = Seen(case, [block((3, 3, 3), 1e-3)])
    way = seen.centres[-1][0] - seen.centres[0][0]
    assert way == pytest.approx([2.0**2 / (2.0 * 0.3 * 1e4), 0.0, 0.0], rel=5e-3, abs=1e-8)
    assert np.abs(seen.rates).max() < 0.02
    end = seen.energies[-1]
    assert end.kinetic < 1e-6 * end.initial
    assert end.friction == pytest.approx(end.initial, rel=1e-4)
    assert seen.worst < 1e-12


def test_a_rigid_body_between_a_wall_and_another_one_is_no_spring() -> None:
    """A block falls on a light rigid plate on a wall, and on a plate of 1000 t without a wall: the speeds agree to 1
    %."""
    falling, plate = moved(block((3, 3, 3), 1e-3), (0.0, 0.0, 1e-3)), block((3, 3, 1), 1e-3)
    ends = []
    for how, walls in ((RIGID, [GROUND]), (schema.Rigid(mass=1e6), [])):
        motions: list[dict[str, Any]] = [{"rigid": how}, {"velocity": (0.0, 0.0, -20.0)}]
        seen = Seen(rigid_case(motions, walls, end=1.5e-6), [plate, falling])
        nodes = seen.sim.model.nodes
        ends.append(nodes.v[nodes.part == 1])
        assert np.abs(np.array(seen.speeds)[:, 0, 2]).max() < 0.01
    assert ends[0][:, 2] == pytest.approx(ends[1][:, 2], abs=0.2)


def test_planes_of_symmetry_leave_a_quarter_its_motions() -> None:
    """A quarter of a box between two planes moves only along their intersection and does not rotate; half of a box
    rotates."""
    planes = [schema.Symmetry(kind="symmetry", axis=axis) for axis in ("x", "y")]
    motion = {"rigid": RIGID, "velocity": (0.0, 0.0, -5.0)}
    seen = Seen(rigid_case([motion], [*planes, GROUND], contact=None, end=1e-4), [moved(BOX, (-2.1e-3, -2.3e-3, 0.0))])
    assert seen.speeds[0][0] == pytest.approx([0.0, 0.0, -5.0])
    assert not np.array(seen.rates).any()
    half = {"rigid": RIGID, "spin": schema.Spin(centre=(1e-3, 1e-3, 1e-3), rate=(2e3, 0.0, 0.0))}
    turning = Seen(rigid_case([half], planes[:1], contact=None, end=1e-3), [block((2, 2, 2), 1e-3)])
    assert turning.rates[-1][0] == pytest.approx([2e3, 0.0, 0.0], rel=1e-12)
    assert turning.worst < 1e-12


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_body_beside_a_plane_of_symmetry_meets_its_image(restitution: float) -> None:
    """The plane does not act on the body before the impact. A corner of the body hits the plane and rebounds with the
    given fraction of its velocity."""
    plane = schema.Symmetry(kind="symmetry", axis="x")
    motion = {"rigid": RIGID, "velocity": (-30.0, 5.0, 0.0)}
    case = rigid_case([motion], [plane], contact={"restitution": restitution}, end=8e-5)
    seen = Seen(case, [TILTED])
    assert seen.speeds[1][0] == pytest.approx([-30.0, 5.0, 0.0], rel=1e-12)
    hit = int(np.argmax(np.any(np.array(seen.rates)[:, 0] != 0.0, axis=1)))
    nodes = seen.sim.model.nodes
    assert 0 < hit < len(seen.rates) - 1
    assert nodes.x[:, 0].min() > -1e-7
    assert seen.speeds[hit][0, 0] > -30.0
    arm = TILTED.points[np.argmin(TILTED.points[:, 0])] - seen.centres[0][0]
    speed, rate = seen.speeds[hit + 1][0], seen.rates[hit + 1][0]
    assert speed[0] + rate[1] * arm[2] - rate[2] * arm[1] == pytest.approx(30.0 * restitution, abs=0.1)
    assert seen.worst < 1e-12


def test_walls_that_close_on_a_rigid_body_end_the_run() -> None:
    driven = schema.Wall(
        kind="wall", name="lid", point=(0.0, 0.0, 2.001e-3), normal=(0.0, 0.0, -1.0), velocity=(0.0, 0.0, -1.0)
    )
    case = rigid_case([{"rigid": RIGID}], [GROUND, driven], contact=None, end=1e-4)
    with pytest.raises(PhysicsError, match="rigid part 'body0' cannot be kept out of a wall"):
        Seen(case, [block((2, 2, 2), 1e-3)])


def test_a_driven_punch_works_from_outside() -> None:
    """A rigid punch penetrates a plate on a wall: the work of the punch is in the energy balance, and the motion of the
    punch is the prescribed motion."""
    ramp = ((0.0, 0.0), (0.5e-6, 1.0))
    drive = schema.Prescribed(kind="velocity", parts=("body1",), x=0.0, y=0.0, z=-50.0, course=ramp)
    ground = GROUND.model_copy(update={"parts": ("body0",)})
    seen = Seen(rigid_case([{}, {"rigid": RIGID}], [drive, ground], end=3e-6), [PLATE, BOX])
    way = seen.centres[-1][0, 2] - seen.centres[0][0, 2]
    assert way == pytest.approx(-50.0 * (3e-6 - 0.25e-6), rel=1e-9)
    end = seen.energies[-1]
    assert end.external > 2.0 * end.kinetic > 0.0
    assert seen.worst < 1e-4


@pytest.mark.parametrize("how", [{"rigid": RIGID}, {}], ids=["rigid", "deformable"])
@pytest.mark.parametrize("ramp", [False, True])
def test_prescribed_rotation_is_exact(how: dict[str, Any], *, ramp: bool) -> None:
    """The ramps end at half of the time; the energy at the end is that of the rigid motion, and its balance closes."""
    end, spin = 1e-4, schema.Spin(centre=(1e-3, -2e-3, 0.0), rate=(0.0, 0.0, 2e4))
    keys: dict[str, Any] = {
        "course": ((0.0, 0.5), (0.5 * end, -1.0)),
        "velocity": (7.0, 0.0, -20.0),
        "velocity_course": ((0.0, 0.0), (0.5 * end, 1.0)),
    }
    turn = schema.Rotation(kind="rotation", spin=spin, **(keys if ramp else {}))
    seen = Seen(rigid_case([how], [turn], contact=None, end=end), [TILTED])
    nodes, mean, last = seen.sim.model.nodes, *((-0.625, -1.0) if ramp else (1.0, 1.0))
    assert seen.sim.clock.t == pytest.approx(end, rel=1e-12)
    centre, moved = np.array(spin.centre), 0.75 * end * np.array(turn.velocity)
    exact = moved + centre + (nodes.x0 - centre) @ rotation((0.0, 0.0, 1.0), -mean * 2e4 * end).T
    assert nodes.x == pytest.approx(exact, abs=1e-14)
    v = np.cross((0.0, 0.0, last * 2e4), nodes.x - centre - moved) + np.array(turn.velocity)
    assert seen.energies[-1].kinetic == pytest.approx(0.5 * float((nodes.mass[:, None] * v * v).sum()), rel=1e-3)
    assert seen.worst < 1e-12


RAM = schema.Wall(
    kind="wall", name="ram", point=(-5e-5, 0.0, 0.0), normal=(1.0, 0.0, 0.0), velocity=(9.0, 0.0, 0.0), mass=1e-3
)  # fmt: skip
FALLING: list[dict[str, Any]] = [{"rigid": RIGID, "velocity": (0.0, 0.0, speed)} for speed in (-100.0, -300.0)]
SCENE = rigid_case([{}, *FALLING], [GROUND, RAM], contact={"friction": 0.3}, end=6e-6)
"""The scene has a plate between a wall and a ram, and two rigid boxes that fall on the plate and on each other."""
MESHES = (PLATE, TILTED, ABOVE)


def state_of(sim: Simulation) -> tuple[str | None, list[list[float]]]:
    assert sim.rigid is not None
    words = sim.walls.words() + sim.rigid.words()
    return digest.digest(sim.model, sim.comm, [], words), sim.rigid.bodies.speed.tolist()


def stepped(sim: Simulation, many: int = 120) -> tuple[str | None, list[list[float]]]:
    step.prepare(sim)
    for _ in range(many):
        tick(sim)
    return state_of(sim)


@pytest.mark.parametrize("ranks", [2, 3, 7])
def test_any_number_of_ranks_gives_one_answer(ranks: int) -> None:
    (alone,) = on(1, SCENE, MESHES, stepped)
    several = on(ranks, SCENE, MESHES, stepped)
    assert several[0] == alone
    assert all(speeds == alone[1] for _, speeds in several)
    assert alone[1][0] != [0.0, 0.0, -100.0]


def test_two_threads_give_the_answer_of_one() -> None:
    """The test runs on one rank and on two ranks."""
    threaded = SCENE.model_copy(update={"run": SCENE.run.model_copy(update={"threads": 2})})
    (alone,) = on(1, SCENE, MESHES, stepped)
    assert on(1, threaded, MESHES, stepped) == [alone]
    assert on(2, threaded, MESHES, stepped)[0] == alone


def test_probes_of_a_whole_body_have_its_inertia_and_centre() -> None:
    """The values are 1/2 M V^2 + 1/2 w I w, M V, c and V of the body; the values of some of its nodes are sums over
    these nodes.
    """
    fields = ["kinetic_energy", "momentum_y", "centre_z", "centre_velocity_x", "mass", "fragment_mass"]
    beyond = {"fragment_mass": Beyond(axis="x")}
    probes = [
        schema.Probe(name=field, part="body0", field=field, beyond=beyond.get(field))  # type: ignore[arg-type]
        for field in fields
    ]
    everywhere = {"low": (-1.0, -1.0, -1.0), "high": (1.0, 1.0, 1.0)}
    probes.append(schema.Probe(name="nodes", part="body0", field="kinetic_energy", **everywhere))  # type: ignore[arg-type]
    rigid = schema.Rigid(mass=0.5, centre=(2e-3, 3e-3, 4e-3), inertia=(1e-6, 2e-6, 2.5e-6, 0.0, 0.0, 0.0))
    motion = {"rigid": rigid, "velocity": (3.0, 4.0, 5.0), "spin": schema.Spin(centre=(0, 0, 0), rate=(0, 0, 2e3))}
    case = rigid_case([motion], contact=None, end=1e-4).model_copy(update={"probes": tuple(probes)})
    sim = Seen(case, [TILTED], 0).sim
    found, nodes = sim.probes.measure(), sim.model.nodes
    v = np.array([3.0 - 2e3 * 3e-3, 4.0 + 2e3 * 2e-3, 5.0])
    energy = 0.25 * float((v * v).sum()) + 0.5 * 2.5e-6 * 4e6
    assert found[:6] == pytest.approx([energy, 0.5 * v[1], 4e-3, v[0], 0.5, 0.5], rel=1e-12)
    assert found[6] == pytest.approx(0.5 * (nodes.mass[:, None] * nodes.v * nodes.v).sum(), rel=1e-12)
    assert found[6] != pytest.approx(energy, rel=0.1)


@pytest.mark.parametrize("walls", [True, False])
def test_a_resumed_run_ends_with_the_same_bits(tmp_path: Path, *, walls: bool) -> None:
    """The checkpoint is written in the middle of an impact, on two ranks. Without walls an array of their impulses has
    no values, but three dimensions."""
    boundaries = tuple(each for each in SCENE.boundaries if walls or each.kind != "wall")
    scene = SCENE.model_copy(update={"boundaries": boundaries})

    def halves(sim: Simulation) -> tuple[str | None, list[list[float]]]:
        stepped(sim, 70)
        resumed = kept_again(sim, scene, tmp_path)
        for _ in range(50):
            tick(resumed)
        return state_of(resumed)

    assert on(2, scene, MESHES, halves)[0] == on(1, scene, MESHES, stepped)[0]


def test_a_spin_that_contact_changes_is_the_limit_of_the_step() -> None:
    """The limit of the time step by a rigid body follows the spin of the body. A contact changes the spin after the
    step was chosen, so the limit of the step is neither the present limit of the body nor that of a tet."""
    spinning = {
        "rigid": RIGID,
        "spin": schema.Spin(centre=(3e-3, 3e-3, 4e-3), rate=(0.0, 9e4, 0.0)),
        "velocity": (0, 0, -900),
    }
    sim = build(rigid_case([spinning], (GROUND,)), [TILTED])
    step.prepare(sim)
    assert sim.rigid is not None
    limits = []
    for _ in range(60):
        before = sim.rigid.limit
        step.first_half(sim)
        assert sim.limiter() in ("rigid parts: spin, or no other limit", "contact: speed of approach")
        limits.append((before, sim.rigid.limit))
        step.second_half(sim)
    assert any(first != then for first, then in limits)
