"""Gradients, velocity gradient and rotation, tested by the stress and the forces after a pass."""

import numpy as np
import pytest

from conoid.cases.model.materials import Material
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import PRESSURE, WORK

from . import formulas
from .kernels import HARD, STEEL, Patch
from .meshes import REGULAR, Floats, block, free_tets

BULK, SHEAR = 200e9 / (3 * (1 - 0.6)), 200e9 / 2.6
"""Moduli of STEEL, Pa."""
DT = 1e-7


def moving(seed: int, rate: float = 1e5) -> Patch:
    """Returns free tets at the end of a step of ``DT`` in random motion, with a common velocity."""
    patch = Patch(free_tets(600, seed), HARD)
    random = np.random.default_rng(seed)
    patch.strain(random.normal(size=(600, 3, 3)) * rate, DT)
    flight = random.normal(size=3) * 100.0
    patch.nodes.v += flight
    patch.nodes.x += DT * flight
    return patch


def mid_gradient(patch: Patch) -> tuple[Floats, Floats]:
    """Returns the volume and the velocity gradient in the middle of the step, from the formulas."""
    volume, grad = formulas.gradients(patch.corners() - 0.5 * DT * patch.corners(patch.nodes.v))
    return volume, formulas.velocity_gradient(patch.corners(patch.nodes.v), grad)


def relative(found: Floats, expected: Floats) -> float:
    """Returns the largest difference of each tet over the largest magnitude of the tet."""
    axes = tuple(range(1, found.ndim))
    return float((np.abs(found - expected).max(axis=axes) / np.abs(expected).max(axis=axes)).max())


def test_rate_of_deformation_at_mid_step() -> None:
    """From a state without stress, one step gives s = 2 G dt dev D, rotated to the end of the step, and p = -K dt tr
    D."""
    patch = moving(1)
    patch.advance(DT)
    _, L = mid_gradient(patch)
    assert relative(patch.deviator, 2.0 * SHEAR * DT * formulas.stretching(L, DT)) < 1e-12
    assert np.abs(patch.get(PRESSURE) + BULK * DT * np.trace(L, axis1=1, axis2=2)).max() < 1e-12 * BULK


def test_rotation_is_the_cayley_transform() -> None:
    patch = moving(2)
    before = formulas.deviator(np.random.default_rng(3).normal(size=(600, 3, 3)) * 1e9)
    patch.deviator = before
    patch.advance(DT)
    _, L = mid_gradient(patch)
    expected = formulas.rotated(before, L, DT) + 2.0 * SHEAR * DT * formulas.stretching(L, DT)
    assert relative(patch.deviator, expected) < 1e-12


@pytest.mark.parametrize("rate", [1e3, 1e6, 1e7])
def test_rotation_changes_no_invariant(rate: float) -> None:
    """In a rigid rotation of up to a radian in a step, the stress s rotates, and its magnitude and determinant are
    constant up to round-off."""
    patch = Patch(free_tets(300, 4), HARD)
    before = formulas.deviator(np.random.default_rng(5).normal(size=(300, 3, 3)) * 1e9)
    patch.deviator = before
    axis = np.array([0.36, 0.48, 0.8])
    angle = 2.0 * np.arctan(0.5 * rate * DT)
    middle = patch.nodes.x.copy()
    patch.nodes.v[:] = rate * np.cross(axis, middle)
    patch.nodes.x += 0.5 * DT * patch.nodes.v
    patch.advance(DT)
    assert np.abs(patch.get(PRESSURE)).max() < 1e-13 * BULK
    assert np.abs(np.linalg.det(patch.deviator) / np.linalg.det(before) - 1.0).max() < 1e-9
    assert np.abs(formulas.mises(patch.deviator) / formulas.mises(before) - 1.0).max() < 1e-13 * max(1.0, rate * 1e-4)
    turn = rotation(axis, angle)
    assert relative(patch.deviator, turn @ before @ turn.T) < 1e-13 * max(1.0, rate * 1e-4)


