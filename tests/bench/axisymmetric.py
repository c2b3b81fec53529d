"""An answer for the copper Taylor bar from another element altogether: axisymmetric quadrilaterals.

Four-node quads with 2 x 2 points for the deviator and one pressure for each quad (mean dilatation), which do not lock;
J2 plasticity with linear hardening, leapfrog, a rigid frictionless wall at z = 0. It shares no code with the worker.
Masses, volumes and forces are per radian of the circumference.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from .table import Cell, table

Floats = npt.NDArray[np.float64]

LENGTH, RADIUS, SPEED, END = 32.4e-3, 3.2e-3, 227.0, 80e-6
DENSITY, YOUNG, POISSON, YIELD, HARDENING = 8930.0, 117e9, 0.35, 0.4e9, 0.1e9
BULK, SHEAR = YOUNG / (3.0 * (1.0 - 2.0 * POISSON)), YOUNG / (2.0 * (1.0 + POISSON))
LINEAR, QUADRATIC = 0.06, 1.5
SAFETY = 0.8

_G = 1.0 / math.sqrt(3.0)
_U, _V = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
"""Corners of the quad; the points lie at _G times them."""
_N = 0.25 * (1.0 + _G * np.outer(_U, _U)) * (1.0 + _G * np.outer(_V, _V))
_DU, _DV = 0.25 * _U * (1.0 + _G * np.outer(_V, _V)), 0.25 * _V * (1.0 + _G * np.outer(_U, _U))
"""(point, corner) shape functions and their derivatives."""


@njit
def _gradients(x, v, h, quad, g, hoop, weight):  # type: ignore[no-untyped-def]
    """Gradients at x - h v, N / r, weights, m^3 per radian; returns the volume, or -1 where the quad is inside out."""
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
def _return(s, strain, p, grad, around, dt):  # type: ignore[no-untyped-def]
    """Deviator (rr, zz, tt, rz) at a point: rotation by the exact angle, elastic trial, radial return."""
    mean = (grad[0, 0] + grad[1, 1] + around) / 3.0
    angle = (grad[0, 1] - grad[1, 0]) * dt
    half, cos, sin = 0.5 * (s[p, 0] - s[p, 1]), math.cos(angle), math.sin(angle)
    turned, sheared = half * cos + s[p, 3] * sin, s[p, 3] * cos - half * sin
    middle = 0.5 * (s[p, 0] + s[p, 1])
    s[p, 0] = middle + turned + 2.0 * SHEAR * dt * (grad[0, 0] - mean)
    s[p, 1] = middle - turned + 2.0 * SHEAR * dt * (grad[1, 1] - mean)
    s[p, 2] += 2.0 * SHEAR * dt * (around - mean)
    s[p, 3] = sheared + SHEAR * dt * (grad[0, 1] + grad[1, 0])
    mises = math.sqrt(1.5 * (s[p, 0] ** 2 + s[p, 1] ** 2 + s[p, 2] ** 2 + 2.0 * s[p, 3] ** 2))
    flow = YIELD + HARDENING * strain[p]
    if mises > flow:
        grown = (mises - flow) / (3.0 * SHEAR + HARDENING)
        strain[p] += grown
        for k in range(4):
            s[p, k] *= 1.0 - 3.0 * SHEAR * grown / mises


@njit
def _forces(x, v, quads, mass, stress, pressure, strain, force, dt):  # type: ignore[no-untyped-def]
    """Stress and forces at n+1; returns the largest one-over-stable-step, -1 when a quad is inside out."""
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
            _return(stress[e], strain[e], p, grad, around, dt)
        pressure[e] -= BULK * dilatation * dt
        volume = _gradients(x, v, 0.0, quad, g, hoop, weight)
        if volume < 0.0:
            return -1.0
        steepest = 0.0
        for p in range(4):
            steepest = max(steepest, (g[p] * g[p]).sum())
        steepest, density, rate = math.sqrt(steepest), mass[e] / volume, max(-dilatation, 0.0)
        c = math.sqrt((BULK + 4.0 / 3.0 * SHEAR) / density)
        q = density / steepest * rate * (LINEAR * c + QUADRATIC * rate / steepest)
        tangent = LINEAR * c + 2.0 * QUADRATIC * rate / steepest if rate > 0.0 else 0.0
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
    """Velocities, the axis, the wall, positions."""
    for i in range(len(x)):
        v[i] += mean_dt / mass[i] * force[i]
        if x[i, 0] == 0.0:
            v[i, 0] = 0.0
        if x[i, 1] + dt * v[i, 1] < 0.0:
            v[i, 1] = -x[i, 1] / dt
        x[i] += dt * v[i]


@dataclass(frozen=True)
class Bar:
    """The bar at the end; lengths in m."""

    cells: int
    """Along the radius."""
    quads: int
    steps: int
    length: float
    radius: float
    strain: float
    """Largest plastic strain at a point."""


def run(cells: int) -> Bar:
    """The bar with ``cells`` cells along the radius and cells of the same size along its length."""
    layers = round(cells * LENGTH / RADIUS)
    r, z = np.linspace(0.0, RADIUS, cells + 1), np.linspace(0.0, LENGTH, layers + 1)
    x = np.stack(np.meshgrid(r, z, indexing="xy"), axis=-1).reshape(-1, 2)
    corner = (np.arange(layers)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1, 1)
    quads = corner + np.array([0, 1, cells + 2, cells + 1])
    shares = _N * (x[quads, 0] @ _N.T)[:, :, None] * (DENSITY * 0.25 * (RADIUS / cells) * (LENGTH / layers))
    mass = np.bincount(quads.reshape(-1), shares.sum(axis=1).reshape(-1))
    quad_mass = shares.sum(axis=(1, 2))
    v, force = np.zeros_like(x), np.zeros_like(x)
    v[:, 1] = -SPEED
    stress, pressure, strain = np.zeros((len(quads), 4, 4)), np.zeros(len(quads)), np.zeros((len(quads), 4))
    t, dt, steps = 0.0, math.inf, 0
    limit = _forces(x, v, quads, quad_mass, stress, pressure, strain, force, 0.0)
    while t < END:
        old = dt if steps else 0.0
        dt = min(SAFETY / limit, 1.05 * dt, END - t)
        _move(x, v, force, mass, 0.5 * (old + dt), dt)
        limit = _forces(x, v, quads, quad_mass, stress, pressure, strain, force, dt)
        t, steps = t + dt, steps + 1
        if limit < 0.0:
            raise ArithmeticError(f"a quad turned inside out at {t * 1e6:.1f} us")
    return Bar(cells, len(quads), steps, float(np.ptp(x[:, 1])), float(x[:, 0].max()), float(strain.max()))


def report(bars: Sequence[Bar]) -> str:
    """One line a mesh."""
    rows: list[list[Cell]] = [
        [1e3 * RADIUS / b.cells, b.quads, b.steps, f"{1e3 * b.length:.3f}", f"{1e3 * b.radius:.3f}", f"{b.strain:.2f}"]
        for b in bars
    ]
    head = ["mm", "quads", "steps", "length mm", "radius mm", "largest strain"]
    return f"taylor_copper with axisymmetric quads, by a code of its own:\n\n{table(head, rows)}"
