"""What the narrow phase takes, and what it makes: one row an active contact, of four nodes, their weights and a normal.

The gap is that of the end of the step as it would come without contact, positive outside; it is a linear function of
the velocities, dt n . sum(w_k v_k) plus a constant, with the weights w of ``weights``: 1 for the node and minus the
area coordinates of the point of the face (the defence node, Zhong 1993), or the two ends of two edges.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import njit, record, types
from ...model.cache_lines import cache_lines
from ...model.growing import Scratch
from ...model.state import Flags, Floats, Indices, Ints
from ..geometry import at, cross, dot, minus
from .tied import NOTHING

NEAR = 0.02
"""Of the size of a face: a gap that is watched although it does not close by itself."""
DEEP = 0.25
"""Of the size of a face, and of the length of an edge and the height of its tets: deepest penetration that is still
taken for one, not for the back of a thin body."""
DEEP_SELF = 0.05
"""The same of faces of one part, whose nodes lie behind its own faces anyway; as deep at least edges hold, however flat
their tets."""
FAST = 0.1
"""Of the typical size of a face: pairs that come nearer by less in a step bound no step before they are active. A tet
of that size is several times as high."""
PUSH_OUT = 0.1
"""Largest share of a penetration that is taken back in a step, and of the speed of closing that is given back for it;
nothing while contact has no energy to give back (``account.Account``)."""
CRACK = -2
"""The first number that stands for a pair of nodes across a crack, others are below."""
_FEWEST = 2
"""Rows of a table that is more than one line: numba takes a part of a single one for an array of its own."""


_NONE = np.empty(0)


class ContactRows(NamedTuple):
    """Room for active contacts."""

    nodes: Indices
    """(room, 4) slots."""
    weights: Floats
    """(room, 4)."""
    normals: Floats
    """(room, 3) unit, out of the face or out of the first edge's body."""
    wanted: Floats
    """(room,) n . sum(w_k v_k) must not be below this, m/s."""
    friction: Floats
    """(room,) Coulomb's coefficient."""
    pair: Indices
    """(room,) which candidate pair of a node and a face it was; CRACK - (3 c + k) for the pair of nodes k across crack
    c; -1 for others."""

    @classmethod
    def room(cls, n: int) -> "ContactRows":
        """Room for ``n`` active contacts."""
        rows, numbers = np.empty((n, 4), np.int32), np.empty(n, np.int32)
        return cls(rows, np.empty((n, 4)), np.empty((n, 3)), np.empty(n), np.empty(n), numbers)


class StepRoom(Scratch):
    """Room for the step ahead, and for what is found in it. Kept for many steps, it saves the system clearing its
    pages; tables of arguments stay as they are while there are as many slots.
    """

    def __init__(self) -> None:
        super().__init__()
        self._room = self._places = cache_lines(0)

    def lines(self, slots: int) -> tuple[Floats, Floats, Floats]:
        """Lines of so many slots, and their parts for positions at the beginning of the step and at its end."""
        n = max(slots, _FEWEST)
        if n != len(self._places):
            if n > len(self._room):
                self._room = cache_lines(2 * n)
            self._places = self._room[:n]
            self._halves = self._places[:, :3], self._places[:, 3:6]
        return self._places, *self._halves

    def least(self, slots: int) -> Floats:
        """(slots,) infinite: see Step.least."""
        least: Floats = self.of("least", slots, np.float64)
        least.fill(np.inf)
        return least


class Step(NamedTuple):
    """The slots in the step ahead."""

    x: Floats
    """(slots, 3) positions at its beginning, m; with those ``ahead`` in one cache line a slot."""
    v: Floats
    """(slots, 3) velocities without contact, m/s."""
    ahead: Floats
    """(slots, 3) positions at its end without contact, m."""
    part: Indices
    """(slots,)."""
    mu: Floats
    """(parts, parts) Coulomb's coefficient, NaN where two parts do not meet."""
    give: float
    """Of a penetration, taken back in the step (PUSH_OUT)."""
    dt: float
    """s."""
    beyond: float
    """The longest step that may follow, s, of which pairs that will be active are to be found; 0 if none need."""
    fast: float
    """m; pairs that come nearer by less in that step do not count."""
    rebound: float
    """Largest change of a speed by contact over the speed of closing: 1 + restitution."""
    least: Floats
    """(slots,) square of the least altitude of a node in the tets of its exposed faces, m^2; (0,) without ``beyond``.
    """
    tied: Ints
    """(slots,) the bonds that tie each, as bits: nodes that one ties do not meet; (0,) without bonds (tied.py)."""

    @classmethod
    def of(
        cls, x: Floats, v: Floats, part: Indices, mu: Floats, give: float, dt: float, room: StepRoom | None = None
    ) -> "Step":  # fmt: skip
        """A step ``dt`` from ``x`` on."""
        places, begin, end = (room or StepRoom()).lines(len(x))
        _place(places, x, v, dt)
        return cls(begin, v, end, part, mu, give, dt, 0.0, 0.0, 1.0, _NONE, NOTHING)

    def followed(self, beyond: float, fast: float, rebound: float, faces: "FaceTable", room: StepRoom) -> "Step":
        """And a step of up to ``beyond`` that may follow, see there."""
        least = _NONE
        if beyond > 0.0:
            least = room.least(len(self.x))
            least_altitudes(least, self.x, faces.corners, faces.exposed)
        return self._replace(beyond=beyond, fast=fast, rebound=rebound, least=least)


