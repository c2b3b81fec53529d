"""The averaged pressure forms: nodal averaging, and the stabilisation of the split form."""

from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest

from conoid.worker.model.rows import PRESSURE, WORK

from . import formulas
from .kernels import FORMS, STEEL, Form, Patch
from .meshes import Floats, block

BULK, SHEAR, DENSITY = 200e9 / 1.2, 200e9 / 2.6, 7850.0
DT = 1e-8
QUANTUM = 2e-15
"""Largest error of a volume strain from a nodal sum in quanta of 2^-52."""
MESH = block((4, 3, 3), 1e-3, shake=0.25, seed=1)


def quarter_sums(patch: Patch, values: Floats) -> Floats:
    """Returns (nodes,) sums of a quarter of the value of each tet at each node of the tet."""
    return formulas.at_nodes(patch.tets, np.repeat(values[:, None] / 4.0, 4, axis=1), patch.nodes.n)


def shaken(form: Form, seed: int) -> tuple[Patch, Floats, Floats]:
    """Returns a block at the end of a step with random velocities, the mean volumes of the step, and the rates of
    volume strain."""
    patch = Patch(MESH, STEEL, form)
    patch.nodes.v[:] = np.random.default_rng(seed).normal(size=patch.nodes.v.shape) * 100.0
    way = 0.5 * DT * patch.nodes.v
    old, new = (formulas.volumes(patch.corners(patch.nodes.x + sign * way)) for sign in (-1.0, 1.0))
    patch.nodes.x += way
    return patch, 0.5 * (old + new), (new - old) / (0.5 * (old + new)) / DT


@pytest.mark.parametrize("form", FORMS[1:])
def test_pressure_follows_the_mean_of_the_nodes(form: Form) -> None:
    """Each node has the volume-weighted mean strain of its tets, and each tet has the mean of its four nodes."""
    patch, volume, rate = shaken(form, 2)
    patch.advance(DT)
    nodal = quarter_sums(patch, volume * rate * DT) / quarter_sums(patch, volume)
    expected = -BULK * nodal[patch.tets].mean(axis=1)
    assert np.abs(patch.get(PRESSURE) - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("form", FORMS[1:])
def test_averaging_keeps_the_change_of_volume(form: Form) -> None:
    """The averaged strains times the volumes add up to the change of volume of the body."""
    patch, volume, rate = shaken(form, 3)
    patch.advance(DT)
    seen = -patch.get(PRESSURE) / BULK
    assert abs((seen * volume).sum() - (rate * DT * volume).sum()) < 1e-12 * np.abs(rate * DT * volume).sum()


@pytest.mark.parametrize("form", FORMS)
def test_uniform_strain_gives_every_form_the_same_pressure(form: Form) -> None:
    patch = Patch(MESH, STEEL, form)
    gradient = np.array([[3.0, 1.0, 0.0], [2.0, -5.0, 1.0], [0.0, 4.0, 7.0]]) * 1e3
    patch.nodes.v[:] = patch.nodes.x @ gradient
    patch.nodes.x += 0.5 * DT * patch.nodes.v
    patch.advance(DT)
    old, new = (float(np.linalg.det(np.eye(3) + sign * 0.5 * DT * gradient)) for sign in (-1.0, 1.0))
    expected = -BULK * (new - old) / (0.5 * (old + new))
    assert np.abs(patch.get(PRESSURE) - expected).max() < QUANTUM * BULK


@pytest.mark.parametrize("form", FORMS)
def test_work_is_that_of_the_nodal_forces(form: Form) -> None:
    """With and without averaging, the work of the pressure acts on each tet's own change of volume: the sum of this
    work is force times displacement."""
    patch, volume, rate = shaken(form, 4)
    patch.advance(DT)
    pressure = patch.get(PRESSURE)
    expected = -0.5 * pressure * rate * DT * volume
    shear = patch.get(WORK) - expected
    start, grad = formulas.gradients(patch.corners(patch.nodes.x0))
    F = formulas.velocity_gradient(patch.corners(), grad)
    deviatoric = start * formulas.hyperelastic(F, SHEAR)[1]
    assert np.abs(shear - deviatoric).max() < 1e-9 * deviatoric.max()


def stabilised(pressure: Floats) -> tuple[Patch, Floats]:
    """Returns a block at rest with a nodal pressure after one step of the split form, and the change of pressure in
    the step."""
    patch = Patch(MESH, STEEL, "split")
    patch.elements.pressure[:] = pressure
    patch.advance(0.0)
    start = patch.elements.pressure.copy()
    patch.advance(DT)
    return patch, np.asarray(patch.elements.pressure - start)


def test_a_linear_pressure_is_left_alone() -> None:
    pressure = 1e9 + MESH.points @ np.array([1.0, -2.0, 3.0]) * 1e12
    _, change = stabilised(pressure)
    assert np.abs(change).max() < 1e-13 * np.abs(pressure).max()


def test_stabilisation_against_the_formula() -> None:
    """The change of pressure at node a is K dt^2/2 / V_a times the sum over the tets of V / rho times the scalar
    product of grad N_a and grad p minus the mean projected grad p. and grad p minus the mean projected grad p. The sum
    over the nodes of V_a times the change of pressure is zero.
    """
    pressure = np.random.default_rng(5).normal(size=len(MESH.points)) * 1e9
    patch, change = stabilised(pressure)
    volume, grad = formulas.gradients(patch.corners())
    own = np.einsum("na,nai->ni", pressure[patch.tets], grad)
    nodal_volume = quarter_sums(patch, volume)
    projected = np.stack([quarter_sums(patch, volume * own[:, i]) for i in range(3)], axis=1) / nodal_volume[:, None]
    excess = own - projected[patch.tets].mean(axis=1)
    flux = volume[:, None] / DENSITY * np.einsum("nai,ni->na", grad, excess)
    expected = -0.5 * BULK * DT**2 * formulas.at_nodes(patch.tets, flux, patch.nodes.n) / nodal_volume
    assert np.abs(change - expected).max() < 1e-11 * np.abs(expected).max()
    assert abs((nodal_volume * change).sum()) < QUANTUM * BULK * volume.sum()


def test_a_checkerboard_is_damped() -> None:
    """An alternating pressure loses energy in each step, and does not change its sign if the step is stable."""
    grid = np.rint(block((4, 3, 3), 1.0, shake=0.0).points).sum(axis=1)
    sign = np.where(grid % 2 == 0, 1.0, -1.0)
    patch, _ = stabilised(sign * 1e9)
    volume = quarter_sums(patch, formulas.gradients(patch.corners())[0])
    energy = []
    dt = 0.9 / patch.limit
    for _ in range(12):
        energy.append(float((volume * patch.elements.pressure**2).sum()))
        patch.advance(dt)
    assert all(new < old for old, new in pairwise(energy))
    assert energy[-1] < 0.6 * energy[0]


def test_a_lone_tet_is_not_stabilised() -> None:
    """The nodes of a single tet have the pressure gradient of this tet, so the difference of gradients is zero for any
    pressures.
    """
    lone = block((1, 1, 1), 1e-3, shake=0.0)
    patch = Patch(type(lone)(lone.points[lone.tets[0]], np.array([[0, 1, 2, 3]], np.int32)), STEEL, "split")
    patch.elements.pressure[:] = [1e9, -2e9, 3e9, 5e8]
    patch.advance(0.0)
    start: npt.NDArray[np.float64] = patch.elements.pressure.copy()
    patch.advance(DT)
    assert np.abs(patch.elements.pressure - start).max() < 1e-13 * 3e9
