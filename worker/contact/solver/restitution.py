"""What comes back from an impact: active contacts that close are asked to part with a share of the speed of approach.

With the normal velocity u- before the step and u+ after it an impulse J takes -J (u- + u+) / 2 from the bodies. A
contact that closes is asked for u+ = -e u- (Newton's law, by contact), so that this is -J u- (1 - e) / 2: for e = 1
nothing, however many contacts share nodes, since those without an impulse take nothing anyway. That is the reflection
in the metric of the masses of Cirak and West (2005), Decomposition contact response, Int. J. Numer. Meth. Engng 64.
"""

from ...kernels.jit import njit, types
from ..narrow_phase.tables import CONTACT_ROWS

_V, _N1, _I = types.float64[:, ::1], types.int32[::1], types.int64


@njit(types.void(CONTACT_ROWS, _N1, _V, _V, types.float64, _I, _I), cache=True)
def rebound(rows, found, v, before, share, first, stop):  # type: ignore[no-untyped-def]
    """Raises the target velocity of those of the contacts ``found``, from ``first`` to ``stop``, that ask for an
    impulse to ``share`` of the speed at which they approached; ``v``, ``before`` (slots, 3): velocities without contact
    and v(n-1/2), m/s.
    """
    for q in range(first, stop):
        p = found[q]
        closing, approach = 0.0, 0.0
        for k in range(4):
            s, weight = rows.nodes[p, k], rows.weights[p, k]
            for i in range(3):
                closing += weight * rows.normals[p, i] * v[s, i]
                approach -= weight * rows.normals[p, i] * before[s, i]
        if rows.wanted[p] > closing:
            rows.wanted[p] = max(rows.wanted[p], share * approach)


@njit(types.void(CONTACT_ROWS, _N1, _V, _I, _I), cache=True)
def hold_back(rows, found, before, first, stop):  # type: ignore[no-untyped-def]
    """Lowers the target velocity of those of the contacts ``found``, from ``first`` to ``stop``, that were parting, at
    u- of ``before`` (slots, 3), v(n-1/2), to -u-: less closing than that is energy that was not taken before.
    """
    for q in range(first, stop):
        p = found[q]
        parting = 0.0
        for k in range(4):
            s, weight = rows.nodes[p, k], rows.weights[p, k]
            for i in range(3):
                parting += weight * rows.normals[p, i] * before[s, i]
        if parting > 0.0:
            rows.wanted[p] = min(rows.wanted[p], -parting)
