"""The elastic law with a potential: its stress compared with the formulas, its energy, and its stable step."""

import math
from typing import Any

import numpy as np
import pytest

from conoid.cases.model.materials import Material
from conoid.worker.materials.hyperelastic import inverse_sixth_root
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import DISTORTION, PRESSURE, TET_VOLUME, WORK
from conoid.worker.simulation import Simulation

from . import formulas
from .kernels import COPPER_GAS, FORMS, HARD, STEEL, Form, Patch, build, run, scene
from .meshes import REGULAR, Floats, block, free_tets

SHEAR, BULK = 200e9 / 2.6, 200e9 / 1.2
N = 400


def deformed(seed: int, size: float) -> tuple[Patch, Floats]:
    """Returns free tets with random displacement gradients of the given size, and the deformation gradients (n, 3, 3)
    of the tets.
    """
    patch = Patch(free_tets(N, seed))
    F = np.eye(3) + size * np.random.default_rng(seed).uniform(-1.0, 1.0, (N, 3, 3))
    assert (np.linalg.det(F) > 0.05).all()
    carry(patch, F)
    return patch, F


def carry(patch: Patch, F: Floats) -> None:
    """Deforms the tets to the deformation gradients F in one pass without velocity."""
    patch.nodes.x[patch.tets] = np.einsum("nij,naj->nai", F, patch.corners(patch.nodes.x0))
    patch.advance(0.0)


def volumes(patch: Patch) -> Floats:
    return formulas.gradients(patch.corners(patch.nodes.x0))[0]


@pytest.mark.parametrize("power", [-24.0, -8.0, -2.0, -1.0, -0.1, 0.0, 1e-3, 0.15, 0.5, 1.0, 2.0, 4.0, 8.0, 24.0])
def test_sixth_root(power: float) -> None:
    """The accuracy also holds if a volume has changed by a factor of 10^12."""
    u = 10.0**power
    assert math.isclose(inverse_sixth_root(u), u ** (-1.0 / 6.0), rel_tol=1e-15)


@pytest.mark.parametrize("viscosity", [{}, {"viscosity": {}}], ids=["plain", "viscous"])
@pytest.mark.parametrize("height", [-1e-3, -0.1, -0.5, -0.9, -1.5])
def test_a_tet_that_is_inside_out_has_no_stable_step(height: float, viscosity: dict[str, Any]) -> None:
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), **viscosity)
    carry(patch, np.diag([1.0, 1.0, height])[None])
    assert math.isnan(patch.limit)


def test_nothing_is_left_of_no_strain() -> None:
    assert inverse_sixth_root(1.0) == 1.0


@pytest.mark.parametrize("size", [0.01, 0.1, 0.3])
def test_stress_and_energy_are_those_of_the_formulas(size: float) -> None:
    patch, F = deformed(1, size)
    stress, energy = formulas.hyperelastic(F, SHEAR)
    assert np.abs(patch.deviator - stress).max() < 1e-12 * np.abs(stress).max()
    assert np.abs(patch.get(DISTORTION) / (volumes(patch) * energy) - 1.0).max() < 1e-9
    assert np.array_equal(patch.get(WORK), patch.get(DISTORTION))


def test_stress_is_the_slope_of_the_energy() -> None:
    """Central differences of the energy along random displacements are compared with the nodal forces."""
    patch, _ = deformed(2, 0.2)
    patch.put(PRESSURE, 0.0)
    patch.advance(0.0)
    ways = np.random.default_rng(3).normal(size=(N, 4, 3))
    ways *= 1e-5 * np.cbrt(volumes(patch))[:, None, None]
    expected = -(patch.corners(patch.force) * ways).sum(axis=(1, 2))
    energies = []
    middle = patch.nodes.x.copy()
    for sign in (-0.5, 0.5):
        patch.nodes.x[:] = middle
        patch.nodes.x[patch.tets] += sign * ways
        patch.advance(0.0)
        energies.append(patch.get(DISTORTION))
    scale = np.abs(patch.corners(patch.force)).max(axis=(1, 2)) * np.abs(ways).max(axis=(1, 2))
    assert np.abs((energies[1] - energies[0] - expected) / scale).max() < 1e-7


