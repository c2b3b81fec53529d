"""Walls, planes of symmetry, prescribed motions, gravity and tractions: the effect on velocities, and the booking of
the work."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.cases.model import materials, schema
from conoid.worker import simulation, step
from conoid.worker.boundaries.drivers import Traction
from conoid.worker.boundaries.walls import RigidWalls
from conoid.worker.errors import InputError
from conoid.worker.mesh.faces import boundary_faces
from conoid.worker.model.loads import Load
from conoid.worker.model.rows import PRESSURE, S_ZZ, WORK
from conoid.worker.model.state import Flags
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.scene import domain
from conoid.worker.simulation import Simulation

from ..contact.bodies import meeting_of, moved
from .kernels import COPPER, FORMS, STEEL, Form, Watch, around, build, run, scene, whole_of
from .meshes import Floats, block
from .simulations import on, tick

MESH = block((3, 3, 3), 1e-3, seed=2)
TILTED = (1.0, -2.0, 3.0)
BAR = materials.Material(density=7850.0, elastic=materials.Elastic(young=200e9, poisson=0.0))
FALL = (2e6, -1e6, -3e7)
GRAVITY: dict[str, Any] = {"kind": "gravity", "acceleration": FALL}


def with_boundary(spec: dict[str, Any], end: float = 1e-6, **keys: Any) -> Simulation:
    return build(scene(keys.pop("material", STEEL), end=end, boundaries=(spec,), **keys), [MESH])


def wall(gap: float, normal: tuple[float, float, float] = TILTED) -> dict[str, Any]:
    """Returns a wall normal to ``normal`` at a distance of ``gap`` from the first node of the body."""
    n = np.array(normal) / np.linalg.norm(normal)
    first = (MESH.points @ n).min()
    return {"kind": "wall", "point": tuple((n * (first - gap)).tolist()), "normal": normal}


def heights(sim: Simulation, gap: float) -> Floats:
    """Returns (nodes,) distances from the tilted wall, m."""
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    return np.asarray(sim.model.nodes.x @ n - (MESH.points @ n).min() + gap)


@pytest.mark.parametrize("form", FORMS)
def test_a_quarter_between_planes_of_symmetry_is_a_quarter_of_the_whole(form: Form) -> None:
    """All terms of the energy balance agree up to rounding. The cubes are cut into five tets, and neighbouring cubes
    are mirror images."""
    cube = {"shape": "box", "high": [2e-3] * 3, "element_size": 1e-3, "generator": "structured", "split": 5}
    data = {
        "name": "cube", "numerics": {"pressure": form}, "run": {"end_time": 2e-6, "frames": 0},
        "materials": {"stone": {"density": 2000, "elastic": {"young": 20e9, "poisson": 0.25}}},
    }  # fmt: skip
    part = {"name": "cube", "material": "stone", "stretch": {"rate": [1e4, -2e4, 9e3]}}

    def lines(low: list[float], *boundaries: dict[str, Any]) -> Floats:
        case = parse_case({**data, "parts": [{**part, "mesh": {**cube, "low": low}}], "boundaries": boundaries})
        seen = []

        def watch(sim: Simulation, before: Floats) -> None:
            energy = sim.ledger.close(before)
            seen.append((energy.kinetic, energy.elastic, energy.viscous, energy.averaging))

        run(simulation.build(case, Path(), SerialComm()), watch)
        return np.array(seen)

    whole = lines([-2e-3, -2e-3, 0.0])
    quarter = lines([0.0] * 3, *({"kind": "symmetry", "axis": axis} for axis in "xy"))
    assert 4.0 * quarter == pytest.approx(whole, rel=1e-8, abs=1e-9 * whole.max())
    assert form == "standard" or whole[:, 3].max() > 1e-3 * whole.max()


@pytest.mark.parametrize("gap", [0.0, 3e-5])
def test_no_node_ends_behind_the_wall(gap: float) -> None:
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    sim = with_boundary(wall(gap), end=2e-6, velocity=tuple((-150.0 * n).tolist()), material=COPPER)
    lowest: list[float] = []
    run(sim, lambda sim, _: lowest.append(float(heights(sim, gap).min())))
    assert min(lowest) > -1e-15
    assert min(lowest) < 1e-9


@pytest.mark.parametrize("gap", [1e-5, 0.0])
@pytest.mark.parametrize("name", ["floor", None])
def test_the_force_of_walls_is_what_changes_the_momentum(name: str | None, gap: float) -> None:
    """The force of one of two walls, or of both walls, times time, summed over all lines of the history, is the change
    of momentum. The bodies touch the walls at the start or touch them later."""
    walls = [
        {**wall(gap), "name": "floor"},
        {"kind": "wall", "name": "x", "point": (-gap, 0, 0), "normal": (1, 0, 0)},
    ]
    probes = tuple({"name": a, "part": "body", "field": f"wall_force_{a}", "wall": name} for a in "xyz")
    sim = build(scene(STEEL, end=1e-6, velocity=(-60.0, 90.0, -150.0), boundaries=tuple(walls), probes=probes), [MESH])
    given, change, last, nodes = np.zeros(3), np.zeros(3), 0.0, sim.model.nodes
    start = (nodes.mass[:, None] * nodes.v).sum(axis=0)

    def look(sim: Simulation, _: Floats) -> None:
        nonlocal last
        if sim.clock.step % 7 == 0 or sim.clock.done:
            given[:] += sim.probes.measure() * (sim.clock.t - last)
            change[:] = (nodes.mass[:, None] * nodes.v).sum(axis=0) - start
            last = sim.clock.t

    run(sim, look)
    if name is None:
        assert given == pytest.approx(change, rel=1e-9)
    else:
        across = np.cross(given, np.array(TILTED))
        assert np.abs(across).max() < 1e-9 * np.linalg.norm(given)
        assert 0.0 < np.linalg.norm(given) < 0.999 * np.linalg.norm(change)


def test_the_wall_pushes_only() -> None:
    """Each impulse of the wall acts along the normal and away from the wall. Where no node would pass the wall, all
    velocities are unchanged to the bit."""
    n = np.array(TILTED) / np.linalg.norm(TILTED)
    sim = with_boundary(wall(1e-5), velocity=tuple((-100.0 * n).tolist()))
    pushes = []

    def look(before: Floats, after: Floats) -> None:
        along = (after - before) @ n
        assert np.abs(after - before - along[:, None] * n).max() < 1e-12
        assert (along >= 0.0).all()
        assert not along[heights(sim, 1e-5) + sim.clock.dt * (before @ n) >= 0.0].any()
        pushes.append((along > 0.0).sum())

    around(sim.boundaries[0], look)
    run(sim)
    assert sum(pushes) > 20


def test_impulses_of_the_wall_are_booked() -> None:
    """In this test a cube hits a wall. The booked work is the impulse times the mean velocity, summed over steps and
    nodes; for the last impulse only the half with the velocity before the impulse is booked.
    """
    sim = with_boundary(wall(2e-6, (0.0, 0.0, 1.0)), end=3e-7, velocity=(0.0, 0.0, -100.0))
    impulses: list[Floats] = []
    lost: list[float] = []
    mass = sim.model.nodes.mass[:, None]
    around(sim.boundaries[0], lambda before, after: impulses.append(mass * (after - before)))

    def look(sim: Simulation, before: Floats) -> None:
        after = 0.0 if sim.clock.done else sim.model.nodes.v
        lost.append(-float((0.5 * impulses[-1] * (before + after)).sum()))

    run(sim, look)
    assert sum(lost) > 0.0
    assert math.isclose(float(sim.boundaries[0].contact_loss.sum()), sum(lost), rel_tol=1e-12)
    assert 1e-8 < sim.boundaries[0].last_push <= 3e-7


def test_a_body_at_rest_on_a_wall_stays_there() -> None:
    sim = with_boundary(wall(0.0, (0.0, 0.0, 1.0)))
    run(sim)
    assert not sim.model.nodes.v.any()
    assert (sim.model.nodes.x == MESH.points).all()
    assert sim.boundaries[0].contact_loss.sum() == 0.0


def test_a_body_that_is_pressed_on_a_wall_is_at_rest_there_at_the_end() -> None:
    """The last velocities of a run include the impulses of the wall, as the velocities at all earlier times do."""
    floor, load = wall(0.0, (0.0, 0.0, 1.0)), {**PULL, "stress": (0.0, 0.0, -1e8), **TOP}
    sim = build(scene(STEEL, end=2e-6, boundaries=(floor, load)), [MESH])
    run(sim)
    v = sim.model.nodes.v[:, 2]
    assert np.abs(v).max() > 0.1
    assert np.abs(v[MESH.points[:, 2] == 0.0]).max() < 1e-9


@pytest.mark.parametrize(("axis", "at"), [("x", 0.0), ("y", 3e-3), ("z", 0.0)])
def test_nodes_on_a_symmetry_plane_stay_on_it(axis: str, at: float) -> None:
    k = "xyz".index(axis)
    sim = with_boundary({"kind": "symmetry", "axis": axis, "at": at}, velocity=(30.0, -20.0, 10.0))
    sim.model.nodes.v += np.random.default_rng(3).normal(size=sim.model.nodes.v.shape)
    sim.boundaries[0].start(sim.model.nodes)
    on = np.abs(MESH.points[:, k] - at) < 1e-12
    assert sim.boundaries[0].nodes.tolist() == np.flatnonzero(on).tolist()
    run(sim)
    assert (sim.model.nodes.x[on, k] == MESH.points[on, k]).all()
    assert np.abs(sim.model.nodes.x[on] - MESH.points[on]).max() > 1e-6
    assert sim.boundaries[0].contact_loss.sum() == sim.boundaries[0].external_work.sum() == 0.0


def test_a_body_through_a_symmetry_plane_is_refused() -> None:
    """The body of this case would overlap its own mirror image."""
    even = block((2, 2, 2), 1e-3)
    for at in (0.4e-3, 1.3e-3):
        message = (
            r"^boundaries\[0\]: tets of part 'body' reach 0\.000\d+ m through this plane of symmetry into their own"
        )
        with pytest.raises(InputError, match=message):
            build(scene(STEEL, boundaries=({"kind": "symmetry", "axis": "y", "at": at},)), [even])
    assert build(scene(STEEL, boundaries=({"kind": "symmetry", "axis": "y", "at": 0.0},)), [even]).warnings == ()


AROUND_Y, AROUND_Z = (
    {"centre": (0.0, 0.0, 0.0), "rate": rate} for rate in ((0.0, 1e3, 0.0), (0.0, 0.0, 1e3))
)  # fmt: skip


@pytest.mark.parametrize(
    "drive",
    [
        {"kind": "velocity", "x": 1.0, "z": 3.0},
        {"kind": "velocity", "z": 3.0, "course": ((0.0, 0.0), (1e-6, 1.0))},
        {"kind": "rotation", "spin": AROUND_Y},
        {"kind": "rotation", "spin": AROUND_Y, "course": ((0.0, 0.0), (1e-6, 1.0))},
        {"kind": "rotation", "spin": AROUND_Z, "velocity": (0.0, 0.0, 3.0)},
    ],
    ids=["at once", "later", "turning", "turning later", "with the axis"],
)
@pytest.mark.parametrize("rigid", [None, schema.Rigid()], ids=["deformable", "rigid"])
def test_motion_across_a_symmetry_plane_is_refused(drive: dict[str, Any], rigid: schema.Rigid | None) -> None:
    plane = {"kind": "symmetry", "axis": "z"}
    with pytest.raises(
        InputError, match=r"^boundaries\[1\]: moves nodes off their plane of symmetry, boundaries\[0\], along z"
    ):
        build(_as(rigid, scene(STEEL, boundaries=(plane, drive))), [MESH])
    for along in (
        {"kind": "velocity", "x": 1.0, "z": 0.0},
        {"kind": "rotation", "spin": AROUND_Z, "velocity": (1.0, 0.0, 0.0)},
    ):
        build(_as(rigid, scene(STEEL, boundaries=(plane, along))), [MESH])


def _as(rigid: schema.Rigid | None, case: schema.Case) -> schema.Case:
    return case.model_copy(update={"parts": (case.parts[0].model_copy(update={"rigid": rigid}),)})


def test_a_body_may_fly_at_a_symmetry_plane() -> None:
    """No node starts on the plane of symmetry, which gives a warning. Nodes that reach the plane of symmetry are
    reflected.
    """
    plane = {"kind": "symmetry", "axis": "z", "at": -1e-5}
    sim = with_boundary(plane, velocity=(0.0, 0.0, -100.0), end=1.5e-6)
    assert sim.warnings[-1] == (
        "boundaries[0]: no node starts on this plane of symmetry; it holds nodes that reach it later"
    )
    run(sim)
    assert sim.model.nodes.x[:, 2].min() >= -1e-5 - 1e-12
    assert np.average(sim.model.nodes.v[:, 2], weights=sim.model.nodes.mass) > 50.0


def test_motion_that_a_symmetry_plane_stops_at_the_start_is_reported() -> None:
    sim = with_boundary({"kind": "symmetry", "axis": "z"}, velocity=(5.0, 0.0, 30.0))
    warning = sim.warnings[-1]
    assert warning.startswith("boundaries[0]: nodes on this plane of symmetry start with up to 30 m/s across it")
    fine = with_boundary({"kind": "symmetry", "axis": "z"}, velocity=(5.0, 0.0, 0.0)).warnings
    assert not any("symmetry" in text for text in fine)


@pytest.mark.parametrize("order", [1, -1], ids=["plane first", "wall first"])
def test_a_wall_across_a_symmetry_plane_pushes_along_it(order: int) -> None:
    """Half a block falls on a wall whose normal is at 37 degrees to the plane of symmetry. The nodes of the half block
    stay on the plane and in front of the wall, and the energy balance closes. Without the plane of symmetry the wall of
    this test moves the nodes away from the position of the plane.
    """
    slope = math.radians(37.0)
    low = MESH.points.min(axis=0)
    tilted = {"kind": "wall", "point": tuple(low.tolist()), "normal": (math.sin(slope), 0.0, math.cos(slope))}
    bounds = ({"kind": "symmetry", "axis": "x", "at": 0.0}, tilted)[::order]
    sim = build(scene(STEEL, end=2e-6, velocity=(0.0, 0.0, -100.0), boundaries=bounds), [MESH])
    on, nodes = np.abs(MESH.points[:, 0]) < 1e-12, sim.model.nodes

    def look(sim: Simulation, before: Floats) -> None:
        assert not nodes.v[on, 0].any()
        sim.ledger.close(before)

    run(sim, look)
    assert (nodes.x[on, 0] == MESH.points[on, 0]).all()
    assert ((nodes.x - low) @ np.array(tilted["normal"])).min() > -1e-15
    (walls,) = (bound for bound in sim.boundaries if isinstance(bound, RigidWalls))
    assert walls.contact_loss[np.isin(walls.nodes, np.flatnonzero(on))].sum() > 0.0
    assert sim.ledger.worst < 2e-3


def test_a_wall_along_a_symmetry_plane_cannot_push_what_is_on_it() -> None:
    """The plane of symmetry holds the nodes on the plane. The velocities of the nodes along the plane agree to the bit
    with the velocities that the forces give."""
    bounds = ({"kind": "symmetry", "axis": "z", "at": 0.0}, wall(0.0, (0.0, 0.0, 1.0)))
    sims = [build(scene(STEEL, end=1e-6, velocity=(3.0, 0.0, 9.0), boundaries=bounds[:n]), [MESH]) for n in (1, 2)]
    for sim in sims:
        run(sim)
    assert (sims[0].model.nodes.v == sims[1].model.nodes.v).all()


def test_prescribed_velocity_and_its_work() -> None:
    """In this test one end of a block is pulled. Prescribed velocity components are equal to the given values to the
    bit, the other components are free, and the work is in the external energy."""
    spec = {"kind": "velocity", "low": (0.0, 0.0, 2.9e-3), "high": (1.0, 1.0, 1.0), "z": 20.0}
    sim = with_boundary(spec, end=1e-5)
    top = MESH.points[:, 2] > 2.9e-3
    assert sim.boundaries[0].nodes.tolist() == np.flatnonzero(top).tolist()
    run(sim)
    nodes = sim.model.nodes
    assert (nodes.v[top, 2] == 20.0).all()
    assert nodes.v[top, 0].any()
    assert np.abs(nodes.x[top, 2] - MESH.points[top, 2] - 20.0 * 1e-5).max() < 1e-16
    kinetic = 0.5 * float((nodes.mass[:, None] * nodes.v**2).sum())
    moved = kinetic + float(sim.model.blocks[0].row(WORK).sum()) - sim.ledger.initial
    assert float(sim.boundaries[0].external_work.sum()) == pytest.approx(moved, rel=0.06)


def test_prescribed_rotation_is_exact() -> None:
    """After any number of steps of any size each node is at the position of the prescribed rotation."""
    rate, centre = np.array([2e5, -1e5, 3e5]), np.array([1e-3, 0.0, 2e-3])
    spec = {"kind": "rotation", "spin": {"centre": tuple(centre.tolist()), "rate": tuple(rate.tolist())}}
    sim = with_boundary(spec, end=1e-4)
    run(sim)
    speed = float(np.linalg.norm(rate))
    axis, angle = rate / speed, speed * 1e-4
    r = MESH.points - centre
    turned = r * np.cos(angle) + np.cross(axis, r) * np.sin(angle) + axis * (r @ axis)[:, None] * (1.0 - np.cos(angle))
    assert sim.clock.step > 300
    assert np.abs(sim.model.nodes.x - centre - turned).max() < 1e-12 * 3e-3 * sim.clock.step


def test_the_last_boundary_has_the_last_word() -> None:
    """A node that has a prescribed motion and would be stopped by a wall follows the prescribed motion."""
    push = wall(0.0, (0.0, 0.0, 1.0))
    pull = {"kind": "velocity", "z": -5.0}
    sim = build(scene(STEEL, end=1e-7, boundaries=(pull, push)), [MESH])
    step.prepare(sim)
    step.first_half(sim)
    assert (sim.model.nodes.v[:, 2] == -5.0).all()


def uneven(watch: Watch) -> Watch:
    """Gives every step another fraction of the stable step."""
    random = np.random.default_rng(4)

    def look(sim: Simulation, before: Floats) -> None:
        watch(sim, before)
        sim.clock._safety = random.uniform(0.2, 0.9)

    return look


def test_free_fall_is_exact_at_every_time() -> None:
    """The positions x(n) and velocities v(n+1/2) of the centre of mass of an oscillating body are exact for steps of
    any size, and the momentum is booked.
    """
    sim = with_boundary(GRAVITY, velocity=(30.0, 0.0, -5.0), dt_growth=2.0)
    nodes, g, flight = sim.model.nodes, np.array(FALL), np.array([30.0, 0.0, -5.0])
    noise = np.random.default_rng(3).normal(size=nodes.v.shape) * 20.0
    nodes.v += noise - np.average(noise, axis=0, weights=nodes.mass)
    start, steps = np.average(nodes.x, axis=0, weights=nodes.mass), set()

    def look(sim: Simulation, before: Floats) -> None:
        t, dt = sim.clock.t, sim.clock.dt
        centre, v = (np.average(values, axis=0, weights=nodes.mass) for values in (nodes.x, nodes.v))
        assert np.abs(v - flight - g * (t + 0.5 * dt)).max() < 1e-12 * 40.0
        assert np.abs(centre - start - flight * t - 0.5 * g * t * t).max() < 1e-12 * 1e-3
        steps.add(dt)

    run(sim, uneven(look))
    assert len(steps) > 10
    assert np.linalg.norm(g) * sim.clock.t > 20.0


def test_gravity_follows_its_course() -> None:
    """A free body is accelerated by gravity that grows for 0.4 us: the velocities at n+1/2 are exactly the integral
    of gravity."""
    grown, g = 4e-7, np.array(FALL)
    sim = with_boundary({**GRAVITY, "course": ((0.0, 0.0), (grown, 1.0))}, dt_growth=2.0)

    def look(sim: Simulation, _: Floats) -> None:
        half = sim.clock.t + 0.5 * sim.clock.dt
        time = half - 0.5 * grown if half > grown else 0.5 * half**2 / grown
        assert np.abs(sim.model.nodes.v - g * time).max() < 1e-12 * np.linalg.norm(g) * 1e-6

    run(sim, uneven(look))
    assert sim.clock.t > 2.0 * grown
    assert sim.ledger.worst < 1e-12


def test_the_ledger_of_a_free_fall_closes_to_round_off() -> None:
    """The work of gravity is 1/2 m v(n-1/2) . v(n+1/2) for steps of any size. The product 1/2 m v(n-1/2) . v(n+1/2) is
    the kinetic energy of the energy balance.
    """
    sim = with_boundary(GRAVITY, dt_growth=2.0)
    energy = 0.5 * float(sim.model.nodes.mass.sum()) * float(np.dot(FALL, FALL))
    steps = set()

    def look(sim: Simulation, before: Floats) -> None:
        clock = sim.clock
        line = sim.ledger.close(before)
        expected = energy * (clock.t - 0.5 * clock.last_dt) * (clock.t + 0.5 * clock.dt)
        assert line.external == pytest.approx(expected, rel=1e-12, abs=1e-12 * energy * 1e-12)
        assert line.external == pytest.approx(line.kinetic, rel=1e-12)
        steps.add(clock.dt)

    run(sim, uneven(look))
    assert len(steps) > 10
    assert sim.ledger.worst < 1e-12


@pytest.mark.parametrize(
    ("hold", "rows", "axes"),
    [
        ({"kind": "symmetry", "axis": "z", "at": 0.0}, MESH.points[:, 2] == 0.0, [2]),
        ({"kind": "velocity", "low": (0.0, 0.0, 2.9e-3), "high": (1.0, 1.0, 1.0), "x": 1.0, "z": 7.0},
         MESH.points[:, 2] > 2.9e-3, [0, 2]),
    ],
    ids=["plane", "prescribed"],
)  # fmt: skip
def test_gravity_does_not_move_what_is_held(hold: dict[str, Any], rows: Flags, axes: list[int]) -> None:
    """The result does not depend on the order of the two boundaries in the case, and the energy balance closes with the
    work of both boundaries."""
    sim = build(scene(STEEL, end=5e-6, boundaries=(hold, GRAVITY)), [MESH])
    held = [hold.get("xyz"[axis], 0.0) for axis in axes]

    def look(sim: Simulation, before: Floats) -> None:
        assert (sim.model.nodes.v[rows][:, axes] == held).all()
        sim.ledger.close(before)

    run(sim, look)
    assert np.abs(sim.model.nodes.v[:, 1]).max() > 1.0
    assert sim.ledger.worst < 1e-3


PULL: dict[str, Any] = {"kind": "traction", "stress": (2e6, -1e6, 5e7)}
TOP: dict[str, Any] = {"low": (0.0, 0.0, 2.9e-3), "high": (1.0, 1.0, 1.0)}


def test_nodes_of_two_boxes_that_prescribe_one_component_in_two_ways_are_refused() -> None:
    upper, side = (
        {"kind": "velocity", "x": 1.0, "z": 7.0, **TOP},
        {"kind": "velocity", "y": 0.0, "z": 8.0, "low": (2.9e-3, 0.0, 0.0), "high": (1.0, 1.0, 1.0)},
    )
    message = r"boundaries\[1\]: drives nodes along z that boundaries\[0\] drives in another way; give"
    with pytest.raises(InputError, match=message):
        build(scene(STEEL, boundaries=(upper, side)), [MESH])


def test_nodes_of_two_boxes_may_move_alike_or_along_other_axes() -> None:
    upper = {"kind": "velocity", "x": 1.0, "z": 7.0, **TOP}
    others = [{"kind": "velocity", "z": 7.0}, {"kind": "velocity", "y": 1.0}]
    sim = build(scene(STEEL, boundaries=(upper, *others)), [MESH])
    assert (sim.model.nodes.v[:, 1:] == (1.0, 7.0)).all()


def pushed(sim: Simulation) -> Traction:
    (boundary,) = (b for b in sim.boundaries if isinstance(b, Traction))
    return boundary


def booked(sim: Simulation, before: Floats) -> None:
    sim.ledger.close(before)


def test_a_traction_loads_the_faces_in_its_box() -> None:
    """Each node gets a third of the force on each loaded face at the node: the sum is stress times area."""
    sim = with_boundary({**PULL, **TOP})
    load, top = pushed(sim), np.flatnonzero(MESH.points[:, 2] > 2.9e-3)
    assert load.nodes.tolist() == top.tolist()
    assert load.force.sum(axis=0) == pytest.approx(9e-6 * np.array(PULL["stress"]), rel=1e-13)
    shares = np.zeros(len(MESH.points))
    for face in boundary_faces(MESH.tets):
        if set(face) <= set(top.tolist()):
            (a, b), (c, d) = (MESH.points[face[k]][:2] - MESH.points[face[0]][:2] for k in (1, 2))
            shares[face] += abs(a * d - b * c) / 6.0
    assert load.force == pytest.approx(shares[top, None] * np.array(PULL["stress"]), rel=1e-12)


def test_a_traction_on_the_whole_surface_is_no_force_on_the_nodes_inside() -> None:
    load = pushed(with_boundary(PULL))
    inside = ((MESH.points > 1e-9) & (MESH.points < 3e-3 - 1e-9)).all(axis=1)
    assert load.nodes.tolist() == np.flatnonzero(~inside).tolist()
    assert load.force.sum(axis=0) == pytest.approx(54e-6 * np.array(PULL["stress"]), rel=1e-12)


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_every_rank_has_the_whole_load_of_its_nodes(ranks: int) -> None:
    whole = whole_of(MESH, scene(STEEL, boundaries=({**PULL, **TOP}, PULL)))
    assert len(whole.loads) == 2
    for piece in domain.cut(whole, ranks):
        for mine, load in zip(piece.loads, whole.loads, strict=True):
            assert isinstance(mine, Load)
            assert isinstance(load, Load)
            here = np.isin(load.nodes, piece.node_ids)
            assert (mine.nodes == load.nodes[here]).all()
            assert (mine.tets == load.tets[here]).all()
            assert (mine.force == load.force[here]).all()


def test_a_traction_without_a_face_is_refused() -> None:
    for box in ({"low": (0.0, 0.0, 1.4e-3), "high": (1.0, 1.0, 1.6e-3)}, {"parts": ("nobody",)}):
        with pytest.raises(InputError, match=r"^boundaries\[1\]: acts on no face; check its box and its parts$"):
            build(scene(STEEL, boundaries=(GRAVITY, {**PULL, **box})), [MESH])


@pytest.mark.parametrize("ranks", [1, 3])
def test_a_traction_leaves_with_the_tets_of_its_faces(ranks: int) -> None:
    """Nodes of removed tets get no force from the traction. With a remaining force the nodes of removed tets would be
    accelerated without limit, because their mass is tiny.
    """
    top = {frozenset(face.tolist()) for face in boundary_faces(MESH.tets) if (MESH.points[face][:, 2] > 2.9e-3).all()}
    loaded = {e: [c for c in top if c <= set(tet.tolist())] for e, tet in enumerate(MESH.tets)}
    gone = np.array([e for e, faces in loaded.items() if faces][::2])
    stay = [list(face) for e, faces in loaded.items() if e not in gone for face in faces]
    area = sum(float(np.linalg.norm(np.cross(*(MESH.points[f[1:]] - MESH.points[f[0]])))) / 2.0 for f in stay)
    assert 0.3 * 9e-6 < area < 0.7 * 9e-6

    def work(sim: Simulation) -> Floats:
        step.prepare(sim)
        tick(sim)
        assert tick(sim, gone) < 1e-3
        load = pushed(sim)
        return np.asarray(load.force[sim.model.nodes.owned[load.nodes]].sum(axis=0))

    erosion = schema.Erosion(plastic_strain=5.0)
    case = scene(COPPER, boundaries=({**PULL, **TOP},), erosion=erosion)
    force = np.sum(on(ranks, case, [MESH], work), axis=0)
    assert force == pytest.approx(area * np.array(PULL["stress"]), rel=1e-12)


def test_a_cylinder_and_a_box_have_what_is_in_both() -> None:
    """The selection contains the faces on top of the cube with all nodes within 1.5 mm of a line through a corner."""
    near = {"cylinder": {"base": (3e-3, 3e-3, 0.0), "radius": 1.5e-3}}
    load = pushed(with_boundary({**PULL, **TOP, **near}))
    x, y, z = MESH.points.T
    inside = (z > 2.9e-3) & (np.hypot(x - 3e-3, y - 3e-3) <= 1.5e-3)
    faces = [face for face in boundary_faces(MESH.tets) if inside[face].all()]
    assert load.nodes.tolist() == np.unique(faces).tolist()
    assert 0 < len(load.nodes) < 16
    with pytest.raises(InputError, match=r"acts on no face; check its cylinder, its box and its parts$"):
        build(scene(STEEL, boundaries=({**PULL, "cylinder": {"radius": 1e-6}},)), [MESH])


def test_a_free_body_under_traction_is_accelerated_exactly() -> None:
    """The positions x(n) and velocities v(n+1/2) of the centre of mass are exact for steps of any size, and the energy
    balance closes with the work of the traction.
    """
    sim = with_boundary({**PULL, **TOP}, end=3e-6, velocity=(3.0, 0.0, -5.0), dt_growth=2.0)
    nodes, flight = sim.model.nodes, np.array([3.0, 0.0, -5.0])
    a = 9e-6 * np.array(PULL["stress"]) / (7850.0 * 27e-9)
    start, steps = np.average(nodes.x, axis=0, weights=nodes.mass), set()

    def look(sim: Simulation, before: Floats) -> None:
        t, dt = sim.clock.t, sim.clock.dt
        centre, v = (np.average(values, axis=0, weights=nodes.mass) for values in (nodes.x, nodes.v))
        assert v == pytest.approx(flight + a * (t + 0.5 * dt), rel=1e-10, abs=1e-10)
        assert np.abs(centre - start - flight * t - 0.5 * a * t * t).max() < 1e-12 * 1e-3
        sim.ledger.close(before)
        steps.add(dt)

    run(sim, uneven(look))
    assert len(steps) > 10
    assert np.linalg.norm(a) * sim.clock.t > 5.0
    assert sim.ledger.worst < 1e-3


RAMP = ((1e-6, 0.0), (2e-6, 1.0), (3e-6, -0.5))


def ramped(t: float) -> tuple[float, float]:
    """Returns the factor of RAMP and its integral from 0 on, piece by piece."""
    if t <= 1e-6:
        return 0.0, 0.0
    if t <= 2e-6:
        return (t - 1e-6) / 1e-6, 0.5 * (t - 1e-6) ** 2 / 1e-6
    if t > 3e-6:
        return -0.5, ramped(3e-6)[1] - 0.5 * (t - 3e-6)
    return 1.0 - 1.5 * (t - 2e-6) / 1e-6, 0.5e-6 + (t - 2e-6) - 0.75 * (t - 2e-6) ** 2 / 1e-6


@pytest.mark.parametrize("steps", ["even", "uneven"])
def test_a_velocity_over_time_leads_nodes_along_its_integral(steps: str) -> None:
    """The positions at every time level n are exact for steps of any size, and the energy balance closes except for the
    energy of unequal steps.
    """
    spec = {"kind": "velocity", "low": (0.0, 0.0, 2.9e-3), "high": (1.0, 1.0, 1.0), "z": 7.0, "course": RAMP}
    sim = build(scene(STEEL, end=3e-6, boundaries=(spec,), dt_growth=2.0), [MESH])
    nodes, rows = sim.model.nodes, MESH.points[:, 2] > 2.9e-3
    assert (nodes.v[rows, 2] == 0.0).all()

    def look(sim: Simulation, before: Floats) -> None:
        moved = nodes.x[rows, 2] - MESH.points[rows, 2]
        assert np.abs(moved - 7.0 * ramped(sim.clock.t)[1]).max() < 1e-17
        sim.ledger.close(before)

    run(sim, uneven(look) if steps == "uneven" else look)
    assert sim.ledger.worst < (1e-3 if steps == "even" else 5e-3)


def test_a_traction_over_time_gives_its_integral_as_impulse() -> None:
    """The momentum at n+1/2 is the force times the integral of its factor over time, for steps of any size."""
    sim = with_boundary({**PULL, **TOP, "course": RAMP}, end=3e-6, dt_growth=2.0)
    nodes, force = sim.model.nodes, 9e-6 * np.array(PULL["stress"])

    def look(sim: Simulation, _: Floats) -> None:
        momentum = (nodes.mass[:, None] * nodes.v).sum(axis=0)
        expected = force * ramped(sim.clock.t + 0.5 * sim.clock.dt)[1]
        assert np.abs(momentum - expected).max() < 1e-10 * np.linalg.norm(force) * 1e-6

    run(sim, uneven(look))


def test_a_pressure_pushes_against_the_faces() -> None:
    """The sum of the forces on the whole surface is zero, and each node gets a third of the force on each of its faces,
    against the normals of the faces."""
    assert np.abs(pushed(with_boundary({"kind": "traction", "pressure": 1e8})).force.sum(axis=0)).max() < 1e-8
    load = pushed(with_boundary({"kind": "traction", "pressure": 1e8, **TOP}))
    assert load.force.sum(axis=0) == pytest.approx([0.0, 0.0, -900.0], abs=1e-9)


def pulled(length: float, end: float, **keys: Any) -> Simulation:
    """Returns a bar of 2 x 2 mm and ``length`` m that begins at a symmetry plane and is pulled at its free end by
    100 MPa."""
    load = {"kind": "traction", "stress": (0.0, 0.0, 1e8), "low": (0.0, 0.0, length), "high": (1.0, 1.0, length)}
    planes = ({"kind": "symmetry", "axis": axis} for axis in "xyz")
    mesh = block((2, 2, round(length / 1e-3)), 1e-3, shake=0.0)
    return build(scene(BAR, end=end, boundaries=(load, *planes), **keys), [mesh])


def test_a_bar_carries_the_traction_at_its_end() -> None:
    """The bar is damped until it is at rest: at rest the stress in every tet is equal to the traction."""
    sim = pulled(4e-3, 1e-4, viscosity={"linear": 1.0})
    run(sim)
    stress = sim.model.blocks[0].row(S_ZZ) - sim.model.blocks[0].row(PRESSURE)
    assert stress == pytest.approx(1e8, rel=1e-3)


def test_a_traction_does_the_work_of_the_wave_that_it_sends() -> None:
    """Until the reflected wave arrives, the end moves at stress / (rho c): the booked work is force times this
    distance."""
    sim = pulled(16e-3, 5e-6)
    run(sim, booked)
    speed = 1e8 / math.sqrt(200e9 * 7850.0)
    external = float(sim.boundaries[0].external_work.sum())
    assert external == pytest.approx(1e8 * 4e-6 * speed * 5e-6, rel=0.01)
    assert sim.ledger.worst < 1e-3


def test_a_traction_does_not_move_what_is_held() -> None:
    hold = {"kind": "velocity", "z": 7.0, **TOP}
    sim = build(scene(STEEL, end=1e-6, boundaries=(hold, {**PULL, **TOP})), [MESH])
    run(sim, booked)
    top = MESH.points[:, 2] > 2.9e-3
    assert (sim.model.nodes.v[top, 2] == 7.0).all()
    assert sim.ledger.worst < 1e-3


def test_gravity_acts_on_its_parts_only() -> None:
    boundaries = ({**GRAVITY, "parts": ("body1",)},)
    sim = build(meeting_of([{}, {}], end=1e-7, boundaries=boundaries), [MESH, moved(MESH, (0.0, 0.0, 5e-3))])
    run(sim)
    nodes = sim.model.nodes
    assert not nodes.v[nodes.part == 0].any()
    assert nodes.v[nodes.part == 1] == pytest.approx(np.tile(np.array(FALL) * 1e-7, (len(MESH.points), 1)), rel=1e-9)


def test_a_body_on_a_wall_carries_its_weight() -> None:
    """The block is damped until it is at rest: at rest the stress in the middle of each layer of tets is the weight
    above this layer per area."""
    down = {"kind": "gravity", "acceleration": (0.0, 0.0, -1e6)}
    boundaries = (
        wall(0.0, (0.0, 0.0, 1.0)),
        down,
        {"kind": "symmetry", "axis": "x"},
        {"kind": "symmetry", "axis": "y"},
    )
    mesh = block((2, 2, 4), 1e-3, shake=0.0)
    sim = build(scene(BAR, end=1e-4, boundaries=boundaries, viscosity={"linear": 1.0}), [mesh])
    run(sim)
    centre = sim.model.nodes.x0[sim.model.blocks[0].tets, 2].mean(axis=1)
    weight = 7850.0 * 1e6 * (4e-3 - centre)
    stress = sim.model.blocks[0].row(S_ZZ) - sim.model.blocks[0].row(PRESSURE)
    for layer in range(4):
        inside = (centre > layer * 1e-3) & (centre < (layer + 1) * 1e-3)
        assert stress[inside].mean() == pytest.approx(-weight[inside].mean(), rel=1e-3)
