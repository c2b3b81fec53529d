"""The work of the stress and the return with linear hardening, compared with the formulas."""

import numpy as np

from conoid.worker.model.rows import PLASTIC_STRAIN, WORK, WORK_PLASTIC, YIELD

from . import formulas
from .kernels import COPPER, HARD, Patch, drive
from .meshes import Floats, free_tets

SHEAR = 117e9 / 2.7
YOUNG_STEEL_SHEAR = 200e9 / 2.6
HARDENING, YIELD_0 = 0.1e9, 0.4e9
N = 500
DT = 1e-7


def strained(seed: int, rate: float) -> tuple[Patch, Floats]:
    """Returns copper tets with random stress inside the yield surface and a random isochoric velocity gradient."""
    patch = Patch(free_tets(N, seed), COPPER)
    random = np.random.default_rng(seed)
    L = random.normal(size=(N, 3, 3)) * rate
    L -= np.trace(L, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    patch.strain(L, DT)
    s = formulas.deviator(random.normal(size=(N, 3, 3)))
    patch.deviator = s / formulas.mises(s)[:, None, None] * random.uniform(0.0, YIELD_0, N)[:, None, None]
    return patch, L


def test_work_below_the_yield_stress_is_trapezoidal() -> None:
    patch, L = strained(1, 2e3)
    strong = Patch(free_tets(N, 1), HARD)
    strong.nodes.x[:], strong.nodes.v[:], strong.deviator = patch.nodes.x, patch.nodes.v, patch.deviator
    start = formulas.rotated(patch.deviator, L, DT)
    volume, _ = formulas.gradients(strong.corners() - 0.5 * DT * strong.corners(strong.nodes.v))
    strong.advance(DT)
    end = start + 2.0 * YOUNG_STEEL_SHEAR * DT * formulas.stretching(L, DT)
    work = 0.5 * DT * volume * (formulas.power(start, L, DT) + formulas.power(end, L, DT))
    scale = DT * volume * formulas.mises(end) * np.sqrt((L * L).sum(axis=(1, 2)))
    assert np.abs((strong.get(WORK) - work) / scale).max() < 1e-13


def test_linear_hardening_return() -> None:
    """The plastic increment is (q - Y) / (3 G + H), the stress is scaled to the new yield stress, and the work is
    booked.
    """
    patch, L = strained(2, 2e4)
    old, start = patch.deviator, np.random.default_rng(3).uniform(0.0, 2.0, N)
    patch.put(PLASTIC_STRAIN, start)
    patch.put(YIELD, YIELD_0 + HARDENING * start)
    volume, _ = formulas.gradients(patch.corners() - 0.5 * DT * patch.corners(patch.nodes.v))
    patch.advance(DT)
    turned = formulas.rotated(old, L, DT)
    trial = turned + 2.0 * SHEAR * DT * formulas.stretching(L, DT)
    q = formulas.mises(trial)
    increment = np.maximum(q - YIELD_0 - HARDENING * start, 0.0) / (3.0 * SHEAR + HARDENING)
    assert 50 < (increment > 0.0).sum() < N - 50
    flow = YIELD_0 + HARDENING * (start + increment)
    stress = trial * np.where(increment > 0.0, flow / q, 1.0)[:, None, None]
    assert np.abs(patch.get(PLASTIC_STRAIN) - start - increment).max() < 1e-15 * 8
    assert np.abs(patch.get(YIELD) / flow - 1.0).max() < 1e-14
    assert np.abs(patch.deviator - stress).max() < 1e-12 * np.abs(stress).max()
    plastic = volume * np.maximum(((turned + stress) * (trial - stress)).sum(axis=(1, 2)), 0.0) / (4.0 * SHEAR)
    assert np.abs(patch.get(WORK_PLASTIC) - plastic).max() < 1e-12 * plastic.max()
    work = 0.5 * DT * volume * (formulas.power(turned, L, DT) + formulas.power(stress, L, DT))
    assert np.abs(patch.get(WORK) - work).max() < 1e-12 * np.abs(work).max()


def test_the_return_is_idempotent() -> None:
    """A state on the yield surface that is not strained further does not flow."""
    patch, _ = strained(4, 1e5)
    patch.advance(DT)
    flowed, stress = patch.get(PLASTIC_STRAIN), patch.deviator
    patch.nodes.v[:] = 0.0
    patch.advance(DT)
    assert np.abs(patch.get(PLASTIC_STRAIN) - flowed).max() < 1e-15
    assert np.abs(patch.deviator - stress).max() < 1e-12 * np.abs(stress).max()


def test_work_is_elastic_energy_plus_plastic_work() -> None:
    """The sum of the terms also equals the work if a step goes far beyond the yield stress: the work minus the plastic
    work is V s : s / 4 G.
    """
    L = np.diag([1.0, -0.5, -0.5]) * 1e3
    for steps in (20, 200):
        point = drive(COPPER, L, 1e-4 / steps, steps)
        volume = float(np.linalg.det(point.corners()[0, 1:] - point.corners()[0, 0])) / 6.0
        elastic = float((point.deviator**2).sum()) / (4.0 * SHEAR) * volume
        assert abs(float(point.get(WORK)[0] - point.get(WORK_PLASTIC)[0]) - elastic) / elastic < 1e-3