def test_small_strains_keep_their_digits() -> None:
    """At a strain E of 1e-9 the stress is 2 G dev E and the energy G V E : E, to the accuracy of the positions."""
    patch, F = deformed(4, 1e-9)
    strain = formulas.deviator(F - np.eye(3))
    stress = 2.0 * SHEAR * strain
    assert np.abs(patch.deviator - stress).max() < 1e-5 * np.abs(stress).max()
    energy = SHEAR * volumes(patch) * (strain * strain).sum(axis=(1, 2))
    assert np.abs(patch.get(DISTORTION) / energy - 1.0).max() < 1e-4


def test_the_law_is_henckys_to_the_third_order() -> None:
    """The difference between J s and 2 G dev ln V is eight times smaller at half of the strain."""
    wrong = []
    for size in (0.2, 0.1, 0.05):
        _, F = deformed(5, size)
        values, axes = np.linalg.eigh(F @ F.transpose(0, 2, 1))
        log = np.einsum("nik,nk,njk->nij", axes, 0.5 * np.log(values), axes)
        stress = np.linalg.det(F)[:, None, None] * formulas.hyperelastic(F, SHEAR)[0]
        wrong.append(float(np.abs(stress / (2.0 * SHEAR) - formulas.deviator(log)).max()))
    assert wrong[0] > 6.0 * wrong[1] > 36.0 * wrong[2]


def test_a_cycle_leaves_nothing() -> None:
    """After a strain and a return along another path, a rate form has a residual stress, but a potential has no
    residual stress.
    """
    patch = Patch(free_tets(N, 6))
    random = np.random.default_rng(6)
    for _ in range(20):
        carry(patch, np.eye(3) + 0.2 * random.uniform(-1.0, 1.0, (N, 3, 3)))
    loaded = np.abs(patch.deviator).max()
    largest = patch.get(WORK).max()
    carry(patch, np.tile(np.eye(3), (N, 1, 1)))
    assert np.abs(patch.deviator).max() < 1e-14 * loaded
    assert np.abs(patch.get(DISTORTION)).max() < 1e-20 * largest
    assert np.abs(patch.get(WORK)).max() < 1e-14 * largest


def frequency(patch: Patch) -> float:
    """Returns the highest frequency of one tet, 1/s, from differences of the forces, with the pressure of its
    volume."""
    middle = patch.nodes.x.copy()
    size = float(np.cbrt(volumes(patch)[0]))

    def force(x: Floats) -> Floats:
        patch.nodes.x[:] = x
        F = formulas.velocity_gradient(patch.corners(), formulas.gradients(patch.corners(patch.nodes.x0))[1])
        patch.put(PRESSURE, -BULK * np.log(np.linalg.det(F)))
        patch.advance(0.0)
        return np.asarray(patch.force.reshape(-1).copy())

    stiffness = np.empty((12, 12))
    for k in range(12):
        step = np.zeros(12)
        step[k] = 1e-5 * size
        stiffness[k] = -(force(middle + step.reshape(4, 3)) - force(middle - step.reshape(4, 3))) / (2e-5 * size)
    force(middle)
    root = 1.0 / np.sqrt(np.repeat(patch.nodes.mass, 3))
    return math.sqrt(np.linalg.eigvalsh(root[:, None] * 0.5 * (stiffness + stiffness.T) * root)[-1])


