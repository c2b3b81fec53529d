"""The logarithm and the exponential of the worker are accurate, and equal in vector code and in scalar code."""

import numpy as np
import pytest

from conoid.worker.materials import elementary
from conoid.worker.model.state import CHUNK

from .meshes import Floats

REACHES = [(-690.0, 690.0), (-20.0, 5.0), (-1.0, 1.0), (-0.01, 0.01), (-1e-12, 1e-12)]


def logarithms(x: Floats) -> Floats:
    w = np.zeros(CHUNK)
    w[: len(x)] = x
    elementary.logarithms(w, 0, len(x))
    return w[: len(x)]


def powers(x: Floats) -> Floats:
    w = np.zeros(CHUNK)
    w[: len(x)] = x
    elementary.powers(w, 0, len(x), 1.0)
    return w[: len(x)]


@pytest.mark.parametrize("reach", REACHES)
def test_they_are_right_to_the_last_bits(reach: tuple[float, float]) -> None:
    """The reference values have the 80 bits of a long double."""
    random = np.random.default_rng(1)
    for _ in range(100):
        y = random.uniform(*reach, CHUNK)
        true = np.exp(y.astype(np.longdouble))
        assert float(np.abs((powers(y) - true) / true).max()) < 3e-16
        x = true.astype(np.float64)
        near = np.log(x.astype(np.longdouble))
        assert float(np.abs(logarithms(x) - near).max()) <= 4e-16 * max(float(np.abs(near).max()), 1e-300)


@pytest.mark.parametrize("reach", [(-690.0, 0.0), (-2.0, 2.0), (-1e-3, 1e-3), (-1e-12, 1e-12)])
def test_what_an_exponential_exceeds_one_by_is_right_to_the_last_bits(reach: tuple[float, float]) -> None:
    y = np.random.default_rng(3).uniform(*reach, 20_000)
    found = np.array([elementary.exp_less_one(v) for v in y])
    true = np.expm1(y.astype(np.longdouble))
    assert float(np.abs((found - true) / true).max()) < 5e-16


def test_powers_of_one_number_are_right_to_what_their_exponent_makes_of_a_rounding() -> None:
    random = np.random.default_rng(4)
    x, exponent = np.exp(random.uniform(-40.0, 5.0, 5_000)), random.uniform(0.02, 2.0, 5_000)
    found = np.array([elementary.power(a, b) for a, b in zip(x, exponent, strict=True)])
    true = x.astype(np.longdouble) ** exponent
    assert float(np.abs((found - true) / true).max()) < 2.0 * 40.0 * 5e-16
    assert elementary.power(0.0, 0.3) == 0.0


def test_every_lane_gives_the_same_result() -> None:
    random = np.random.default_rng(2)
    x = np.exp(random.uniform(-600.0, 600.0, CHUNK))
    y = np.log(x)
    together, raised = logarithms(x), powers(y)
    alone = np.array([logarithms(x[k : k + 1])[0] for k in range(CHUNK)])
    assert np.array_equal(together, alone)
    assert np.array_equal(raised, np.array([powers(y[k : k + 1])[0] for k in range(CHUNK)]))
    assert [elementary.log(v) for v in x[:50]] == together[:50].tolist()
    assert [elementary.exp(v) for v in y[:50]] == raised[:50].tolist()


def test_what_is_exact_stays_exact() -> None:
    assert elementary.log(1.0) == 0.0
    assert elementary.exp(0.0) == 1.0
    assert elementary.log(2.0**-1000) == pytest.approx(-1000 * np.log(2.0), rel=1e-15)
    assert elementary.exp_less_one(0.0) == 0.0
    assert elementary.exp_less_one(-np.inf) == elementary.exp_less_one(-800.0) == -1.0
    assert powers(np.array([-1e9]))[0] == pytest.approx(np.exp(elementary.LEAST), rel=1e-12)