class Pairs(NamedTuple):
    """Candidate pairs of one kind, and how long each may be left alone (pairs.py)."""

    rows: Indices
    """(p, 2) a node's slot and a face, or two edges."""
    until: Floats
    """(p,) m; minus infinity when it is not known, NaN for a pair that is too close to be deactivated."""
    speed: Floats
    """(p,) relative speed of the reference motions, m/s; NaN when it is not known."""
    turned: Flags
    """(p,) whether a pair is deactivated because its node does not face the face, by the mean normals of the node."""
    next: Indices
    """(p,) of pairs of nodes and faces: the next pair of the same node, -1 for none; (0,) of edges."""
    active: Indices
    """(p,) room for the numbers of those that the narrow phase has tested."""


class SlotTable(NamedTuple):
    """The slots, as nodes that meet faces."""

    normals: Floats
    """(slots, 12) means over a node's faces of their normal n, of n n (xx, yy, zz, yz, zx, xy) and of the unit vector
    to the middle of the other side; zero without."""
    on_surface: Flags
    """(slots,) only these meet faces."""
    first: Indices
    """(slots,) the first pair with a face, -1 for none."""
    left: Floats
    """(slots,) how far each has left its reference motion, m."""
    course: Floats
    """(slots, 3) velocities of the reference motions, m/s."""
    fresh: Flags
    """(slots,) whose mean normals have changed."""


class FaceTable(NamedTuple):
    """The faces."""

    corners: Indices
    """(f, 4) slots, counter-clockwise seen from outside, the node opposite last."""
    size: Floats
    """(f,) square root of twice the initial area, m."""
    id: Ints
    exposed: Flags
    """(f,) only exposed faces are met."""
    left: Floats
    """(f,) the largest of its corners, m."""
    fresh: Flags
    """(f,) with new corners, or exposed since the last step."""


class EdgeTable(NamedTuple):
    """The edges; pairs are of sharp ones."""

    corners: Indices
    """(e, 6) slots: records.Edges."""
    size: Floats
    """(e,) initial length, m."""
    deep: Floats
    """(e,) depth beyond which it holds nothing, m: records.Edges."""
    meets: Flags
    """(e,) whether its faces allow that others meet it: records.Edges."""
    left: Floats
    """(e,) the larger of its ends, m."""
    fresh: Flags
    """(e,) with new corners, or a face exposed since the last step."""


_N1, _N2, _I1, _B1, _B2 = (
    types.int32[::1], types.int32[:, ::1], types.int64[::1], types.boolean[::1], types.boolean[:, ::1],
)  # fmt: skip
_F1, _F2, _I = types.float64[::1], types.float64[:, ::1], types.int64
CONTACT_ROWS = record(ContactRows, _N2, _F2, _F2, _F1, _F1, _N1)
STEP = record(Step, types.float64[:, :], _F2, types.float64[:, :], _N1, _F2, *(5 * [types.float64]), _F1, _I1)
PAIRS = record(Pairs, _N2, _F1, _F1, _B1, _N1, _N1)
SLOTS = record(SlotTable, _F2, _B1, _N1, _F1, _F2, _B1)
FACES = record(FaceTable, _N2, _F1, _I1, _B1, _F1, _B1)
EDGES = record(EdgeTable, _N2, _F1, _F1, _B1, _F1, _B1)


@njit("float64(float64, float64, float64, float64, float64)", cache=True, error_model="numpy")
def needed(gap0, gap1, speed, give, dt):  # type: ignore[no-untyped-def]
    """By how much the normal speed must rise, m/s: not to pass, and when that has happened already, not deeper; a
    share ``give`` of the penetration is taken back (PUSH_OUT).
    """
    back = give * min(max(-gap0, 0.0) / dt, max(-speed, 0.0))
    return (min(gap0, 0.0) - gap1) / dt + back


@njit(types.boolean(STEP, _I, _I, _I, _I), cache=True)
def bonded(step, a, b, c, d):  # type: ignore[no-untyped-def]
    """Whether one bond ties four slots, of two parts."""
    tied, part = step.tied, step.part
    return tied[a] & tied[b] & tied[c] & tied[d] != 0 and not part[a] == part[b] == part[c] == part[d]


@njit("void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64)", cache=True)
def _place(places, x, v, dt):  # type: ignore[no-untyped-def]
    """Positions now and after ``dt``, side by side."""
    for a in range(len(x)):
        for i in range(3):
            places[a, i], places[a, 3 + i] = x[a, i], x[a, i] + dt * v[a, i]


@njit("float64(float64[:, :], int32, int32, int32, int32)", cache=True, error_model="numpy")
def altitude(x, a, i, j, k):  # type: ignore[no-untyped-def]
    """Square of the height of slot a over the face i, j, k, m^2."""
    e, f, r = minus(at(x, j), at(x, i)), minus(at(x, k), at(x, i)), minus(at(x, a), at(x, i))
    n = cross(e, f)
    return dot(n, r) ** 2 / dot(n, n)


@njit("void(float64[::1], float64[:, :], int32[:, ::1], boolean[::1])", cache=True)
def least_altitudes(least, x, corners, exposed):  # type: ignore[no-untyped-def]
    """See Step.least."""
    for f in range(len(corners)):
        if exposed[f]:
            a, b, c, d = corners[f, 0], corners[f, 1], corners[f, 2], corners[f, 3]
            least[a] = min(least[a], altitude(x, a, b, c, d))
            least[b] = min(least[b], altitude(x, b, c, d, a))
            least[c] = min(least[c], altitude(x, c, d, a, b))
