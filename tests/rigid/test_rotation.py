"""Free rotation: conserved quantities; the period is compared with elliptic integrals."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from conoid.worker.rigid import rotation

INERTIA = np.array([1.0, 2.0, 2.5])
"""Principal moments of inertia, kg m^2."""
STEPS, DT = 100_000, 0.002


class Top:
    """A body that turns freely, with its principal axes along x, y, z at the start."""

    def __init__(self, rate: tuple[float, float, float], moments: np.ndarray = INERTIA) -> None:
        self.q = np.array([[1.0, 0.0, 0.0, 0.0]])
        self.momentum = (moments * np.array(rate))[None]
        self.rotation = np.empty((1, 3, 3))
        self.inverse = np.diag(1.0 / moments)[None]
        self._which = np.zeros(1, np.int64)
        rotation.turns_of(self.rotation, self.q)

    def turn(self, dt: float) -> None:
        rotation.turn(self.q, self.momentum, self.rotation, self.inverse, self._which, dt)
        rotation.turns_of(self.rotation, self.q)

    @property
    def body(self) -> np.ndarray:
        """Returns (3,) the angular momentum in the frame of the body."""
        return np.asarray(self.rotation[0].T @ self.momentum[0])

    @property
    def energy(self) -> float:
        return float(0.5 * self.body @ self.inverse[0] @ self.body)


def flips(top: Top, dt: float, steps: int) -> list[float]:
    """Returns the times, s, at which the rotation rate about the middle axis changes its sign."""
    found, last = [], top.body[1]
    for k in range(1, steps + 1):
        top.turn(dt)
        now = top.body[1]
        if now * last < 0.0:
            found.append(dt * (k - 1 + last / (last - now)))
        last = now
    return found


def half_period(rate: tuple[float, float, float], moments: np.ndarray = INERTIA) -> float:
    """Returns the time between two flips, s: 2 K(m) over the rate of the phase (Landau and Lifshitz, Mechanics, section
    37). The axes are swapped if twice the energy is below the square of the angular momentum over the middle moment.
    """
    a, b, c = moments
    w = np.array(rate)
    twice, square = float((moments * w**2).sum()), float(((moments * w) ** 2).sum())
    if square < twice * b:
        a, c = c, a
    k = math.sqrt(abs((c - b) * (twice * a - square)) / (a * b * c))
    m = (b - a) * (twice * c - square) / ((c - b) * (square - twice * a))
    return float(2.0 * ellipk(m) / k)


def test_a_free_top_keeps_angular_momentum_and_energy() -> None:
    """Angular momentum is constant to 1e-12 and energy to 1e-9 over 100,000 steps, about the unstable axis; the
    matrix remains a rotation."""
    top = Top((1e-3, 5.0, 2e-3))
    start, before, worst = top.momentum.copy(), top.energy, 0.0
    for k in range(STEPS):
        top.turn(DT)
        if k % 100 == 0:
            worst = max(worst, abs(top.energy - before))
    assert np.abs(top.momentum - start).max() <= 1e-12 * np.abs(start).max()
    assert worst < 1e-9 * before
    assert top.rotation[0] @ top.rotation[0].T == pytest.approx(np.eye(3), abs=1e-14)


@pytest.mark.parametrize("rate", [(0.05, 5.0, 0.0), (0.0, 5.0, 0.1), (0.5, 3.0, 1.0)])
def test_a_top_flips_with_the_period_of_elliptic_integrals(rate: tuple[float, float, float]) -> None:
    """The period agrees with the integrals to 1e-4, and the error is proportional to the square of the step."""
    exact, errors = half_period(rate), []
    for dt in (0.008, 0.004):
        times = flips(Top(rate), dt, int(6.2 * exact / dt))
        errors.append(abs((times[-1] - times[0]) / (len(times) - 1) / exact - 1.0))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)


def test_a_step_back_undoes_a_step() -> None:
    top = Top((1.0, 2.0, 3.0))
    start = top.q.copy()
    for dt in (0.03, 0.05, -0.05, -0.03):
        top.turn(dt)
    assert top.q == pytest.approx(start, abs=1e-15)
