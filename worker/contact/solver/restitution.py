"""Restitution: target velocity of contacts that close, from their speed of approach.

If the normal velocity is u- before the step and u+ after it, an impulse J takes the energy -J (u- + u+) / 2 from the
bodies. The target of a contact that closes is u+ = -e u- (Newton's law for each contact), so that this energy is -J u-
(1 - e) / 2. With the coefficient of restitution e = 1 the energy is zero for any number of contacts that share nodes,
because contacts without an impulse take no energy. For e = 1, the impulse is the reflection in the metric of the masses
of Cirak and West (2005), Decomposition contact response, Int. J. Numer. Meth. Engng 64.
"""

from ...kernels.jit import njit, types
from ..narrow_phase.tables import CONTACT_ROWS

_V, _N1, _I = types.float64[:, ::1], types.int32[::1], types.int64


@njit(types.void(CONTACT_ROWS, _N1, _V, _V, types.float64, _I, _I), cache=True)
def rebound(rows, found, v, before, share, first, stop):  # type: ignore[no-untyped-def]
    """Raises the target velocity of contacts that need an impulse to ``share`` times their speed of approach. The
    contacts are ``found`` from ``first`` to ``stop``. ``v``, ``before`` (slots, 3): velocities without contact, and
    v(n-1/2), m/s.
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
    """Lowers the target velocity of contacts that were separating at the speed u- > 0 to at most -u-. A higher target
    would return energy that contact did not take. The contacts are ``found`` from ``first`` to ``stop``; ``before``
    (slots, 3): v(n-1/2), from which u- is computed.
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
