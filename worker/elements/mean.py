"""Energy account of the averaged pressure: work on the volume of a tet, minus work on the averaged volume.

The stress of a tet does the work -p dV on its own volume V. An averaged pressure stores the energy -p dW, where W is
the volume that results from the averaged strain. If the pressure is uniform, the sums of the two over the tets around a
node are equal. The difference of the two works is added to the row WORK_AVERAGED of each tet. The difference of the two
works contains three energies (docs/theory/elements.md, Energy of the averaging): recoverable energy that pressure
differences within a mean store; energy dissipated if neighbours yield, tear or are removed at different times; and the
dissipation of the stabilising fluxes of ``split``.
"""

from ..kernels.jit import njit
from ..materials.elastic import sheared, squeezed
from ..materials.law import BULK, DILATES
from ..model.rows import DILATION, PRESSURE, WORK_AVERAGED
from ..model.state import CHUNK
from .scratch import BEFORE, CHANGE, CHANGE_SEEN, SEEN, VOLUME_MID, VOLUME_SEEN

_P, _GROWN, _TAKEN = PRESSURE * CHUNK, DILATION * CHUNK, WORK_AVERAGED * CHUNK


@njit("void(float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def keep_before(w, s, params, n):  # type: ignore[no-untyped-def]
    """Sets three rows: BEFORE is the pressure before the step, CHANGE_SEEN is the change of the averaged volume, and
    VOLUME_SEEN is the averaged volume at mid-step.

    This function must be called before the equation of state; on entry VOLUME_SEEN is the averaged volume at the start
    of the step. A material that dilates uses its own volume, because its pressure does not determine a volume, and its
    flow adds to the volume of all tets around its nodes. The dilation that ``subtract_dilation`` has subtracted is the
    dilation of the previous step.
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
    """Adds a work to the row WORK_AVERAGED: the work of the mean pressure of the step on the volume of the tet, minus
    its work on the averaged volume.

    The stress of a material that dilates acts on its own volume. If the dilation of neighbours increases the volume of
    the tet, more energy is stored.
    """
    dilates = params[DILATES] > 0.0
    for i in range(n):
        stored = squeezed(s, params, i) + sheared(s, params, i) if dilates else 0.0
        pressure = 0.5 * (w[BEFORE + i] + s[_P + i])
        s[_TAKEN + i] -= (pressure + stored) * (w[CHANGE + i] - w[CHANGE_SEEN + i])
