"""The Johnson-Cook return compared with bisection, and with a million random states (H18 of the hard cases)."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from conoid.cases.model.materials import JohnsonCook
from conoid.worker.elements.scratch import TRIAL, VOLUME_MID
from conoid.worker.materials.johnson_cook import gather, increments, initial_yield
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.rows import FLOW, MASS, PLASTIC_STRAIN, TEMPERATURE, WORK_PLASTIC, YIELD
from conoid.worker.model.state import CHUNK

from . import formulas
from .kernels import STEEL_42CRMO4, Patch, drive
from .meshes import REGULAR, Floats, positive

assert isinstance(STEEL_42CRMO4.strength, JohnsonCook)
LAW = STEEL_42CRMO4.strength
Number = Floats | float
SHEAR = 206.9e9 / 2.6
HEAT = 0.9 / 460.0
ROUND_OFF = 1e-5
"""Stress error, Pa, due to the last bit of a temperature near melting, or due to 2 G D dt."""


def flow_stress(strain: Number, rate: Number, temperature: Number, law: JohnsonCook = LAW) -> Floats:
    """Returns (A + B e^n)(1 + C ln max(rate / rate_0, 1))(1 - T*^m), Pa."""
    span = law.melt_temperature - law.reference_temperature
    hot = np.clip((temperature - law.reference_temperature) / span, 0.0, 1.0)
    fast = 1.0 + law.C * np.log(np.maximum(rate / law.reference_rate, 1.0))
    return np.asarray((law.A + law.B * strain**law.n) * fast * (1.0 - hot**law.m))


def roots(q: Floats, strain: Floats, temperature: Floats, dt: float, density: Floats) -> Floats:
    """Returns plastic strain increments by bisection: the roots of q - 3 G d - flow stress(d) in [0, q / 3 G]."""
    low, high = np.zeros_like(q), q / (3.0 * SHEAR)
    for _ in range(70):
        d = 0.5 * (low + high)
        left = q - 3.0 * SHEAR * d
        above = left > flow_stress(strain + d, d / dt, temperature + HEAT / density * d * left)
        low, high = np.where(above, d, low), np.where(above, high, d)
    return np.asarray(0.5 * (low + high))


def random_states(n: int, seed: int) -> tuple[Patch, dict[str, Floats], float]:
    """Returns tets with random strain, temperatures up to and above melting, and a step in which the tets may yield.
    The strain increments are 1e-12 to 0.05, with steps of one size; every fifth state has no plastic strain, and every
    seventh is hotter than the melting point.
    """
    random = np.random.default_rng(seed)
    dt = 10.0 ** random.uniform(-9.0, -6.0)
    scale = 10.0 ** random.uniform(-4.0, -2.0, n)
    points = (REGULAR[None] * scale[:, None, None]).reshape(-1, 3)
    patch = Patch(TetMesh(points, positive(points, np.arange(4 * n).reshape(n, 4))), STEEL_42CRMO4)
    strain = np.where(np.arange(n) % 5 == 0, 0.0, 10.0 ** random.uniform(-8.0, 1.0, n))
    temperature = random.uniform(200.0, LAW.melt_temperature, n)
    near = np.arange(n) % 11 == 0
    temperature[near] = LAW.melt_temperature - 10.0 ** random.uniform(-9.0, 1.0, near.sum())
    hot = np.arange(n) % 7 == 0
    temperature[hot] = random.uniform(LAW.melt_temperature, 4000.0, hot.sum())
    static = flow_stress(strain, np.zeros(n), temperature)
    s = formulas.deviator(random.normal(size=(n, 3, 3)))
    s *= (random.uniform(0.0, 1.0, n) * static / formulas.mises(s))[:, None, None]
    D = formulas.deviator(random.normal(size=(n, 3, 3)))
    D *= (10.0 ** random.uniform(-12.0, -1.3, n) / dt / np.sqrt((D * D).sum(axis=(1, 2))))[:, None, None]
    patch.deviator = s
    patch.put(PLASTIC_STRAIN, strain)
    patch.put(TEMPERATURE, temperature)
    patch.put(YIELD, static)
    patch.put(FLOW, static * random.uniform(0.0, 2.0, n))
    volume, _ = formulas.gradients(patch.corners())
    patch.strain(D, dt)
    tried = s + 2.0 * SHEAR * dt * D
    before = {"strain": strain, "temperature": temperature, "static": static, "volume": volume, "old": s}
    before |= {"tried": tried, "trial": formulas.mises(tried)}
    return patch, {**before, "density": patch.get(MASS) / volume}, dt


def slope(strain: Floats, d: Floats, dt: float) -> Floats:
    """Returns the slope of the flow stress of cold metal with respect to the plastic increment, over 3 G; this slope is
    large at the start of hardening.
    """
    hardening = LAW.n * LAW.B * strain ** (LAW.n - 1.0) * (1.0 + LAW.C * np.log(np.maximum(d / dt, 1.0)))
    return np.asarray((hardening + np.where(d > dt, LAW.C * (LAW.A + LAW.B * strain**LAW.n) / d, 0.0)) / (3.0 * SHEAR))


@pytest.mark.parametrize("seed", range(10))
def test_a_hundred_thousand_random_states(seed: int) -> None:
    n = 100_000
    patch, before, dt = random_states(n, seed)
    patch.advance(dt)
    flowed, q = before["trial"] > before["static"] * (1 + 1e-12), formulas.mises(patch.deviator)
    increment = patch.get(PLASTIC_STRAIN) - before["strain"]
    rows = [patch.get(row) for row in (PLASTIC_STRAIN, TEMPERATURE, YIELD, FLOW, WORK_PLASTIC)]
    assert all(np.isfinite(row).all() for row in [*rows, q])
    assert (patch.get(YIELD) >= 0.0).all()
    assert (increment >= 0.0).all()
    assert not increment[before["trial"] < before["static"] * (1 - 1e-12)].any()
    assert 0.2 * n < flowed.sum() < 0.9 * n
    trial, strain, start = (before[name][flowed] for name in ("trial", "strain", "temperature"))
    q, end = q[flowed], patch.get(TEMPERATURE)[flowed]
    d = np.maximum((trial - q) / (3.0 * SHEAR), 1e-20)
    residual = q - flow_stress(strain + d, d / dt, end)
    assert (np.abs(residual) < (1e-8 * trial + ROUND_OFF) * (1.0 + slope(strain + d, d, dt))).all()
    assert (q[start >= LAW.melt_temperature] < 1e-8 * trial.max()).all()
    heat = HEAT / before["density"][flowed] * d * q
    assert (np.abs(end - start - heat) < 1e-6 * heat + 1e-11).all()
    new, old, tried = patch.deviator[flowed], before["old"][flowed], before["tried"][flowed]
    work = np.maximum(((old + new) * (tried - new)).sum(axis=(1, 2)) / (4.0 * SHEAR), 0.0)
    booked = patch.get(WORK_PLASTIC)[flowed] / before["volume"][flowed]
    assert (np.abs(booked - work) <= 1e-6 * d * trial + 1e-9).all()


def test_increments_equal_halved_brackets() -> None:
    patch, before, dt = random_states(20_000, 98)
    patch.advance(dt)
    root = roots(before["trial"], before["strain"], before["temperature"], dt, before["density"])
    error = np.abs(formulas.mises(patch.deviator) - (before["trial"] - 3.0 * SHEAR * root))
    flowed = before["trial"] > before["static"] * (1 + 1e-12)
    assert (error < 1e-8 * before["trial"] + ROUND_OFF)[flowed].all()


def test_small_increments_are_right_by_themselves() -> None:
    """The stress is right for plastic increments of any size. Tested increments include d = dt times the reference
    rate, where the rate term begins, and the first yield, where the flow stress rises a million times more steeply than
    the trial stress falls.
    """
    patch, before, dt = random_states(100_000, 97)
    patch.advance(dt)
    d = patch.get(PLASTIC_STRAIN) - before["strain"]
    known = (before["strain"] < 1e-3 * d) & (before["temperature"] < LAW.melt_temperature - 1.0) & (d > 1e-13)
    near = np.flatnonzero(known & (d > 0.1 * dt) & (d < 10.0 * dt))
    assert len(near) > 20
    for i in [*near, *np.flatnonzero(known)[::20]]:
        state = tuple(float(before[name][i]) for name in ("trial", "strain", "temperature", "density"))
        root = brentq(excess, 0.0, state[0] / (3.0 * SHEAR), (*state, dt), 1e-300, 1e-14, 2000)
        assert abs(d[i] - root) < 1e-6 * root + 1e-15


def test_increments_take_few_steps() -> None:
    """Trial stresses are 1 Pa to 2 GPa above the flow stress, with and without the rate term and previous plastic
    strain. The mean number of iterations is 5.7; bisection would need 40 iterations.
    """
    random = np.random.default_rng(5)
    params = Patch(TetMesh(REGULAR, np.arange(4, dtype=np.int32)[None]), STEEL_42CRMO4).block.params
    taken = []
    for _ in range(20):
        w, s = np.zeros((200, CHUNK)), np.zeros((40, CHUNK))
        strain = np.where(random.uniform(size=CHUNK) < 0.02, 0.0, 10.0 ** random.uniform(-6.0, 0.3, CHUNK))
        temperature = random.uniform(293.15, 1500.0, CHUNK)
        static = flow_stress(strain, np.zeros(CHUNK), temperature)
        s[PLASTIC_STRAIN], s[TEMPERATURE], s[YIELD], s[MASS] = strain, temperature, static, 7830.0
        s[FLOW] = static * (1.0 + LAW.C * random.uniform(0.0, 14.0, CHUNK))
        w[TRIAL // CHUNK] = static + 10.0 ** random.uniform(0.0, 9.3, CHUNK)
        w[VOLUME_MID // CHUNK] = 1.0
        m = gather(w.reshape(-1), s.reshape(-1), params, CHUNK)
        assert m == CHUNK
        taken.append(increments(w.reshape(-1), params, m, 1e-8) / m)
    assert np.mean(taken) < 7.0


def excess(d: float, q: float, strain: float, temperature: float, density: float, dt: float) -> float:
    """Returns the function whose root the return mapping finds."""
    left = q - 3.0 * SHEAR * d
    return float(left - flow_stress(strain + d, d / dt, temperature + HEAT / density * d * left))


def test_the_halved_brackets_agree_with_scipy() -> None:
    _, before, dt = random_states(300, 99)
    found = roots(before["trial"], before["strain"], before["temperature"], dt, before["density"])
    solid = before["temperature"] < LAW.melt_temperature - 1.0
    for i in np.flatnonzero(solid & (before["trial"] > before["static"])):
        q, strain, temperature, density = (before[name][i] for name in ("trial", "strain", "temperature", "density"))

        root = brentq(excess, 0.0, q / (3.0 * SHEAR), (q, strain, temperature, density, dt), 1e-300, 1e-15, 500)
        assert abs(found[i] - root) <= 1e-12 * q / (3.0 * SHEAR)


def test_no_flow_below_the_static_flow_stress() -> None:
    """At rates below the reference rate the law has no rate term: yield starts at the stress A."""
    rate = 0.5
    L = np.array([[0.0, rate, 0.0], [rate, 0.0, 0.0], [0.0, 0.0, 0.0]])
    strain_at_yield = LAW.A / (3.0 * SHEAR) / (2.0 * rate / 3.0**0.5)
    below = drive(STEEL_42CRMO4, L, strain_at_yield * 0.999 / 10, 10, temperature=293.15)
    above = drive(STEEL_42CRMO4, L, strain_at_yield * 1.001 / 10, 10, temperature=293.15)
    assert below.get(PLASTIC_STRAIN)[0] == 0.0
    assert above.get(PLASTIC_STRAIN)[0] > 0.0


def test_initial_yield_is_the_flow_stress_at_no_strain() -> None:
    for temperature in (0.0, 293.15, 1000.0, 1813.15, 3000.0):
        expected = flow_stress(0.0, 0.0, temperature)
        assert math.isclose(initial_yield(LAW, temperature), float(expected), rel_tol=1e-14, abs_tol=1e-6)
