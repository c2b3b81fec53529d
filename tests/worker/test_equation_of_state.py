"""Linear and Mie-Grueneisen pressure, their energy, and the speed of sound."""

import math
from itertools import pairwise

import numpy as np
import pytest

from conoid.cases.model.materials import MieGruneisen
from conoid.worker import step
from conoid.worker.errors import PhysicsError
from conoid.worker.model.rows import MASS, PRESSURE, VOLUME_RATIO, WORK, WORK_VISCOUS
from conoid.worker.simulation import Simulation

from . import formulas
from .kernels import COPPER_GAS, FORMS, STEEL, Form, Patch, build, drive, scene
from .meshes import Floats, free_tets

assert COPPER_GAS.eos is not None
GAS: MieGruneisen = COPPER_GAS.eos
DENSITY, SHEAR = 8930.0, 117e9 / 2.7
BULK_STEEL = 200e9 / 1.2
N = 500
DT = 1e-8


def cold(ratio: Floats | float) -> Floats:
    """Returns the part of the pressure that does not depend on the energy; ``ratio`` is V / V0."""
    chi = 1.0 - ratio
    hugoniot = DENSITY * GAS.c0**2 * chi / (1.0 - GAS.S * np.maximum(chi, 0.0)) ** 2
    return np.asarray(hugoniot * (1.0 - 0.5 * GAS.gamma0 * np.maximum(chi, 0.0)))


def compressed(seed: int, rate: float) -> tuple[Patch, Floats, Floats]:
    """Returns copper tets in random states, without shear stress, that expand or shrink equally in all directions; also
    returns the strains and the mean volumes of the tets in the step.
    """
    patch = Patch(free_tets(N, seed), COPPER_GAS)
    random = np.random.default_rng(seed)
    patch.put(VOLUME_RATIO, random.uniform(0.75, 1.05, N))
    patch.put(PRESSURE, random.uniform(-1e9, 50e9, N))
    patch.put(WORK, random.uniform(0.0, 1e6, N) * patch.get(MASS))
    patch.put(WORK_VISCOUS, random.uniform(0.0, 1e5, N) * patch.get(MASS))
    sixth = random.uniform(-rate, rate, N) / 6.0
    old, new = ((1.0 + sign * sixth) ** 3 for sign in (-1.0, 1.0))
    volume, _ = formulas.gradients(patch.corners())
    patch.strain(2.0 * sixth[:, None, None] / DT * np.eye(3), DT)
    return patch, (new - old) / (0.5 * (old + new)), 0.5 * (old + new) * volume


def test_linear_pressure_is_logarithmic() -> None:
    """The pressure is p = -K ln(V / V0); to second order in the step its work is K V0 times the energy of a logarithmic
    spring.
    """
    wrong = []
    for steps in (20, 40):
        tet = free_tets(1, 3)
        patch = Patch(tet, STEEL)
        scales = np.linspace(1.0, 0.9, steps + 1)
        for old, new in pairwise(scales):
            patch.nodes.v[:] = tet.points * (new - old) / DT
            patch.nodes.x[:] = tet.points * new
            patch.advance(DT)
        expected = -BULK_STEEL * 3.0 * math.log(0.9)
        volume = float(tet.volumes()[0])
        ratio = 0.9**3
        stored = BULK_STEEL * volume * (ratio * math.log(ratio) - ratio + 1.0)
        wrong.append([abs(patch.get(PRESSURE)[0] / expected - 1.0), abs(patch.get(WORK)[0] / stored - 1.0)])
    assert np.all(np.array(wrong[1]) < 0.26 * np.array(wrong[0]))
    assert np.all(np.array(wrong[1]) < 1e-3)


