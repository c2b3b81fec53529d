"""Which tets are worn out and leave the body: by plastic strain, by volume, by stable step (erosion).

What flattens or turns inside out must leave before it collapses: its velocity gradient is measured by its altitude, and
a single one that passes zero would throw its nodes away. Such a tet leaves at once; one that has only strained enough
can wait for others (worker/erosion.py).
"""

import math

import numpy as np

from conoid.cases.schema import Erosion

from ..jit import njit
from ..materials.law import DENSITY
from ..state import CHUNK, DAMAGE, MASS, PLASTIC_STRAIN, S_XX, VISCOUS, WORK, WORK_VISCOUS, Floats
from .tet4 import LIMIT, VOLUME

STRAIN, LOW, HIGH, FREQUENCY, DAMAGED = range(5)
"""Places in a block's ``life``: largest plastic strain, smallest and largest volume over the initial one, largest
one-over-stable-step, 1/s, damage."""
SOUND, TIRED, BROKEN = range(3)
"""What is found: no tet that leaves; some that can wait; some that cannot."""

_MASS, _STRAIN, _DAMAGE = MASS * CHUNK, PLASTIC_STRAIN * CHUNK, DAMAGE * CHUNK


def life(erosion: Erosion | None) -> Floats:
    """(5,) what a tet lives through; the frequency is known after the first step."""
    if erosion is None:
        return np.full(5, math.inf)
    strain = math.inf if erosion.plastic_strain is None else erosion.plastic_strain
    damage = math.inf if erosion.damage is None else erosion.damage
    return np.array([strain, *erosion.volume, math.inf, damage])


@njit("boolean(float64[::1], int64)", cache=True, error_model="numpy")
def _finite(s, i):  # type: ignore[no-untyped-def]
    """Whether the stress of a tet, and its work, are numbers."""
    total = abs(s[WORK * CHUNK + i]) + abs(s[WORK_VISCOUS * CHUNK + i])
    for row in range(S_XX, VISCOUS + 1):
        total += abs(s[row * CHUNK + i])
    return total < np.inf


@njit("void(float64[::1], int64)", cache=True, error_model="numpy")
def _release(s, i):  # type: ignore[no-untyped-def]
    """Takes the stress of a tet."""
    for row in range(S_XX, VISCOUS + 1):
        s[row * CHUNK + i] = 0.0


@njit(
    "int64(boolean[::1], float64[::1], float64[::1], float64[::1], float64[::1], int64, int64)",
    cache=True,
    error_model="numpy",
)
def mark_worn(worn, w, s, params, life, rows, n):  # type: ignore[no-untyped-def]
    """Marks the tets of a chunk that leave; one that leaves at once no longer limits the step. Returns what is found.

    A tet that is inside out is relieved of its stress before it acts on a node. One whose stress is not a number does
    not leave: its limit becomes NaN, which ends the run and names the tet.
    """
    found = SOUND
    for i in range(n):
        ratio = w[VOLUME + i] * params[DENSITY] / s[_MASS + i]
        inside_out = w[VOLUME + i] <= 0.0
        if not _finite(s, i) or not (inside_out or (w[VOLUME + i] > 0.0 and w[LIMIT + i] >= 0.0)):
            w[LIMIT + i] = np.nan
        elif inside_out or not (life[LOW] <= ratio <= life[HIGH] and w[LIMIT + i] <= life[FREQUENCY]):
            worn[i] = True
            w[LIMIT + i] = 0.0
            found = BROKEN
            if inside_out:
                _release(s, i)
        else:
            tired = rows > PLASTIC_STRAIN and s[_STRAIN + i] > life[STRAIN]
            if tired or (rows > DAMAGE and s[_DAMAGE + i] >= life[DAMAGED]):
                worn[i] = True
                found = max(found, TIRED)
    return found
