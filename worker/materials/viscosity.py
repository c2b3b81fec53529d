"""Bulk viscosity, and what it takes from the stable step."""

import numpy as np

from ..elements.tet4 import AREAS, CHANGE, LENGTH_FACTOR, LIMIT, MODULUS, VOLUME
from ..jit import njit
from ..state import CHUNK, MASS, VISCOUS, WORK_VISCOUS

_Q, _MASS, _WORK = VISCOUS * CHUNK, MASS * CHUNK, WORK_VISCOUS * CHUNK


@njit("void(float64[::1], float64[::1], int64, float64, float64, float64)", cache=True, error_model="numpy")
def bulk_viscosity(w, s, n, linear, quadratic, rate_of_change):  # type: ignore[no-untyped-def]
    """q = density l |rate| (linear c + quadratic l |rate|) in compression, Pa; its work; LIMIT, 1/s.

    von Neumann and Richtmyer 1950 (quadratic), Landshoff 1955 (linear). ``rate_of_change`` turns CHANGE into a volume
    flux, 1/s. With G = sqrt(sum |grad N|^2) and Q the tangent (linear c + 2 quadratic l |rate|) the largest stable
    step is 1 / (G (G l Q + sqrt((G l Q)^2 + c^2))), derived in docs/numerics.md; l = LENGTH_FACTOR / G.
    """
    for i in range(n):
        volume, mass, change = w[VOLUME + i], s[_MASS + i], w[CHANGE + i]
        density = mass / volume
        area = np.sqrt(w[AREAS + i])
        c = np.sqrt(w[MODULUS + i] / density)
        gradient, length = area / volume, LENGTH_FACTOR * volume / area
        rate = max(-change * rate_of_change / volume, 0.0)
        new = density * length * rate * (linear * c + quadratic * length * rate)
        tangent = LENGTH_FACTOR * (linear * c + 2.0 * quadratic * length * rate) if rate > 0.0 else 0.0
        s[_WORK + i] -= 0.5 * (s[_Q + i] + new) * change
        s[_Q + i] = new
        w[LIMIT + i] = gradient * (tangent + np.sqrt(tangent * tangent + c * c))
