"""The Cowper-Symonds return compared with bisection, and with the closed form of steady flow."""

import numpy as np
import pytest

from conoid.cases.model.materials import CowperSymonds
from conoid.worker.elements.scratch import SCRATCH
from conoid.worker.materials.cowper_symonds import OVER, ROOT, STATIC, increments
from conoid.worker.materials.law import FIRST, SHEAR, SIZE
from conoid.worker.model.rows import PLASTIC_STRAIN, WORK_PLASTIC, YIELD
from conoid.worker.model.state import CHUNK

from . import formulas
from .kernels import MILD_STEEL, Patch, drive
from .meshes import Floats, free_tets

assert isinstance(MILD_STEEL.strength, CowperSymonds)
LAW = MILD_STEEL.strength
G = 200e9 / 2.6
N = 500


def roots(over: Floats, static: Floats, shear: float, hardening: float, fast: float, q: float) -> Floats:
    """Returns increments d with ``over + static`` - 3 G d = (static + H d) (1 + (d / fast)^(1/q)), computed by
    bisection in ln d."""
    high = np.log(over / (3.0 * shear + hardening))
    low = high - 1000.0
    for _ in range(70):
        d = np.exp(0.5 * (low + high))
        excess = 3.0 * shear * d + hardening * d + (static + hardening * d) * (d / fast) ** (1.0 / q) - over
        low, high = np.where(excess < 0.0, 0.5 * (low + high), low), np.where(excess < 0.0, high, 0.5 * (low + high))
    return np.asarray(np.exp(0.5 * (low + high)))


@pytest.mark.parametrize("dt", [1e-10, 1e-7, 1e-5])
def test_the_return_of_random_states(dt: float) -> None:
    """The stress is the flow stress at the rate of the step, for strain increments from 1e-4 to 0.1."""
    random = np.random.default_rng(5)
    patch = Patch(free_tets(N, 5), MILD_STEEL)
    old = formulas.deviator(random.normal(size=(N, 3, 3)))
    old *= (random.uniform(0.0, 1.0, N) * LAW.yield_stress / formulas.mises(old))[:, None, None]
    D = formulas.deviator(random.normal(size=(N, 3, 3)))
    D *= (10.0 ** random.uniform(-4.0, -1.0, N) / dt / np.sqrt((D * D).sum(axis=(1, 2))))[:, None, None]
    strain = random.uniform(0.0, 1.0, N)
    static = LAW.yield_stress + LAW.hardening * strain
    patch.deviator = old
    patch.put(PLASTIC_STRAIN, strain)
    patch.put(YIELD, static)
    volume, _ = formulas.gradients(patch.corners())
    patch.strain(D, dt)
    patch.advance(dt)
    trial = old + 2.0 * G * dt * D
    q, flows = formulas.mises(trial), formulas.mises(trial) > static
    assert 100 < flows.sum() < N
    d = np.zeros(N)
    d[flows] = roots((q - static)[flows], static[flows], G, LAW.hardening, dt * LAW.D, LAW.q)
    new = trial * (1.0 - 3.0 * G * d / q)[:, None, None]
    assert np.abs(patch.get(PLASTIC_STRAIN) - strain - d).max() < 1e-9 * d.max()
    assert np.abs(patch.get(YIELD) - static - LAW.hardening * d).max() < 1e-9 * static.max()
    assert (np.abs(patch.deviator - new).max(axis=(1, 2)) < 1e-9 * q).all()
    work = volume * np.maximum(((old + new) * (trial - new)).sum(axis=(1, 2)), 0.0) / (4.0 * G)
    assert np.abs(patch.get(WORK_PLASTIC) - work).max() < 1e-9 * work.max()


def solved(over: Floats, static: Floats, material: tuple[float, float, float], fast: float) -> tuple[Floats, int]:
    """Returns the increments of the kernel, and the number of iterations; ``material`` has G, H and q."""
    w, params, n = np.zeros(SCRATCH), np.zeros(SIZE), len(over)
    w[OVER : OVER + n], w[STATIC : STATIC + n] = over, static
    params[SHEAR], params[FIRST], params[FIRST + 2] = material
    return w[ROOT : ROOT + n], increments(w, params, n, fast)


@pytest.mark.parametrize("q", [1.0, 4.0, 5.0, 20.0, 100.0])
def test_increments_of_any_constants_equal_halved_brackets(q: float) -> None:
    """The overstress is 1e-12 to 1e3 of the strength, D dt is 1e-14 to 1e3, and the hardening is 0 or 1e-6 to 100 times
    G.
    """
    random, most = np.random.default_rng(int(q)), 0
    for _ in range(200):
        static, shear = 10.0 ** random.uniform(6.0, 10.0, CHUNK), 10.0 ** random.uniform(9.0, 11.5)
        over = static * 10.0 ** random.uniform(-12.0, 3.0, CHUNK)
        hardening = shear * 10.0 ** random.uniform(-6.0, 2.0) * random.integers(0, 2)
        fast = 10.0 ** random.uniform(-14.0, 3.0)
        found, count = solved(over, static, (shear, hardening, q), fast)
        expected = roots(over, static, shear, hardening, fast, q)
        seen = expected > 1e-290
        assert np.abs(found[seen] / expected[seen] - 1.0).max(initial=0.0) < 1e-8
        assert (found[~seen] < 1e-280).all()
        most = max(most, count)
    assert most <= 20


def test_an_increment_does_not_depend_on_the_other_tets() -> None:
    random = np.random.default_rng(7)
    over = 10.0 ** random.uniform(3.0, 10.0, CHUNK)
    together, _ = solved(over, np.full(CHUNK, 250e6), (G, 1e9, 5.0), 1e-6)
    alone = [solved(over[j : j + 1], np.full(1, 250e6), (G, 1e9, 5.0), 1e-6)[0][0] for j in range(CHUNK)]
    assert (together == alone).all()


def test_a_step_without_time_does_not_flow() -> None:
    """In the first pass of a run, whose time step is zero, stresses above the static flow stress do not change."""
    for q in (1.0, 5.0, 100.0):
        assert solved(np.array([1e3, 1e9, 1e12]), np.full(3, 250e6), (G, 1e9, q), 0.0)[0].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("rate", [1.0, 40.4, 1e4])
def test_steady_flow_has_the_flow_stress_of_the_formula(rate: float) -> None:
    """In isochoric tension at a constant rate the plastic rate is rate - (d sigma/dt) / 3 G. At the rate D the stress
    is twice the stress of slow flow.
    """
    point = drive(MILD_STEEL, np.diag([1.0, -0.5, -0.5]) * rate, 0.1 / rate / 2000, 2000)
    strain, stress = point.get(PLASTIC_STRAIN), formulas.mises(point.deviator)
    expected = (LAW.yield_stress + LAW.hardening * strain) * (1.0 + (rate / LAW.D) ** (1.0 / LAW.q))
    slope = expected / (LAW.yield_stress + LAW.hardening * strain) * LAW.hardening / (3.0 * G)
    assert 0.09 < strain[0] < 0.1
    assert abs(stress[0] / expected[0] - 1.0) < slope[0]