@pytest.mark.parametrize("size", [0.02, 0.1, 0.2])
def test_bound_of_strained_tets_is_near_the_exact_limit(size: float) -> None:
    """The test compares the tangent stiffness of strained tets of many shapes. The bound does not include the geometric
    stiffness of the stress: it would be 2.5 % of the step at strains of 0.2, a quarter of the margin of the default
    ``dt_safety``.
    """
    random, shares = np.random.default_rng(7), []
    heap = free_tets(60, 7)
    for tet in heap.tets:
        patch = Patch(TetMesh(heap.points[tet], np.array([[0, 1, 2, 3]], np.int32)))
        carry(patch, np.eye(3) + size * random.uniform(-1.0, 1.0, (1, 3, 3)))
        exact = 2.0 / frequency(patch)
        shares.append(1.0 / patch.limit / exact)
    print(f"at most {max(shares):.4f} of the exact limit, at least {min(shares):.4f}")
    assert min(shares) > 0.6
    assert max(shares) <= (1.0 if size < 0.1 else 1.03)


def test_a_stretched_regular_tet_is_stiffer() -> None:
    """The bound follows the shear modulus of the strained state, (G + 2 W) / J per volume."""
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)))
    F = np.diag([1.3, 0.9, 0.95])[None]
    carry(patch, F)
    _, grad = formulas.gradients(patch.corners())
    J = float(np.linalg.det(F[0]))
    energy = float(formulas.hyperelastic(F, SHEAR)[1][0])
    modulus = BULK + 4.0 / 3.0 * (SHEAR + 2.0 * energy) / J
    c = math.sqrt(modulus * J / 7850.0)
    assert math.isclose(patch.limit, c * float(formulas.inverse_length(grad)[0]), rel_tol=1e-12)


@pytest.mark.parametrize("material", [STEEL, COPPER_GAS], ids=["steel", "gas"])
@pytest.mark.parametrize("form", FORMS)
def test_a_tet_keeps_the_volume_of_its_positions(form: Form, material: Material) -> None:
    sim = build(scene(material, form), [block((3, 3, 3), 1e-3, shake=0.2, seed=1)])
    nodes, body = sim.model.nodes, sim.model.blocks[0]
    nodes.v[:] = np.random.default_rng(2).uniform(-30.0, 30.0, nodes.v.shape)
    run(sim, steps=20)
    assert np.array_equal(body.row(TET_VOLUME), formulas.volumes(nodes.x[body.tets]))


def rung(material: Material) -> tuple[float, float]:
    """Returns kinetic plus elastic energy of free tets of 1 mm, whose nodes started with up to 30 m/s, over the initial
    energy (the largest value of the last of 10,000 steps), and the difference between p / K and -ln J.
    """
    heap = free_tets(60, 8)
    mesh = TetMesh(heap.points / np.repeat(np.cbrt(heap.volumes()), 4)[:, None] * 1e-3, heap.tets)
    sim = build(scene(material), [mesh])
    nodes, block, energies = sim.model.nodes, sim.model.blocks[0], list[float]()
    nodes.v[:] = np.random.default_rng(9).uniform(-30.0, 30.0, nodes.v.shape)
    begin = 0.5 * (nodes.mass[:, None] * nodes.v**2).sum()
    start, grad = formulas.gradients(nodes.x0[block.tets])
    apart = [0.0]

    def look(sim: Simulation, before: Floats) -> None:
        if sim.clock.step % 1000 > 990:
            F = formulas.velocity_gradient(nodes.x[block.tets], grad)
            J = np.linalg.det(F)
            stored = start * (formulas.hyperelastic(F, SHEAR)[1] + BULK * (J * np.log(J) - J + 1.0))
            energies.append(float(0.5 * (nodes.mass[:, None] * before * nodes.v).sum() + stored.sum()) / begin)
            apart[0] = max(apart[0], float(np.abs(block.row(PRESSURE) / BULK + np.log(J)).max()))

    run(sim, look, 10_000)
    return max(energies), apart[0]


@pytest.mark.parametrize("material", [STEEL, HARD], ids=["from the shape", "by rates"])
def test_a_ringing_body_keeps_its_energy(material: Material) -> None:
    """The pressure, which is a sum of increments, remains a function of the volume."""
    energy, apart = rung(material)
    print(f"energy {energy:.6f}; pressure {apart:.1e}")
    assert energy == pytest.approx(1.0, abs=1e-3)
    assert apart < 1e-6
