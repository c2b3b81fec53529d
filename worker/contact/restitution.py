"""What comes back from an impact: active contacts that close are asked to part with a share of the speed of approach.

With the normal velocity u- before the step and u+ after it an impulse J takes -J (u- + u+) / 2 from the bodies. A
contact that closes is asked for u+ = -e u- (Newton's law, by contact), so that this is -J u- (1 - e) / 2: for e = 1
nothing, however many contacts share nodes, since those without an impulse take nothing anyway. That is the reflection
in the metric of the masses of Cirak and West (2005), Decomposition contact response, Int. J. Numer. Meth. Engng 64.
"""

from ..jit import njit, types
from ..state import Floats
from .narrow_phase import CONTACT_ROWS, ContactRows

_V = types.float64[:, ::1]


def retarget(rows: ContactRows, n: int, v: Floats, before: Floats, share: float, give: float) -> None:
    """Target velocities of the first ``n`` active contacts after detection: see ``rebound``, and ``hold_back`` where
    there is nothing to ``give`` of penetrations (narrow_phase.PUSH_OUT).
    """
    if share > 0.0:
        rebound(rows, n, v, before, share)
    if give == 0.0:
        hold_back(rows, n, before)


@njit(types.void(CONTACT_ROWS, types.int64, _V, _V, types.float64), cache=True)
def rebound(rows, n, v, before, share):  # type: ignore[no-untyped-def]
    """Raises the target velocity of those of the first ``n`` active contacts that ask for an impulse to ``share`` of
    the speed at which they approached; ``v``, ``before`` (slots, 3): velocities without contact and v(n-1/2), m/s.
    """
    for p in range(n):
        closing, approach = 0.0, 0.0
        for k in range(4):
            s, weight = rows.nodes[p, k], rows.weights[p, k]
            for i in range(3):
                closing += weight * rows.normals[p, i] * v[s, i]
                approach -= weight * rows.normals[p, i] * before[s, i]
        if rows.wanted[p] > closing:
            rows.wanted[p] = max(rows.wanted[p], share * approach)


@njit(types.void(CONTACT_ROWS, types.int64, _V), cache=True)
def hold_back(rows, n, before):  # type: ignore[no-untyped-def]
    """Lowers the target velocity of those of the first ``n`` active contacts that were parting, at u- of ``before``
    (slots, 3), v(n-1/2), to -u-: less closing than that is energy that nobody paid.
    """
    for p in range(n):
        parting = 0.0
        for k in range(4):
            s, weight = rows.nodes[p, k], rows.weights[p, k]
            for i in range(3):
                parting += weight * rows.normals[p, i] * before[s, i]
        if parting > 0.0:
            rows.wanted[p] = min(rows.wanted[p], -parting)
