"""Material state at the nodes, in the averaged pressure forms, for pressures that are not linear in the volume strain.

The volume strain of a node is a mean over its tets. Therefore each node has its own volume ratio and pores, and a
pressure that is computed from volume ratio and pores. The pressure of a tet is the mean of its four nodes. The work of
the forces on the volumes of the tets is then the work of the nodal pressures on the nodal volumes:

    sum_e V_e e_e mean_a(p_a) = sum_a p_a V_a e_a,    V_a e_a = sum_e V_e e_e / 4

Therefore the mean neither creates nor dissipates energy (docs/theory/elements.md, "Matter at the nodes"). Nodal
pressures are used for a linear material with a tension cut-off. If the pressure is linear in the strain, the mean
strain gives the mean pressure, so the pressure is computed in the tet. The pressure of an equation of state with heat
is also computed in the tet.
"""

import numpy as np

from ..kernels.jit import njit
from ..materials.elastic import sheared
from ..materials.law import BULK, DENSITY, DILATES, FROM_SHAPE, ORDER, SHEAR, SPALL
from ..model.rows import MASS, PORES, PRESSURE, WORK, WORK_AVERAGED, WORK_PLASTIC
from ..model.state import CHUNK, Floats
from .scratch import CHANGE, MODULUS

RATIO, PORES_AT, PRESSURE_AT, WORKED, TORN, OPENED, STIFF = range(7)
"""Columns of the nodal material state. The state consists of the volume ratio, the pores (as in state.PORES) and the
pressure, Pa. Then follow values of the step per initial volume: work of the pressure, J/m^3; the part of this work that
is dissipated in pores, J/m^3; volume of new pores. Last column: modulus of the wave speed, Pa."""
COLUMNS = 8
"""Number of columns; one more than the number of used columns, so that a row is a cache line."""
TETS, LINEAR = range(2)
"""Places where the pressure is computed. TETS: in the tets; LINEAR: at the nodes, for a linear pressure with a tension
cut-off."""

_P, _MASS, _WORK, _PORES = (row * CHUNK for row in (PRESSURE, MASS, WORK, PORES))
_TAKEN, _PLASTIC = WORK_AVERAGED * CHUNK, WORK_PLASTIC * CHUNK


@njit("int64(int64, float64[::1])", cache=True)
def pressure_place(eos, params):  # type: ignore[no-untyped-def]
    """Returns TETS or LINEAR for a part; ``eos``: number of its equation of state; ``params``: its constants.

    The pressure is computed in the tets (TETS) for an equation of state with heat, because at the surface of a strong
    shock a node is compressed more than the mean of four nodes (at 10 km/s more than a step resolves). With dilation
    the value is also TETS, because the pressure then contains a part of the plastic flow of the tet.
    """
    return LINEAR if eos == 0 and params[SPALL] < np.inf and params[DILATES] == 0.0 else TETS


@njit("void(float64[::1], float64, float64, float64, float64, float64)", cache=True, error_model="numpy")
def _book(at, params_bulk, old, before, after, opened):  # type: ignore[no-untyped-def]
    """Sets the columns WORKED, TORN and OPENED of a node whose volume ratio changes from ``before`` to ``after``.
    ``opened``: volume of new pores.
    """
    new = at[PRESSURE_AT]
    mean = 0.5 * (old + new)
    at[WORKED] = -mean * (after - before)
    at[TORN] = -opened * (mean + 0.5 * new * new / params_bulk)
    at[OPENED] = opened


@njit("void(float64[::1], float64[::1], float64)", cache=True, error_model="numpy")
def _linear(at, params, strain):  # type: ignore[no-untyped-def]
    """Updates the pressure of a node by p -= K d(volume strain). The pressure is at least minus the spall pressure.
    While the node has pores, the pressure is at most zero.
    """
    bulk, spall = params[BULK], params[SPALL]
    old, pores, before, half = at[PRESSURE_AT], at[PORES_AT], at[RATIO], 0.5 * strain
    p, opened = old - bulk * strain, 0.0
    after = before * (1.0 + half) / (1.0 - half)
    if p < -spall or (pores > 0.0 and p > 0.0):
        more = max((-spall - p) / bulk if p < 0.0 else -p / bulk, -pores)
        p += bulk * more
        at[PORES_AT] = pores + more
        opened = 0.5 * (before + after) * more
    at[RATIO], at[PRESSURE_AT] = after, p
    at[STIFF] = bulk + 4.0 / 3.0 * params[SHEAR]
    _book(at, bulk, old, before, after, opened)


@njit("void(float64[::1], float64, int64, float64[::1])", cache=True, error_model="numpy")
def press_node(at, strain, kind, params):  # type: ignore[no-untyped-def]
    """Updates the columns ``at`` of a node to n+1, from the volume strain of the step; ``kind``: TETS or LINEAR."""
    if kind == LINEAR:
        _linear(at, params, strain)


@njit("float64(float64[:, ::1], uint32[:, ::1], int64, int64)", cache=True, error_model="numpy", forceinline=True)
def _mean(matter, tets, i, k):  # type: ignore[no-untyped-def]
    """Returns the mean of column ``k`` over the nodes of tet ``i``."""
    return 0.25 * ((matter[tets[i, 0], k] + matter[tets[i, 1], k]) + (matter[tets[i, 2], k] + matter[tets[i, 3], k]))


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[:, ::1], uint32[:, ::1], int64)",
    cache=True,
    error_model="numpy",
)
def from_nodes(w, s, params, matter, tets, n):  # type: ignore[no-untyped-def]
    """Sets pressure, work of the pressure, and the row MODULUS of ``n`` tets from the state at their nodes. Sets the
    row WORK_AVERAGED to the work on the volume of the tet minus the work at the nodes.
    """
    porous, shaped = params[SPALL] < np.inf, params[ORDER] == FROM_SHAPE
    for i in range(n):
        new, whole = _mean(matter, tets, i, PRESSURE_AT), s[_MASS + i] / params[DENSITY]
        work = -0.5 * (s[_P + i] + new) * w[CHANGE + i]
        s[_P + i] = new
        s[_WORK + i] += work
        s[_TAKEN + i] += work - whole * _mean(matter, tets, i, WORKED)
        w[MODULUS + i] = _mean(matter, tets, i, STIFF)
    if porous:
        for i in range(n):
            stored = 0.0 if shaped else sheared(s, params, i)
            lost = _mean(matter, tets, i, TORN) - _mean(matter, tets, i, OPENED) * stored
            s[_PLASTIC + i] += s[_MASS + i] / params[DENSITY] * lost
            s[_PORES + i] = _mean(matter, tets, i, PORES_AT)


def at_start(nodes: int) -> Floats:
    """(nodes, COLUMNS) nodal material state of unstrained material."""
    made = np.zeros((nodes, COLUMNS))
    made[:, RATIO] = 1.0
    return made
