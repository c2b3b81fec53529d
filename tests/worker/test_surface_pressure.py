"""Pressure that follows the surface: forces, work and moments are compared with plain numpy, and a ring is compared
with its equilibrium."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model import materials, schema
from conoid.worker import step
from conoid.worker.boundaries.surface_pressure import SurfacePressure
from conoid.worker.mesh.faces import boundary_faces
from conoid.worker.model.rows import MASS, PRESSURE, S_XX, S_XY, S_YY
from conoid.worker.model.state import WIDE, Ints
from conoid.worker.simulation import Simulation

from .kernels import COPPER, STEEL, Floats, build, run, scene
from .meshes import block, ring
from .simulations import kept_again, on, tick

MESH = block((3, 3, 3), 1e-3, seed=2)
GAS: dict[str, Any] = {"kind": "traction", "pressure": 2e8, "follows": True}
TOP = {"low": (-1.0, -1.0, 2.9e-3), "high": (1.0, 1.0, 1.0)}
STONE = materials.Material(
    density=2700.0, elastic=materials.Elastic(young=60e9, poisson=0.25),
    brittle=materials.Brittle(strength=1e12, energy=1e3),
)  # fmt: skip
RUBBER = materials.Material(density=1100.0, elastic=materials.Elastic(young=30e6, poisson=0.3))


def pressed(sim: Simulation) -> SurfacePressure:
    (found,) = (bound for bound in sim.boundaries if isinstance(bound, SurfacePressure))
    return found


def expected(x: Floats, faces: "np.ndarray", pressure: float) -> Floats:
    """Returns (nodes, 3) the sum of a third of the force of each face over the faces of each node."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    force = np.zeros_like(x)
    for k in range(3):
        np.add.at(force, faces[:, k], -pressure / 6.0 * np.cross(b - a, c - a))
    return force


def moments(x: Floats, v: Floats, mass: Floats) -> tuple[Floats, Floats]:
    momentum = mass[:, None] * v
    return momentum.sum(axis=0), np.cross(x, momentum).sum(axis=0)


@pytest.mark.parametrize("ranks", [1, 2, 5])
def test_the_force_is_that_of_the_present_area_against_the_present_normal(ranks: int) -> None:
    """The block is stretched and turned; every rank has the whole force on its nodes, to the bit."""
    random = np.random.default_rng(5)
    change = random.normal(size=(3, 3)) + 2.0 * np.eye(3)
    faces = boundary_faces(MESH.tets)
    top = faces[(MESH.points[faces][:, :, 2] > 2.9e-3).all(axis=1)]

    def work(sim: Simulation) -> tuple[Ints, Floats, bytes]:
        nodes, load = sim.model.nodes, pressed(sim)
        nodes.x[:] = nodes.x0 @ change
        ids = nodes.id[load.nodes]
        whole = expected(MESH.points @ change, top, GAS["pressure"])
        full = np.zeros((len(MESH.points), 3))
        full[ids] = load.force
        sim.free()
        return ids, full - whole * np.isin(np.arange(len(full)), ids)[:, None], full.tobytes()

    found = on(ranks, scene(STEEL, boundaries=({**GAS, **TOP},)), [MESH], work)
    largest = float(np.abs(expected(MESH.points @ change, top, GAS["pressure"])).max())
    for _, off, _ in found:
        assert np.abs(off).max() < 1e-11 * largest
    everywhere = set(np.concatenate([ids for ids, *_ in found]).tolist())
    assert everywhere == set(np.unique(top).tolist())


