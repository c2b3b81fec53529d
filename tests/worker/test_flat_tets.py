"""Flat tets with averaged pressures have the stiffness of the standard form, and other tets are not affected."""

from functools import cache

import numpy as np
import pytest

from conoid.worker import step
from conoid.worker.accounts import digest
from conoid.worker.elements import rest
from conoid.worker.elements.flat import THINNEST, flat_tets
from conoid.worker.gauges.fields import tet_volumes
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model import rows
from conoid.worker.simulation import Simulation

from .brittle import brittle, stretched
from .kernels import COPPER, COPPER_GAS, Form, Patch, build, run, scene
from .meshes import Floats, block
from .simulations import on

MM = 1e-3
AVERAGED: tuple[Form, ...] = ("nodal", "split")
WALL = {"kind": "wall", "point": (0.0, 0.0, 0.0), "normal": (0.0, 0.0, 1.0)}


def flattened(cells: tuple[int, int, int], aspect: float, seed: int = 1) -> tuple[TetMesh, int]:
    """Returns a block with cubes of 1 mm in which one node was moved close to the opposite face of a tet, and this
    flat tet."""
    mesh = block(cells, MM, seed=seed)
    inside = ((mesh.points > 0.3 * MM) & (mesh.points < np.array(cells) * MM - 0.3 * MM)).all(axis=1)
    for node in np.random.default_rng(seed).permutation(np.flatnonzero(inside)):
        star = np.flatnonzero((mesh.tets == node).any(axis=1))
        for tet in star:
            points = mesh.points.copy()
            a, b, c = points[mesh.tets[tet][mesh.tets[tet] != node]]
            normal = np.cross(b - a, c - a)
            twice = np.linalg.norm(normal)
            height = (points[node] - a) @ normal / twice
            altitude = np.sign(height) * aspect * np.sqrt(twice / 2.0)
            points[node] += (altitude - height) * normal / twice
            if np.sort(tet_volumes(mesh.tets[star].astype(np.uint32), points))[1] > 0.02 * MM**3:
                return TetMesh(points, mesh.tets), int(tet)
    raise AssertionError("no node can come down")


@cache
def lowest(form: Form, aspect: float, speed: float, seed: int) -> tuple[float, float]:
    """Returns the smallest volume over the initial volume of the flat tet of a copper block that hits a wall, and the
    worst residual."""
    mesh, flat = flattened((4, 4, 4), aspect, seed)
    sim = build(scene(COPPER, form, end=2e-6, velocity=(0.0, 0.0, -speed), boundaries=(WALL,)), [mesh])
    (body,), least = sim.model.blocks, [1.0]
    corners = body.tets[body.id == flat]
    start = tet_volumes(corners, mesh.points)[0]

    def look(sim: Simulation, before: Floats) -> None:
        least.append(float(tet_volumes(corners, sim.model.nodes.x)[0] / start))
        if sim.clock.step % 50 == 0:
            sim.ledger.close(before)

    run(sim, look)
    return min(least), sim.ledger.worst


@pytest.mark.parametrize("form", AVERAGED)
@pytest.mark.parametrize(("aspect", "seed"), [(3e-3, 1), (3e-3, 2), (1e-2, 3)])
def test_a_flat_tet_is_not_crushed(form: Form, aspect: float, seed: int) -> None:
    """The flat tet loses no more volume than in the standard form. With the mean pressure over its nodes the flat tet
    was crushed in each scene of this test.
    """
    volume, residual = lowest(form, aspect, 200.0, seed)
    assert volume > lowest("standard", aspect, 200.0, seed)[0] - 0.02
    assert residual < 1e-4


