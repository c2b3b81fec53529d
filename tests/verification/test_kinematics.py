"""V9 to V11: patch test, rigid rotation and simple shear, for elastic materials and for materials below their
strength."""

from itertools import pairwise

import numpy as np
import pytest

from conoid.worker.model.rows import PRESSURE, S_XX, S_XY, S_YY

from ..worker import formulas
from ..worker.kernels import FORMS, HARD, STEEL, Form, Patch
from ..worker.meshes import Floats, block
from .convergence import assert_converges

YOUNG, SHEAR, BULK = 200e9, 200e9 / 2.6, 200e9 / 1.2
MESH = block((3, 3, 3), 1e-3, shake=0.25, seed=7)
DT = 1e-8


def carry(patch: Patch, maps: list[Floats]) -> None:
    """Moves every node by linear maps (3, 3) of its initial position, one map after the other, in a step of ``DT``
    each.
    """
    for old, new in pairwise(maps):
        start, end = MESH.points @ old.T, MESH.points @ new.T
        patch.nodes.v[:] = (end - start) / DT
        patch.nodes.x[:] = end
        patch.advance(DT)


def turn(angle: float, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Floats:
    """Returns the (3, 3) rotation about a unit vector."""
    a = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * a + (1.0 - np.cos(angle)) * a @ a)


@pytest.mark.parametrize("form", FORMS)
def test_patch_of_irregular_tets_has_uniform_stress(form: Form) -> None:
    """V9: a linear displacement gives every tet the same strain, to 1e-12, and inner nodes are in equilibrium."""
    patch = Patch(MESH, STEEL, form)
    slope = np.array([[0.10, 0.07, -0.03], [0.02, -0.05, 0.04], [-0.06, 0.01, 0.08]])
    carry(patch, [np.eye(3) + s * slope for s in np.linspace(0.0, 1.0, 21)])
    stress = patch.stress
    mean = stress.mean(axis=0)
    assert np.abs(stress - mean).max() < 1e-12 * np.abs(mean).max()
    inner = ((MESH.points > 0.0) & (MESH.points < 3e-3)).all(axis=1)
    assert inner.sum() == 8
    assert np.abs(patch.force[inner]).max() < 1e-12 * np.abs(patch.force).max()
    assert patch.get(PRESSURE)[0] == pytest.approx(-BULK * np.log(np.linalg.det(np.eye(3) + slope)), rel=1e-4)


def test_pure_stretch_gives_logarithmic_strain() -> None:
    """V9: in a stretch along the axes, p = -K ln J and s = 2 G dev ln F to second order in the step, with a
    strength."""
    wrong = []
    for steps in (10, 20):
        patch = Patch(MESH, HARD)
        carry(
            patch, [np.diag([1.0 + 0.3 * s, 1.0 - 0.1 * s, 1.0 + 0.05 * s]) for s in np.linspace(0.0, 1.0, steps + 1)]
        )
        log = np.log([1.3, 0.9, 1.05])
        exact = 2.0 * SHEAR * np.diag(log - log.mean()) + BULK * log.sum() * np.eye(3)
        wrong.append(np.abs(patch.stress - exact).max() / YOUNG)
    assert 1e-12 < wrong[1] < 0.26 * wrong[0] < 1e-3


@pytest.mark.parametrize("form", FORMS)
def test_a_hundred_turns_leave_no_stress(form: Form) -> None:
    """V10: after 100 rigid turns of 40 steps about a skew axis the stress is below 1e-10 of Young's modulus."""
    patch = Patch(MESH, STEEL, form)
    axis = (2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0)
    carry(patch, [turn(2.0 * np.pi * n / 40.0, axis) for n in range(4001)])
    assert np.abs(patch.stress).max() < 1e-10 * YOUNG


def test_stress_turns_with_the_body() -> None:
    """V10: a stress along x is a stress along y after a quarter turn, and a stress along x again after 25 turns."""
    patch = Patch(MESH, HARD)
    patch.put(S_XX, 2e8)
    patch.put(S_YY, -1e8)
    patch.put(S_XY, 0.5e8)
    first = patch.deviator
    carry(patch, [turn(0.5 * np.pi * n / 30.0) for n in range(31)])
    quarter = turn(0.5 * np.pi)
    assert np.abs(patch.deviator - quarter @ first @ quarter.T).max() < 1e-3 * 2e8
    assert patch.get(S_YY)[0] == pytest.approx(2e8, rel=1e-3)
    assert patch.get(S_XX)[0] == pytest.approx(-1e8, rel=1e-2)
    assert np.linalg.norm(patch.deviator[0]) == pytest.approx(np.linalg.norm(first[0]), rel=1e-13)


def test_a_gradient_at_the_start_of_the_step_would_strain_the_body() -> None:
    """Control of V10: with gradients at the start of the step, a turn of N steps strains the body by 2 pi^2 / N."""
    steps = 1000
    strain = 0.0
    for n in range(steps):
        old, new = turn(2.0 * np.pi * n / steps), turn(2.0 * np.pi * (n + 1) / steps)
        _, grad = formulas.gradients((MESH.points @ old.T)[MESH.tets[:1]])
        moved = (MESH.points @ (new - old).T)[MESH.tets[:1]]
        strain += float(formulas.velocity_gradient(moved, grad)[0, 0, 0])
    assert strain == pytest.approx(-2.0 * np.pi**2 / steps, rel=1e-3)


def shear_errors(steps: int) -> float:
    """Returns the largest error of the stress up to a shear of 10, over G; the exact stress is s_xy = G sin, s_xx =
    -s_yy = G (1 - cos).
    """
    patch = Patch(MESH, HARD)
    worst = 0.0
    shear = np.linspace(0.0, 10.0, steps + 1)
    for old, new in pairwise(shear):
        carry(patch, [np.array([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) for g in (old, new)])
        exact = {S_XY: np.sin(new), S_XX: 1.0 - np.cos(new), S_YY: np.cos(new) - 1.0}
        worst = max(worst, *(float(np.abs(patch.get(row) / SHEAR - value).max()) for row, value in exact.items()))
    assert np.abs(patch.get(PRESSURE)).max() < 1e-12 * BULK * 10.0
    return worst


def test_simple_shear_follows_the_jaumann_rate() -> None:
    """V11: up to a shear of 10 the stress of a material with a strength follows the Jaumann rate; the error is the
    shear of one step times G."""
    errors = [shear_errors(steps) for steps in (250, 500, 1000, 2000)]
    assert_converges("simple_shear", errors)


def test_an_elastic_body_in_simple_shear_follows_its_potential() -> None:
    """V11, elastic material: s_xy = G g up to a shear of 10, in steps of any size, without the decrease of the Jaumann
    rate.
    """
    patch = Patch(MESH)
    for g in (0.1, 1.0, 10.0):
        carry(patch, [np.eye(3), np.array([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])])
        assert np.abs(patch.get(S_XY) / SHEAR - g).max() < 1e-12 * (1.0 + g**4)
