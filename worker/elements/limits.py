"""Stable time step of the four-node tetrahedron."""

import numpy as np

from ..kernels.jit import njit
from ..model.rows import MASS
from ..model.state import CHUNK
from .scratch import AREAS, LIMIT, MODULUS, SPEED, VOLUME

_MASS = MASS * CHUNK
CLOSING = 4.0
"""Smallest number of steps in which the volume of a tet may go to zero at the rate of the last step. Chosen value:
close to 4.3, which the default viscosity requires. After a step of the largest allowed size the error of p = -K ln J is
0.5 % (docs/theory/time_integration.md)."""
LENGTH_FACTOR = 1.2009369551760027
"""Value of V^(1/3) sqrt(sum |grad N|^2) for a regular tet: sqrt(6) / (6 sqrt(2))^(1/3). The length LENGTH_FACTOR /
sqrt(sum |grad N|^2) is V^(1/3) for a regular tet, and decreases with the altitude of a flat tet."""


@njit("void(float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def step_limit(w, s, n):  # type: ignore[no-untyped-def]
    """Sets the row LIMIT to c sqrt(sum |grad N|^2), which is 1 / largest stable step, 1/s; NaN if the volume is not
    positive.

    Twice the value of LIMIT is at least the highest frequency of a tet with lumped mass (derived in
    docs/theory/time_integration.md).
    """
    for i in range(n):
        volume = w[VOLUME + i]
        w[LIMIT + i] = np.sqrt(w[AREAS + i] * w[MODULUS + i] / (volume * s[_MASS + i]))


@njit("void(float64[::1], int64)", cache=True)
def motion_limit(w, n):  # type: ignore[no-untyped-def]
    """Raises the row LIMIT to CLOSING times the row SPEED if it is smaller. SPEED is the rate of change of the volume
    divided by the volume, 1/s. If the row LIMIT is NaN, it is not changed.
    """
    for i in range(n):
        rate = CLOSING * abs(w[SPEED + i])
        limit = w[LIMIT + i]
        w[LIMIT + i] = rate if limit < rate else limit
