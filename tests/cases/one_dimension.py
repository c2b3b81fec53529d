"""A rod of linear elements in one dimension whose joints break: reference results for fracture cases, in plain numpy.
Every element of the rod has two separate nodes, each with half of its mass. A joint makes two nodes move together until
it breaks; a broken joint is a cohesive law and an inelastic contact.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass
class History:
    """Values of the rod at each step: ``t``, s; velocity of the last element, m/s; mean stress, Pa; number of failed
    joints.
    """

    t: Floats
    end: Floats
    stress: Floats
    apart: Floats


def broken_rod(
    h: float, v: Floats, modulus: float, density: float, strength: Floats, energy: float, end: float,
    viscosity: tuple[float, float] = (0.0, 0.0), held: bool = False, step: float = 0.2,
) -> History:  # fmt: skip
    """Returns the history of a rod: elements of length ``h``, m; initial velocities ``v`` (n, 2) of the nodes of each
    element; ``strength`` (n - 1,) of joints. A joint breaks when the mean stress of its two elements reaches its
    strength. The cohesive traction falls linearly until the energy ``energy``, J/m^2, is absorbed, and unloads along
    the secant. ``viscosity``: linear and quadratic coefficient, in compression only. ``held``: whether the ends of the
    rod keep their velocities.
    """
    c, v, u = (modulus / density) ** 0.5, v.copy(), np.zeros_like(v)
    dt, half, ends = step * h / c, 0.5 * density * h, (v[0, 0], v[-1, 1])
    critical = np.maximum(2.0 * energy / np.maximum(strength, 1e-30), 1e-30)
    joined, widest, rows = np.ones(len(strength), bool), np.zeros(len(strength)), []
    for i in range(round(end / dt)):
        rate = np.minimum((v[:, 1] - v[:, 0]) / h, 0.0)
        stress = modulus * (u[:, 1] - u[:, 0]) / h
        joined &= 0.5 * (stress[1:] + stress[:-1]) < strength
        total = stress - density * h * (viscosity[1] * h * rate**2 - viscosity[0] * c * rate)
        opening = u[1:, 0] - u[:-1, 1]
        widest = np.where(joined, 0.0, np.maximum(widest, opening))
        holds = ~joined & (widest < critical) & (opening >= 0.0)
        secant = np.divide(opening, widest, out=np.ones_like(opening), where=widest > 0.0)
        traction = np.where(holds, strength, 0.0) * secant * (1.0 - np.minimum(widest / critical, 1.0))
        force = np.stack([total, -total], axis=1)
        force[:-1, 1] += traction
        force[1:, 0] -= traction
        v += dt / half * force
        gap = opening + dt * (v[1:, 0] - v[:-1, 1])
        push = np.where(joined | (gap < 0.0), -gap / dt / 2.0, 0.0)
        v[:-1, 1] -= push
        v[1:, 0] += push
        if held:
            v[0, 0], v[-1, 1] = ends
        u += dt * v
        rows.append((i * dt + dt, v[-1].mean(), stress.mean(), np.sum(~joined & (widest >= critical))))
    return History(*np.array(rows).T)