def turned_and_stretched(steps: int) -> float:
    """Returns the error of the stress over the shear modulus, for a tet that turns by a radian and stretches along axes
    that turn with the tet. The exact stress is 2 G times the logarithm of the stretch, rotated.
    """
    patch = Patch(TetMesh(REGULAR, np.array([[0, 1, 2, 3]], np.int32)), HARD)
    axis, along, start = np.array([0.36, 0.48, 0.8]), np.diag([0.2, -0.15, -0.05]), patch.nodes.x.copy()
    for k in range(1, steps + 1):
        share = k / steps
        stretch = np.diag(np.exp(share * np.diag(along)))
        end = start @ (rotation(axis, share) @ stretch).T
        patch.nodes.v[:] = (end - patch.nodes.x) / DT
        patch.nodes.x[:] = end
        patch.advance(DT)
    turn = rotation(axis, 1.0)
    return float(np.abs(patch.deviator[0] / SHEAR - 2.0 * turn @ along @ turn.T).max())


def test_strain_is_added_where_it_is_after_half_of_the_turn() -> None:
    """With half the step the error of the stress is a quarter. If the strain of the middle of the step were added
    without rotation, the error would be a half with half the step."""
    errors = [turned_and_stretched(steps) for steps in (10, 20, 40)]
    assert errors[1] / errors[0] == pytest.approx(0.25, abs=0.02)
    assert errors[2] / errors[1] == pytest.approx(0.25, abs=0.02)
    assert errors[2] < 1e-4


def rotation(axis: Floats, angle: float) -> Floats:
    """Returns Rodrigues' matrix: the rotation by ``angle`` about the unit vector ``axis``."""
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def test_forces_are_minus_volume_stress_gradient() -> None:
    patch = moving(6)
    patch.deviator = formulas.deviator(np.random.default_rng(7).normal(size=(600, 3, 3)) * 1e9)
    patch.put(PRESSURE, np.random.default_rng(8).normal(size=600) * 1e9)
    patch.advance(DT)
    volume, grad = formulas.gradients(patch.corners())
    expected = formulas.forces(volume, patch.stress, grad)
    found = patch.corners(patch.force)
    assert (
        np.abs(found - expected).max(axis=(1, 2)) <= 1e-12 * np.abs(expected).max(axis=(1, 2)) + 3 * patch.quantum
    ).all()


def test_forces_add_to_zero_as_integers() -> None:
    patch = Patch(block((4, 4, 4), 1e-3, seed=9))
    patch.nodes.v[:] = np.random.default_rng(10).normal(size=patch.nodes.v.shape) * 50.0
    patch.advance(1e-8)
    assert np.abs(patch.nodes.force).max() > 2**40
    assert (patch.nodes.force.sum(axis=0) == 0).all()
    volume, grad = formulas.gradients(patch.corners())
    expected = formulas.at_nodes(patch.tets, formulas.forces(volume, patch.stress, grad), patch.nodes.n)
    assert np.abs(patch.force - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("material", [STEEL, HARD], ids=["elastic", "strong"])
def test_a_part_that_only_flies_has_no_stress(material: Material) -> None:
    """Equal velocities cancel exactly; elastic materials have the rounding error of the positions, G eps x / h."""
    patch = Patch(block((3, 3, 3), 1e-3), material)
    patch.nodes.v[:] = [1234.5, -678.9, 1e4]
    patch.nodes.x += 1e-8 * patch.nodes.v
    patch.advance(1e-8)
    if material is HARD:
        assert not patch.stress.any()
        assert not patch.nodes.force.any()
    assert np.abs(patch.stress).max() < 20.0 * SHEAR * np.finfo(float).eps * patch.nodes.x.max() / 1e-3


def test_a_part_at_rest_has_no_stress() -> None:
    """No bit of the stress is set, also with the law of elastic materials, which computes the stress from the shape."""
    patch = Patch(block((3, 3, 3), 1e-3, shake=0.2), STEEL)
    patch.advance(1e-8)
    assert not patch.stress.any()
    assert not patch.get(WORK).any()
