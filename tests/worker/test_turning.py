"""Sine and cosine without the C library."""

import math
from decimal import Decimal, getcontext

import numpy as np
import pytest

from conoid.worker.materials.turning import sine_and_cosine, sines_and_cosines


@pytest.mark.parametrize(
    "angle", [0.0, 1e-300, 1e-9, 0.1, -0.1, 1.0, math.pi / 2, 3.0, -20.0, 100.0, 158.65, -1e9, 1e22]
)
def test_sine_and_cosine_are_those_of_the_library_but_for_the_last_bit(angle: float) -> None:
    for mine, theirs in zip(sine_and_cosine(angle), (math.sin(angle), math.cos(angle)), strict=True):
        assert abs(mine - theirs) <= math.ulp(theirs)


def test_they_are_rounded_from_more_digits_than_a_float_has() -> None:
    getcontext().prec = 50
    sine, cosine = (Decimal(part) for part in sine_and_cosine(0.5))
    assert abs(sine - Decimal("0.47942553860420300027328793521557138808")) < Decimal(math.ulp(0.479)) / 2
    assert abs(cosine - Decimal("0.87758256189037271611628158260382965199")) < Decimal(math.ulp(0.877)) / 2


def test_those_of_many_angles_are_those_of_each() -> None:
    angles = np.array([[0.3, -2.0, 0.3], [0.0, 7.0, -2.0]])
    sines, cosines = sines_and_cosines(angles)
    each = np.array([sine_and_cosine(angle) for angle in angles.ravel().tolist()])
    assert np.array_equal(sines, each[:, 0].reshape(2, 3))
    assert np.array_equal(cosines, each[:, 1].reshape(2, 3))
    assert [part.shape for part in sines_and_cosines(np.zeros(0))] == [(0,), (0,)]
