"""What averaging the pressure takes: the forces work on a tet's own volume, its pressure on the mean that it sees.

A tet's stress does -p dV on its own volume; the energy that an averaged pressure stores is -p dW, with W the volume by
the strain that the pressure sees. Over all tets round a node the two agree where the pressure is uniform. The rest is
booked tet by tet as WORK_AVERAGED: what differences of pressure within an average store, which comes back; what is
lost for good, where neighbours yield, tear or leave at different times; and what the stabilising fluxes of ``split``
dissipate (docs/theory/elements.md, What averaging takes).
"""

from ..kernels.jit import njit
from ..materials.elastic import sheared, squeezed
from ..materials.law import BULK, DILATES
from ..model.rows import DILATION, PRESSURE, WORK_AVERAGED
from ..model.state import CHUNK
from .tet4 import BEFORE, CHANGE, CHANGE_SEEN, SEEN, VOLUME_MID, VOLUME_SEEN

_P, _GROWN, _TAKEN = PRESSURE * CHUNK, DILATION * CHUNK, WORK_AVERAGED * CHUNK


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def keep_before(w, s, params, n):  # type: ignore[no-untyped-def]
    """BEFORE: the pressure before the step; CHANGE_SEEN: how the seen volume changes; VOLUME_SEEN: at mid-step.

    Before the equation of state; VOLUME_SEEN is that of the step's beginning then. What dilates sees its own: its
    pressure does not say a volume, and its flow adds up to the growth of all tets round its nodes. What
    ``tell_dilation`` has taken back is of the step before.
    """
    if params[DILATES] > 0.0:
        for i in range(n):
            back = -s[_GROWN + i]
            w[BEFORE + i] = s[_P + i] + params[BULK] * back
            w[VOLUME_SEEN + i] = w[VOLUME_MID + i]
            w[CHANGE_SEEN + i] = w[VOLUME_MID + i] * (w[SEEN + i] + back)
        return
    for i in range(n):
        change = w[VOLUME_SEEN + i] * w[SEEN + i] * (1.0 + 0.5 * w[SEEN + i])
        w[BEFORE + i] = s[_P + i]
        w[CHANGE_SEEN + i] = change
        w[VOLUME_SEEN + i] += 0.5 * change


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def book_averaged(w, s, params, n):  # type: ignore[no-untyped-def]
    """WORK_AVERAGED: what the mean pressure of the step has done on the own volume less what on the seen one.

    The stress of what dilates is that of its own volume: where that grows by the dilation of others, more is stored.
    """
    dilates = params[DILATES] > 0.0
    for i in range(n):
        stored = squeezed(s, params, i) + sheared(s, params, i) if dilates else 0.0
        pressure = 0.5 * (w[BEFORE + i] + s[_P + i])
        s[_TAKEN + i] -= (pressure + stored) * (w[CHANGE + i] - w[CHANGE_SEEN + i])