def test_mie_gruneisen_solves_the_energy_equation() -> None:
    """The new pressure is the equation of state at the new energy, which includes the work of the mean pressure. The
    equation for the new pressure is solved exactly, without iteration."""
    patch, strain, volume = compressed(1, 0.05)
    old, work, ratio = patch.get(PRESSURE), patch.get(WORK), patch.get(VOLUME_RATIO)
    viscous = patch.get(WORK_VISCOUS)
    patch.advance(DT)
    new, ratio_new = patch.get(PRESSURE), ratio * (1.0 + 0.5 * strain) / (1.0 - 0.5 * strain)
    assert np.abs(patch.get(VOLUME_RATIO) / ratio_new - 1.0).max() < 1e-12
    work_new = work - 0.5 * (old + new) * strain * volume
    assert np.abs(patch.get(WORK) - work_new).max() < 1e-12 * np.abs(work).max()
    energy = (work_new + viscous) / patch.get(MASS)
    expected = cold(ratio_new) + GAS.gamma0 * DENSITY * energy
    assert np.abs(new - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("speed", [100.0, 300.0, 1500.0])
def test_the_law_gives_the_hugoniot(speed: float) -> None:
    """At the energy u_p^2 / 2 and the compression u_p / U_s the pressure is rho0 U_s u_p."""
    shock = GAS.c0 + GAS.S * speed
    ratio = 1.0 - speed / shock
    pressure = cold(ratio) + GAS.gamma0 * DENSITY * 0.5 * speed**2
    assert math.isclose(float(pressure), DENSITY * shock * speed, rel_tol=1e-12)
    tet = free_tets(1, 2)
    patch = Patch(tet, COPPER_GAS)
    patch.put(VOLUME_RATIO, ratio)
    patch.put(WORK, 0.5 * speed**2 * patch.get(MASS))
    patch.advance(0.0)
    assert math.isclose(patch.get(PRESSURE)[0], DENSITY * shock * speed, rel_tol=1e-12)


def test_an_adiabat_of_many_steps() -> None:
    """A compression by a fifth in small steps agrees to second order with the integral of de/dchi = p / rho0."""
    from scipy.integrate import solve_ivp

    def heated(chi: float, energy: Floats) -> Floats:
        return np.asarray((cold(1.0 - chi) + GAS.gamma0 * DENSITY * energy) / DENSITY)

    exact = solve_ivp(heated, (0.0, 0.2), [0.0], rtol=1e-12, atol=1e-3).y[0, -1]
    wrong = []
    for steps in (25, 50):
        tet = free_tets(1, 5)
        patch = Patch(tet, COPPER_GAS)
        scales = np.linspace(1.0, 0.8, steps + 1) ** (1.0 / 3.0)
        for old, new in pairwise(scales):
            patch.nodes.v[:] = tet.points * (new - old) / DT
            patch.nodes.x[:] = tet.points * new
            patch.advance(DT)
        wrong.append(abs(float(patch.get(WORK)[0] / patch.get(MASS)[0]) / exact - 1.0))
    assert wrong[1] < 0.27 * wrong[0] < 1e-3


def speed_of_sound(patch: Patch) -> float:
    """Returns the speed of sound c from the step limit of one tet, which is c sqrt(sum |grad N|^2)."""
    _, grad = formulas.gradients(patch.corners())
    return patch.limit / float(formulas.inverse_length(grad)[0])


@pytest.mark.parametrize("ratio", [1.05, 1.0, 0.95, 0.8, 0.72])
@pytest.mark.parametrize("energy", [0.0, 3e5])
def test_speed_of_sound_is_the_slope_of_the_adiabat(ratio: float, energy: float) -> None:
    """The speed of sound satisfies rho c^2 = dp / dln(rho) at constant entropy + 4/3 G / J; the slope is computed from
    a small adiabatic step in each direction."""
    pressures, strain = [], 1e-5
    for sign in (-1.0, 0.0, 1.0):
        patch = Patch(free_tets(1, 6), COPPER_GAS)
        edge = ratio ** (1.0 / 3.0)
        patch.nodes.x *= edge
        patch.put(VOLUME_RATIO, ratio)
        patch.put(WORK, energy * patch.get(MASS))
        patch.advance(0.0)
        if sign == 0.0:
            c, density = speed_of_sound(patch), DENSITY / ratio
        patch.nodes.v[:] = sign * strain / 3.0 * patch.nodes.x / DT
        patch.nodes.x += DT * patch.nodes.v
        patch.advance(DT)
        pressures.append(float(patch.get(PRESSURE)[0]))
    slope = (pressures[0] - pressures[2]) / (2.0 * strain)
    assert math.isclose(density * c * c, slope + 4.0 / 3.0 * SHEAR / ratio, rel_tol=2e-5)


def test_speed_of_sound_of_a_linear_solid() -> None:
    point = drive(STEEL, np.zeros((3, 3)), 0.0, 1)
    assert math.isclose(speed_of_sound(point), 5856.38, rel_tol=1e-5)


def test_there_is_no_pressure_beyond_the_pole() -> None:
    """The Hugoniot pressure p_H is infinite at the compression 1 / S. Beyond the compression 1 / S the law returns no
    pressure, instead of a finite pressure that decreases."""
    for ratio, finite in ((1.0 - 0.99 / GAS.S, True), (1.0 - 1.01 / GAS.S, False), (-0.1, False)):
        patch = Patch(free_tets(1, 5), COPPER_GAS)
        patch.put(VOLUME_RATIO, ratio)
        patch.advance(0.0)
        assert np.isfinite(patch.get(PRESSURE)[0]) == finite
        assert np.isfinite(patch.limit) == finite


@pytest.mark.parametrize("spall", [None, 1e9])
@pytest.mark.parametrize("form", FORMS)
def test_a_tet_that_passes_the_pole_ends_the_run(form: Form, spall: float | None) -> None:
    """The message names the tet and the compression of the tet. Without a check of the pole the run would continue with
    a meaningless pressure."""
    case = scene(COPPER_GAS.model_copy(update={"spall": spall}), form)
    sim = build(case, [free_tets(1, 5)])
    step.prepare(sim)
    sim.model.nodes.v[:] = -(sim.model.nodes.x - sim.model.nodes.x.mean(axis=0)) * 0.4 * sim.reduction.limit
    line = r"^step \d+, t = \S+ s: tet 0 of body is compressed by 1 - V/V0 = [01]\.\d+; .* the pole, 0\.6711$"
    with pytest.raises(PhysicsError, match=line):
        _steps(sim, 20)


def _steps(sim: Simulation, n: int) -> None:
    for _ in range(n):
        step.first_half(sim)
        step.second_half(sim)
