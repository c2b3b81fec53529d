"""Solution of the Taylor bars by another method: axisymmetric quadrilaterals.

The elements are quads of four nodes with 2 x 2 integration points for the deviator and one pressure for each quad (mean
dilatation); such quads do not lock. The material is J2-plastic, the time integration is leapfrog, and the bar hits a
rigid frictionless wall at z = 0. The program shares no code with the worker. Masses, volumes and forces are per radian
of the circumference.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from .table import Cell, table

Floats = npt.NDArray[np.float64]

LENGTH, RADIUS, END = 32.4e-3, 3.2e-3, 80e-6
LINEAR, SHOCK, QUADRATIC, HALF = 0.06, 0.4, 1.5, 0.01
"""Coefficients of the bulk viscosity, equal to those of the shipped cases."""
SAFETY = 0.8


class Metal(NamedTuple):
    """Constants of a metal, SI units. The flow stress is (A + B e^n) (1 + C ln(rate / 1 s^-1)) (1 - T*^m); T* is 0 at
    ``cold`` and 1 at ``melt``."""

    speed: float
    density: float
    bulk: float
    shear: float
    A: float
    B: float
    n: float
    C: float
    m: float
    cold: float
    melt: float
    heat: float
    """Rise of temperature per plastic work, K per J/m^3."""


METALS = {
    "taylor_copper": Metal(227.0, 8930.0, 117e9 / 0.9, 117e9 / 2.7, 0.4e9, 0.1e9, 1.0, 0.0, 1.0, 293.15, 1e9, 0.0),
    "taylor_42crmo4": Metal(
        287.0,
        7830.0,
        206.9e9 / 1.2,
        206.9e9 / 2.6,
        806e6,
        614e6,
        0.168,
        0.0089,
        1.1,
        293.15,
        1813.15,
        0.9 / (7830.0 * 460.0),
    ),
}

_G = 1.0 / math.sqrt(3.0)
_U, _V = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
"""Natural coordinates of the corners of a quad; the integration points are at _G times the corners."""
_N = 0.25 * (1.0 + _G * np.outer(_U, _U)) * (1.0 + _G * np.outer(_V, _V))
_DU, _DV = 0.25 * _U * (1.0 + _G * np.outer(_V, _V)), 0.25 * _V * (1.0 + _G * np.outer(_U, _U))
"""Shape functions of a quad and their derivatives, (point, corner)."""


@njit
def _gradients(x, v, h, quad, g, hoop, weight):  # type: ignore[no-untyped-def]
    """Sets the gradients at x - h v, N / r, and the weights of the integration points, m^3 per radian. Returns the
    volume of the quad, or -1 for an inverted quad.
    """
    volume = 0.0
    for p in range(4):
        a, b, c, d, r = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(4):
            xr, xz = x[quad[k], 0] - h * v[quad[k], 0], x[quad[k], 1] - h * v[quad[k], 1]
            a += _DU[p, k] * xr
            b += _DU[p, k] * xz
            c += _DV[p, k] * xr
            d += _DV[p, k] * xz
            r += _N[p, k] * xr
        det = a * d - b * c
        if det <= 0.0:
            return -1.0
        weight[p] = det * r
        volume += weight[p]
        for k in range(4):
            g[p, k, 0] = (d * _DU[p, k] - b * _DV[p, k]) / det
            g[p, k, 1] = (a * _DV[p, k] - c * _DU[p, k]) / det
            hoop[p, k] = _N[p, k] / r
    return volume


@njit
def _flow(metal, strain, rate, temperature):  # type: ignore[no-untyped-def]
    warm = min(max((temperature - metal.cold) / (metal.melt - metal.cold), 0.0), 1.0)
    return (
        (metal.A + metal.B * strain**metal.n)
        * (1.0 + metal.C * math.log(max(rate, 1.0)))
        * (1.0 - (warm**metal.m if warm > 0.0 else 0.0))
    )


@njit
def _growth(metal, mises, strain, temperature, dt):  # type: ignore[no-untyped-def]
    """Returns the increment of plastic strain at which the flow stress is equal to the relaxed trial stress (method of
    false position)."""
    low, high = 0.0, mises / (3.0 * metal.shear)
    below, above = mises - _flow(metal, strain, 0.0, temperature), -_flow(metal, strain + high, high / dt, temperature)
    for _ in range(100):
        grown = (low * above - high * below) / (above - below)
        rest = mises - 3.0 * metal.shear * grown - _flow(metal, strain + grown, grown / dt, temperature)
        if abs(rest) < 1e-9 * mises:
            break
        if rest > 0.0:
            low, below, above = grown, rest, 0.5 * above
        else:
            high, above, below = grown, rest, 0.5 * below
    return grown


@njit
def _return(metal, s, strain, temperature, p, grad, around, dt):  # type: ignore[no-untyped-def]
    """Updates the deviator (rr, zz, tt, rz) at an integration point: rotation by the exact angle, elastic trial stress,
    radial return, heating."""
    mean = (grad[0, 0] + grad[1, 1] + around) / 3.0
    angle, twice = (grad[0, 1] - grad[1, 0]) * dt, 2.0 * metal.shear * dt
    half, cos, sin = 0.5 * (s[p, 0] - s[p, 1]), math.cos(angle), math.sin(angle)
    turned, sheared = half * cos + s[p, 3] * sin, s[p, 3] * cos - half * sin
    middle = 0.5 * (s[p, 0] + s[p, 1])
    s[p, 0] = middle + turned + twice * (grad[0, 0] - mean)
    s[p, 1] = middle - turned + twice * (grad[1, 1] - mean)
    s[p, 2] += twice * (around - mean)
    s[p, 3] = sheared + 0.5 * twice * (grad[0, 1] + grad[1, 0])
    mises = math.sqrt(1.5 * (s[p, 0] ** 2 + s[p, 1] ** 2 + s[p, 2] ** 2 + 2.0 * s[p, 3] ** 2))
    if mises > _flow(metal, strain[p], 0.0, temperature[p]):
        grown = _growth(metal, mises, strain[p], temperature[p], dt)
        strain[p] += grown
        temperature[p] += metal.heat * grown * (mises - 3.0 * metal.shear * grown)
        for k in range(4):
            s[p, k] *= 1.0 - 3.0 * metal.shear * grown / mises


@njit
def _forces(metal, x, v, quads, mass, stress, pressure, strain, temperature, force, dt):  # type: ignore[no-untyped-def]
    """Computes stress and forces at n+1. Returns the largest reciprocal of the stable steps, or -1 for an inverted
    quad."""
    force[:] = 0.0
    limit = 0.0
    g, hoop, weight, grad = np.empty((4, 4, 2)), np.empty((4, 4)), np.empty(4), np.empty((2, 2))
    for e in range(len(quads)):
        quad, dilatation = quads[e], 0.0
        volume = _gradients(x, v, 0.5 * dt, quad, g, hoop, weight)
        if volume < 0.0:
            return -1.0
        for p in range(4):
            grad[:] = 0.0
            around = 0.0
            for k in range(4):
                for i in range(2):
                    for j in range(2):
                        grad[i, j] += v[quad[k], i] * g[p, k, j]
                around += v[quad[k], 0] * hoop[p, k]
            dilatation += weight[p] / volume * (grad[0, 0] + grad[1, 1] + around)
            _return(metal, stress[e], strain[e], temperature[e], p, grad, around, dt)
        pressure[e] -= metal.bulk * dilatation * dt
        volume = _gradients(x, v, 0.0, quad, g, hoop, weight)
        if volume < 0.0:
            return -1.0
        steepest = 0.0
        for p in range(4):
            steepest = max(steepest, (g[p] * g[p]).sum())
        steepest, density, rate = math.sqrt(steepest), mass[e] / volume, max(-dilatation, 0.0)
        c = math.sqrt((metal.bulk + 4.0 / 3.0 * metal.shear) / density)
        u = rate / steepest
        share = u / (u + HALF * c)
        q = density * u * ((LINEAR + SHOCK * share) * c + QUADRATIC * u)
        tangent = (LINEAR + SHOCK * share * (2.0 - share)) * c + 2.0 * QUADRATIC * u if rate > 0.0 else 0.0
        limit = max(limit, steepest * (tangent + math.sqrt(tangent * tangent + c * c)))
        for p in range(4):
            s, all_round = stress[e, p], pressure[e] + q
            for k in range(4):
                gr, gz, a = g[p, k, 0], g[p, k, 1], quad[k]
                force[a, 0] -= weight[p] * (s[0] * gr + s[3] * gz + s[2] * hoop[p, k] - all_round * (gr + hoop[p, k]))
                force[a, 1] -= weight[p] * (s[3] * gr + s[1] * gz - all_round * gz)
    return limit


@njit
def _move(x, v, force, mass, mean_dt, dt):  # type: ignore[no-untyped-def]
    """Updates velocities and positions, and applies the conditions on the axis and on the wall."""
    for i in range(len(x)):
        v[i] += mean_dt / mass[i] * force[i]
        if x[i, 0] == 0.0:
            v[i, 0] = 0.0
        if x[i, 1] + dt * v[i, 1] < 0.0:
            v[i, 1] = -x[i, 1] / dt
        x[i] += dt * v[i]


@dataclass(frozen=True)
class Bar:
    """Shape and state of the bar at the end of the run; lengths in m."""

    bar: str
    cells: int
    """Number of cells along the radius."""
    quads: int
    steps: int
    length: float
    radius: float
    strain: float
    """Largest plastic strain at an integration point."""
    foot_strain: float
    """Mean plastic strain over the quads that are initially within 0.6 mm of the centre of the foot."""
    foot_temperature: float
    """Mean temperature over the quads that are initially within 0.6 mm of the centre of the foot, K."""


def run(bar: str, cells: int) -> Bar:
    """Computes a bar with ``cells`` cells along the radius and cells of the same size along its length."""
    metal, layers = METALS[bar], round(cells * LENGTH / RADIUS)
    r, z = np.linspace(0.0, RADIUS, cells + 1), np.linspace(0.0, LENGTH, layers + 1)
    x = np.stack(np.meshgrid(r, z, indexing="xy"), axis=-1).reshape(-1, 2)
    corner = (np.arange(layers)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1, 1)
    quads = corner + np.array([0, 1, cells + 2, cells + 1])
    shares = _N * (x[quads, 0] @ _N.T)[:, :, None] * (metal.density * 0.25 * (RADIUS / cells) * (LENGTH / layers))
    mass, quad_mass = np.bincount(quads.reshape(-1), shares.sum(axis=1).reshape(-1)), shares.sum(axis=(1, 2))
    foot = (x[quads].mean(axis=1) < 0.6e-3).all(axis=1)
    v, force = np.zeros_like(x), np.zeros_like(x)
    v[:, 1] = -metal.speed
    stress, pressure = np.zeros((len(quads), 4, 4)), np.zeros(len(quads))
    strain, temperature = np.zeros((len(quads), 4)), np.full((len(quads), 4), 293.15)
    t, dt, steps = 0.0, math.inf, 0
    limit = _forces(metal, x, v, quads, quad_mass, stress, pressure, strain, temperature, force, 0.0)
    while t < END:
        old = dt if steps else 0.0
        dt = min(SAFETY / limit, 1.05 * dt, END - t)
        _move(x, v, force, mass, 0.5 * (old + dt), dt)
        limit = _forces(metal, x, v, quads, quad_mass, stress, pressure, strain, temperature, force, dt)
        t, steps = t + dt, steps + 1
        if limit < 0.0:
            raise ArithmeticError(f"a quad turned inside out at {t * 1e6:.1f} us")
    return Bar(
        bar, cells, len(quads), steps, float(np.ptp(x[:, 1])), float(x[:, 0].max()), float(strain.max()),
        _mean(strain, quad_mass, foot), _mean(temperature, quad_mass, foot),
    )  # fmt: skip


def _mean(values: Floats, mass: Floats, chosen: npt.NDArray[np.bool_]) -> float:
    return float(np.average(values.mean(axis=1)[chosen], weights=mass[chosen])) if chosen.any() else math.nan


def report(bars: Sequence[Bar]) -> str:
    """Returns a table with one row for each mesh."""
    rows: list[list[Cell]] = [
        [
            b.bar, 1e3 * RADIUS / b.cells, b.quads, b.steps, f"{1e3 * b.length:.3f}", f"{1e3 * b.radius:.3f}",
            f"{b.strain:.2f}", f"{b.foot_strain:.2f}", f"{b.foot_temperature:.0f}",
        ]
        for b in bars
    ]  # fmt: skip
    head = [
        "bar",
        "mm",
        "quads",
        "steps",
        "length mm",
        "radius mm",
        "largest strain",
        "foot strain",
        "foot temperature",
    ]
    return f"Axisymmetric quads, by a code of its own:\n\n{table(head, rows)}"