def test_a_closed_surface_has_no_force_and_no_moment() -> None:
    """A box turns by two radians while a rising pressure acts on its whole surface; the energy balance closes."""
    spin = {"rate": (1e4, -1.3e4, 3e4), "centre": (1.5e-3, 1.5e-3, 1.5e-3)}
    gas = {**GAS, "course": ((0.0, 0.0), (1e-5, 1.0))}
    sim = build(scene(STEEL, end=6e-5, boundaries=(gas,), spin=spin, velocity=(50.0, 20.0, -70.0)), [MESH])
    nodes = sim.model.nodes
    start = moments(nodes.x, nodes.v, nodes.mass)
    turning = np.linalg.norm(start[1] - np.cross(nodes.mass @ nodes.x, start[0]) / nodes.mass.sum())
    worst = [0.0, 0.0]

    def look(sim: Simulation, before: Floats) -> None:
        now = moments(nodes.x, 0.5 * (before + nodes.v), nodes.mass)
        sim.ledger.close(before)
        worst[0] = max(worst[0], float(np.linalg.norm(now[0] - start[0])))
        worst[1] = max(worst[1], float(np.linalg.norm(now[1] - start[1])))

    run(sim, look)
    assert math.hypot(1e4, 1.3e4, 3e4) * sim.clock.t > 2.0
    impulse = GAS["pressure"] * 9e-6 * sim.clock.t
    assert worst[0] < 1e-12 * impulse
    assert worst[1] < 1e-11 * turning
    assert abs(pressed(sim).external_work.sum()) > 1e-3 * sim.ledger.initial
    assert sim.ledger.worst < 1e-5


def test_a_pressure_on_one_face_turns_with_the_body() -> None:
    """The change of momentum is the integral of -p A n(t), with the normal n of the turning face."""
    spin = {"rate": (0.0, 6e4, 0.0), "centre": (1.5e-3, 1.5e-3, 1.5e-3)}
    small = {**GAS, **TOP, "pressure": 1e5}
    sim = build(scene(STEEL, end=3e-5, boundaries=(small,), spin=spin), [MESH])
    nodes, impulse = sim.model.nodes, np.zeros(3)
    faces = boundary_faces(MESH.tets)
    top = faces[(MESH.points[faces][:, :, 2] > 2.9e-3).all(axis=1)]

    def look(sim: Simulation, before: Floats) -> None:
        nonlocal impulse
        impulse = impulse + sim.clock.mean_dt * expected(nodes.x, top, 1e5).sum(axis=0)
        momentum, _ = moments(nodes.x, nodes.v, nodes.mass)
        assert np.abs(momentum - impulse).max() < 1e-9 * 1e5 * 9e-6 * 3e-5
        sim.ledger.close(before)

    run(sim, look)
    angle = 6e4 * sim.clock.t
    ideal = -1e5 * 9e-6 / 6e4 * np.array([1.0 - math.cos(angle), 0.0, math.sin(angle)])
    assert impulse == pytest.approx(ideal, abs=0.05 * float(np.abs(ideal).max()))  # no principal axis
    assert sim.ledger.worst < 1e-5


def test_a_ring_carries_the_pressure_on_its_present_radius() -> None:
    """The ring is damped until it is at rest, stretched by a fifth. Hoop stress times thickness is pressure times
    present inner radius, by equilibrium for any material, and the work of the pressure is the integral of p over the
    swept volume.
    """
    inner, outer, width, pressure, end = 10e-3, 11e-3, 1e-3, 0.4e6, 4e-3
    bore = {"cylinder": {"axis": "z", "radius": inner}}
    gas = {**GAS, **bore, "pressure": pressure, "course": ((0.0, 0.0), (0.6 * end, 1.0))}
    planes = [{"kind": "symmetry", "axis": axis} for axis in "xyz"] + [{"kind": "symmetry", "axis": "z", "at": width}]
    case = scene(RUBBER, end=end, boundaries=(gas, *planes), viscosity={"linear": 1.0})
    sim = build(case, [ring(2, 24, inner, outer, width)])
    nodes = sim.model.nodes
    course: list[tuple[float, float, float]] = []

    def look(sim: Simulation, before: Floats) -> None:
        at = nodes.x[np.isclose(np.hypot(*nodes.x0[:, :2].T), inner)]
        angles = np.argsort(np.arctan2(at[:, 1], at[:, 0]))
        a, b = at[angles][:-1], at[angles][1:]
        area = 0.5 * float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
        course.append((pressure * min(sim.clock.t / (0.6 * end), 1.0), area, sim.ledger.close(before).external))

    run(sim, look)
    radius = np.hypot(*nodes.x[:, :2].T)
    r0 = np.hypot(*nodes.x0[:, :2].T)
    a, b = (float(radius[np.isclose(r0, each)].mean()) for each in (inner, outer))
    assert 1.15 * inner < a < 1.3 * inner
    tets = sim.model.blocks[0]
    centre = nodes.x[tets.tets].mean(axis=1)
    xx, yy, xy = (tets.row(row) for row in (S_XX, S_YY, S_XY))
    x, y = (centre[:, :2] / np.hypot(*centre[:, :2].T)[:, None]).T
    hoop = xx * y * y + yy * x * x - 2.0 * xy * x * y - tets.row(PRESSURE)
    mean = float((hoop * tets.row(MASS)).sum() / tets.row(MASS).sum())
    assert mean * (b - a) == pytest.approx(pressure * a, rel=0.02)
    p, area, external = np.array(course).T
    swept = width * float((0.5 * (p[1:] + p[:-1]) * np.diff(area)).sum())
    assert external[-1] == pytest.approx(swept, rel=1e-3)
    assert sim.ledger.worst < 1e-5


