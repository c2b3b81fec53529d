"""V12: one tet of Johnson-Cook metal under constant rates is compared with its differential equation, integrated to
1e-8.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conoid.cases.model.materials import JohnsonCook
from conoid.worker.model.rows import PLASTIC_STRAIN, TEMPERATURE

from ..worker import formulas
from ..worker.kernels import STEEL_42CRMO4, drive
from ..worker.meshes import Floats
from .convergence import assert_converges

assert isinstance(STEEL_42CRMO4.strength, JohnsonCook)
LAW = STEEL_42CRMO4.strength
SHEAR = 206.9e9 / 2.6
HEAT = LAW.taylor_quinney / (LAW.specific_heat * STEEL_42CRMO4.density)
SPAN = LAW.melt_temperature - LAW.reference_temperature
ROOM = 293.15

PATHS = {
    "uniaxial stretch": np.diag([1.0, -0.5, -0.5]),
    "uniaxial strain": np.diag([-1.0, 0.0, 0.0]),
    "pure shear": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) * 3.0**0.5 / 2.0,
    "simple shear": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) * 3.0**0.5,
}
"""Velocity gradients with an equivalent deviatoric rate of about one."""


def plastic_rate(q: float, strain: float, temperature: float) -> float:
    """Returns the plastic rate at which the law gives the stress q; zero below the flow stress at the reference
    rate."""
    soft = 1.0 - max((temperature - LAW.reference_temperature) / SPAN, 0.0) ** LAW.m
    over = q / ((LAW.A + LAW.B * max(strain, 0.0) ** LAW.n) * soft) - 1.0
    return float(LAW.reference_rate * np.exp(min(over / LAW.C, 30.0))) if over > 0.0 else 0.0


def integrated(L: Floats, time: float) -> tuple[float, float, float]:
    """Returns the Mises stress, the plastic strain and the temperature after ``time`` from s' = 2 G (dev D - 3/2 e' s /
    q) + W s - s W. The unknowns of the equation are of order one: s in GPa, the strain, the temperature in 1000 K. The
    integration stops at first yield and continues from this time.
    """
    rate, spin = formulas.deviator(L[None])[0], 0.5 * (L - L.T)

    def stress(y: Floats) -> float:
        return math.sqrt(1.5 * float(y[:9] @ y[:9])) * 1e9

    def slope(_: float, y: Floats) -> Floats:
        s, q = y[:9].reshape(3, 3), stress(y)
        flow = plastic_rate(q, y[9], y[10] * 1e3)
        change = 2e-9 * SHEAR * rate + spin @ s - s @ spin - 3e9 * SHEAR * flow / max(q, 1.0) * s * 1e-9
        return np.array([*change.ravel(), flow, HEAT * q * flow * 1e-3])

    def yields(_: float, y: Floats) -> float:
        return stress(y) / LAW.A - 1.0

    yields.terminal = True  # type: ignore[attr-defined]
    start = np.array([*np.zeros(9), 0.0, ROOM * 1e-3])
    elastic = solve_ivp(
        slope, (0.0, time), start, "DOP853", rtol=1e-12, atol=1e-12, events=yields, max_step=1e-3 * time
    )
    begin, state = elastic.t[-1], elastic.y[:, -1]
    end = solve_ivp(slope, (begin, time), state, "LSODA", rtol=1e-8, atol=1e-11, first_step=1e-9 * time).y[:, -1]
    return stress(end), float(end[9]), float(end[10]) * 1e3


def point(L: Floats, time: float, steps: int) -> tuple[float, float, float]:
    patch = drive(STEEL_42CRMO4, L, time / steps, steps, temperature=ROOM)
    return (
        float(formulas.mises(patch.deviator)[0]),
        float(patch.get(PLASTIC_STRAIN)[0]),
        float(patch.get(TEMPERATURE)[0]),
    )


@pytest.mark.parametrize(("path", "rate"), [*((path, 1e4) for path in PATHS), ("uniaxial strain", 1e6)])
def test_one_tet_follows_the_differential_equation(path: str, rate: float) -> None:
    """Stress, plastic strain and temperature agree within 1e-4 for a strain of 0.5 in 4,000 steps."""
    L, time = PATHS[path] * rate, 0.5 / rate
    stress, strain, temperature = point(L, time, 4000)
    expected = integrated(L, time)
    assert stress == pytest.approx(expected[0], rel=1e-4)
    assert strain == pytest.approx(expected[1], rel=1e-4)
    assert temperature - ROOM == pytest.approx(expected[2] - ROOM, rel=1e-4)
    assert temperature > ROOM + 80.0


def test_the_return_converges_with_the_step() -> None:
    L, time = PATHS["uniaxial stretch"] * 1e4, 0.5e-4
    exact = integrated(L, time)[0]
    assert_converges("johnson_cook_point", [abs(point(L, time, n)[0] / exact - 1.0) for n in (500, 1000, 2000, 4000)])