@pytest.mark.parametrize("form", AVERAGED)
def test_a_flat_tet_dilates_as_in_the_standard_form(form: Form) -> None:
    """The flat tet is sheared under pressure; the nodes of the tet get no part of its dilation."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.7, 0.0], [0.3, 0.3, 0.01]])
    mesh = TetMesh(MM * corners, np.array([[0, 1, 2, 3]], np.int32))
    found = []
    for each in (form, "standard"):
        tet = Patch(mesh, brittle(1e7, 0.7, dilation_angle=0.5), each)
        tet.put(rows.PRESSURE, 1e8)
        pressures = []
        for _ in range(6):
            stretched(tet, np.array([[0.0, 3e4, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1e3]]))
            pressures.append(float(tet.get(rows.PRESSURE)[0]))
        found.append([*pressures, float(tet.get(rows.WORK)[0])])
    assert found[1][5] > found[1][4] > found[1][0]
    assert np.allclose(found[0], found[1], rtol=1e-6)


def test_what_is_flat() -> None:
    """The smallest altitude over the longest edge decides whether a tet is flat. No tet of a common mesh is flat, and
    the state of such a mesh has no column for flat tets."""
    for share, count in ((0.99, 1), (1.01, 0)):
        corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.7, 0.0], [0.3, 0.3, share * THINNEST]])
        tet = Patch(TetMesh(corners, np.array([[0, 1, 2, 3]], np.int32)), form="nodal")
        assert flat_tets(tet.block, tet.nodes.x0).sum() == len(tet.block.flat) == count
    assert not len(Patch(block((3, 3, 3), MM), form="nodal").block.flat)


@pytest.mark.parametrize("form", AVERAGED)
@pytest.mark.parametrize("material", [COPPER, COPPER_GAS], ids=["copper", "gas"])
def test_an_even_compression_has_one_pressure(material: "object", form: Form) -> None:
    """A flat tet has the pressure of its neighbours and does not change the means of the neighbours, up to e^2 / 12
    with e = 3e-4 in a step.
    """
    mesh, _ = flattened((3, 3, 3), 1e-3)
    patch = Patch(mesh, material, form)  # type: ignore[arg-type]
    assert patch.block.flat.any()
    for _ in range(5):
        patch.nodes.v[:] = -1e4 * patch.nodes.x
        patch.nodes.x += 1e-8 * patch.nodes.v
        patch.advance(1e-8)
    pressure = patch.get(rows.PRESSURE)
    assert pressure.min() > 1e7
    assert np.ptp(pressure) < 1e-8 * pressure.max()


@pytest.mark.parametrize("form", AVERAGED)
def test_three_ranks_have_the_answer_of_one(form: Form) -> None:
    mesh, _ = flattened((4, 4, 4), 1e-2)

    def work(sim: Simulation) -> str | None:
        run(sim, steps=40)
        return digest.digest(sim.model, sim.comm, [sim.elements.pressure] if sim.elements.split else [])

    case = scene(COPPER_GAS, form, velocity=(0.0, 0.0, -300.0), boundaries=(WALL,))
    assert on(3, case, [mesh], work)[0] == on(1, case, [mesh], work)[0]


def test_the_mark_goes_with_its_tet() -> None:
    """The mark of a flat tet stays correct when other tets are removed from the block."""
    mesh, flat = flattened((3, 3, 3), 1e-3)
    body = Patch(mesh, COPPER, "nodal").block
    marked = set(body.id[body.flat])
    assert flat in marked
    body.drop(np.flatnonzero(~body.flat)[::3])
    assert set(body.id[body.flat]) == marked


def test_rest_is_kept_to_the_bit() -> None:
    """A wave has reached only the end of a bar with a flat tet; the results with and without the omission of chunks at
    rest are equal."""
    mesh, _ = flattened((3, 3, 36), 1e-2)
    along = TetMesh(mesh.points, mesh.tets[np.argsort(mesh.points[mesh.tets].mean(axis=1)[:, 2])])
    answers = set()
    for skip in (True, False):
        sim = build(scene(COPPER_GAS, "nodal"), [along])
        sim.model.nodes.v[sim.model.nodes.x0[:, 2] < 0.5 * MM, 2] = 50.0
        step.prepare(sim)
        (bar,) = sim.model.blocks
        for _ in range(14):
            bar.quiet[:] = bar.quiet if skip else 0
            step.first_half(sim)
            step.second_half(sim)
        assert (bar.quiet[:, rest.NOTED] > 0).sum() >= 3
        answers.add(digest.digest(sim.model, sim.comm, []))
    assert len(answers) == 1