@pytest.mark.parametrize("ranks", [1, 3])
def test_eroded_faces_have_no_load_also_after_a_checkpoint(ranks: int, tmp_path: Path) -> None:
    faces = boundary_faces(MESH.tets)
    whole = {frozenset(face.tolist()) for face in faces}
    owner = {face: e for e, tet in enumerate(MESH.tets.tolist()) for face in whole if face <= set(tet)}
    gone = np.unique(list(owner.values()))[::3]
    stay = np.array([face for face in faces if owner[frozenset(face.tolist())] not in gone])
    case = scene(COPPER, boundaries=(GAS,), erosion=schema.Erosion(plastic_strain=5.0), end=1e-6)

    def work(sim: Simulation) -> tuple[Floats, bytes]:
        step.prepare(sim)
        tick(sim)
        tick(sim, gone)
        go_on = kept_again(sim, case, tmp_path / f"{ranks}")
        for _ in range(5):
            tick(go_on)
        nodes, load = go_on.model.nodes, pressed(go_on)
        full = np.zeros((2, len(MESH.points), 3))
        full[0, nodes.id] = nodes.x
        full[1, nodes.id[load.nodes]] = load.force
        full[:, nodes.id[~nodes.owned]] = 0.0
        go_on.free()
        return full, full.tobytes()

    x, force = np.sum([full for full, _ in on(ranks, case, [MESH], work)], axis=0)
    right = expected(x, stay, GAS["pressure"])
    assert np.abs(force - right).max() < 1e-11 * np.abs(right).max()


def test_a_tet_that_has_come_off_alone_has_no_load() -> None:
    case = scene(STONE, boundaries=(GAS,), contact=schema.Contact())
    part = case.parts[0].model_copy(update={"fracture": schema.Fracture()})
    sim = build(case.model_copy(update={"parts": (part,)}), [MESH])
    step.prepare(sim)
    load, (body,) = pressed(sim), sim.model.blocks
    many = len(load._faces.tets)
    body.bond[: body.n // 2][body.across[: body.n // 2] >= 0] = WIDE
    tick(sim)
    left = set(body.id[body.n // 2 :].tolist())
    assert set(load._faces.tets.tolist()) <= left
    assert 0 < len(load._faces.tets) < many


def test_a_stress_that_follows_is_refused() -> None:
    data = {
        "name": "x", "run": {"end_time": 1e-6},
        "parts": [{"name": "bar", "material": "copper", "mesh": {
            "shape": "box", "low": [0, 0, 0], "high": [1, 1, 1], "element_size": 0.5}}],
        "boundaries": [{"kind": "traction", "stress": [1e6, 0, 0], "follows": True}],
    }  # fmt: skip
    with pytest.raises(CaseError, match=r"boundaries\[0\].follows.*needs pressure"):
        parse_case(data)
