"""Records of the narrow phase: its input and its output. The output has one row for each active contact: four nodes,
their weights and a normal.

The gap of a contact is the gap at the end of a step without contact, positive outside. The gap is linear in the
velocities v_k of the four nodes: gap = dt n . sum(w_k v_k) plus a constant, with the normal n and the weights w of
``weights``: 1 for the node and minus the area coordinates of the point of the face (the defence node, Zhong 1993), or
the weights of the ends of two edges.
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
"""Largest gap at the end of the step with which a contact is active, as a fraction of the size of a face."""
DEEP = 0.25
"""Largest depth of a penetration, as a fraction of the size of a face, or of the length of an edge and the height of
its tets. A node or edge that is deeper counts as being on the other side of a thin body."""
DEEP_SELF = 0.05
"""Largest depth of a penetration, as a fraction of the size of a face, for a node and a face of the same part, because
all nodes of a part lie behind its own faces. For edges this fraction is also the smallest value of the largest depth of
a contact, for tets of any height."""
FAST = 0.1
"""Fraction of the typical size of a face. A pair whose distance decreases by a smaller fraction in a step limits the
time step only if it is active. The altitude of a tet of the typical size is several times this fraction of the size."""
PUSH_OUT = 0.1
"""Largest fraction of a penetration that is corrected in a step, and largest fraction of the closing speed that is
returned for the correction. The fractions are 0 while contact has no energy to return (``account.Account``)."""
CRACK = -2
"""Number of the first pair of nodes across a crack; this number is negative, and the numbers of further such pairs
decrease from it."""
_FEWEST = 2
"""Smallest number of rows of a table of cache lines. A table with a single row would be contiguous, which is a
different type for numba."""


_NONE = np.empty(0)


class ContactRows(NamedTuple):
    """Arrays of active contacts."""

    nodes: Indices
    """(rows, 4) slots of the four nodes of each contact."""
    weights: Floats
    """(rows, 4) weight of each of the four slots in the gap of the contact."""
    normals: Floats
    """(rows, 3) unit normals, outward from the face or from the body of the first edge."""
    wanted: Floats
    """(rows,) target, m/s: n . sum(w_k v_k) must not be below this value."""
    friction: Floats
    """(rows,) coefficient of Coulomb friction."""
    pair: Indices
    """(rows,) row of the candidate pair of a node and a face; CRACK - (3 c + k) for the pair of nodes k across crack c;
    -1 for all other contacts."""

    @classmethod
    def room(cls, n: int) -> "ContactRows":
        """Allocates arrays for ``n`` active contacts."""
        rows, numbers = np.empty((n, 4), np.int32), np.empty(n, np.int32)
        return cls(rows, np.empty((n, 4)), np.empty((n, 3)), np.empty(n), np.empty(n), numbers)


class StepRoom(Scratch):
    """Working arrays of a step. The arrays are kept from step to step, because the operating system must clear new
    pages of memory. Tables of arguments remain valid while the number of slots does not change.
    """

    def __init__(self) -> None:
        super().__init__()
        self._room = self._places = cache_lines(0)

    def lines(self, slots: int) -> tuple[Floats, Floats, Floats]:
        """Returns the cache lines of the slots, and views of them for the positions at the beginning and at the end of
        the step.
        """
        n = max(slots, _FEWEST)
        if n != len(self._places):
            if n > len(self._room):
                self._room = cache_lines(2 * n)
            self._places = self._room[:n]
            self._halves = self._places[:, :3], self._places[:, 3:6]
        return self._places, *self._halves

    def least(self, slots: int) -> Floats:
        """Returns an array (slots,) filled with infinity, for Step.least."""
        least: Floats = self.of("least", slots, np.float64)
        least.fill(np.inf)
        return least


class Step(NamedTuple):
    """State of the slots (contact nodes) in the present step."""

    x: Floats
    """(slots, 3) positions at the beginning of the step, m; they are in one cache line with ``ahead``."""
    v: Floats
    """(slots, 3) velocities without contact, m/s."""
    ahead: Floats
    """(slots, 3) positions at the end of the step without contact, m."""
    part: Indices
    """(slots,) part of each slot."""
    mu: Floats
    """(parts, parts) Coulomb's coefficient of friction; NaN if two parts cannot be in contact."""
    give: float
    """Fraction of a penetration that is corrected in the step (PUSH_OUT)."""
    dt: float
    """Length of the step, s."""
    beyond: float
    """Largest length of the next step for which closing pairs are detected, s; 0 if no pair is fast enough."""
    fast: float
    """Smallest decrease of the distance of a pair in the next step, m; pairs with a smaller decrease are ignored."""
    rebound: float
    """Largest ratio of the velocity change by contact to the closing speed: 1 + restitution."""
    least: Floats
    """(slots,) square of the smallest altitude of a node in the tets of its exposed faces, m^2; (0,) if ``beyond`` is
    0."""
    tied: Ints
    """(slots,) bonds of each slot, one bit for each bond. Nodes with a common bond are not in contact. The array is
    (0,) if there are no bonds (tied.py)."""

    @classmethod
    def of(cls, x: Floats, v: Floats, part: Indices, mu: Floats, give: float, dt: float) -> "Step":
        """Returns the record of a step of length ``dt`` that begins at the positions ``x``."""
        places, begin, end = StepRoom().lines(len(x))
        place(places, x, v, dt, 0, len(x))
        return cls.between(begin, end, v, part, mu, give, dt)

    @classmethod
    def between(
        cls, begin: Floats, end: Floats, v: Floats, part: Indices, mu: Floats, give: float, dt: float
    ) -> "Step":  # fmt: skip
        """Returns the record of a step of length ``dt`` from the positions ``begin`` to the positions ``end``
        (StepRoom.lines).
        """
        return cls(begin, v, end, part, mu, give, dt, 0.0, 0.0, 1.0, _NONE, NOTHING)

    def followed(self, beyond: float, fast: float, rebound: float, faces: "FaceTable", room: StepRoom) -> "Step":
        """Returns the record extended by data of the next step, whose length is at most ``beyond``."""
        least = _NONE
        if beyond > 0.0:
            least = room.least(len(self.x))
            least_altitudes(least, self.x, faces.corners, faces.exposed)
        return self._replace(beyond=beyond, fast=fast, rebound=rebound, least=least)


class Pairs(NamedTuple):
    """Candidate pairs of one kind, and the bounds up to which each pair is deactivated (pairs.py)."""

    rows: Indices
    """(p, 2) slot of the node and row of the face, or rows of the two edges."""
    until: Floats
    """(p,) bound of each pair, m; minus infinity if it is unknown, NaN for a pair that is too close to be
    deactivated."""
    speed: Floats
    """(p,) relative speed of the reference motions of each pair, m/s; NaN if it is unknown."""
    turned: Flags
    """(p,) True for each pair that is deactivated because its node does not face the face, by the mean normals of the
    node."""
    next: Indices
    """(p,) next node-face pair of the same node, -1 for none; (0,) for pairs of edges."""
    active: Indices
    """(p,) working array: numbers of the tested pairs."""


class SlotTable(NamedTuple):
    """Slots (contact nodes of the scene) with the data for node-face contact."""

    normals: Floats
    """(slots, 12) means over the faces of each node: of their normal n, of n n (xx, yy, zz, yz, zx, xy), and of the
    unit vector to the midpoint of the opposite edge; zero for a node without faces."""
    on_surface: Flags
    """(slots,) True for each node on the surface. Only nodes on the surface are in contact with faces."""
    first: Indices
    """(slots,) index of the first pair of each slot with a face; -1 if it has no such pair."""
    left: Floats
    """(slots,) distance of each slot from its reference motion, m."""
    course: Floats
    """(slots, 3) velocities of the reference motions, m/s."""
    fresh: Flags
    """(slots,) True for each slot whose mean normals have changed."""


class FaceTable(NamedTuple):
    """Faces of the scene."""

    corners: Indices
    """(f, 4) slots of each face, counter-clockwise seen from outside; the node opposite to the face is last."""
    size: Floats
    """(f,) size of each face, m: the square root of twice its initial area."""
    id: Ints
    exposed: Flags
    """(f,) True for each exposed face; only exposed faces have contacts."""
    left: Floats
    """(f,) largest distance of a corner from its reference motion, m."""
    fresh: Flags
    """(f,) True for each face that has new corners or was exposed after the last step."""


class EdgeTable(NamedTuple):
    """Edges of the scene; only sharp edges have candidate pairs."""

    corners: Indices
    """(e, 6) slots of each edge; see records.Edges."""
    size: Floats
    """(e,) initial length of each edge, m."""
    deep: Floats
    """(e,) greatest depth of a contact of each edge, m; see records.Edges."""
    meets: Flags
    """(e,) True for each edge if the states of its two faces admit edge-edge contact; see records.Edges."""
    left: Floats
    """(e,) larger distance of the two ends of each edge from their reference motions, m."""
    fresh: Flags
    """(e,) True for each edge that has new corners, or a face that was exposed after the last step."""


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
    """Returns the smallest change of the normal speed, m/s, with which the node does not pass the face. If the node is
    already behind the face, the change prevents it from moving deeper. The change is (min(gap0, 0) - gap1) / dt plus a
    term that corrects the fraction ``give`` of the penetration (PUSH_OUT).
    """
    back = give * min(max(-gap0, 0.0) / dt, max(-speed, 0.0))
    return (min(gap0, 0.0) - gap1) / dt + back


@njit(types.boolean(STEP, _I, _I, _I, _I), cache=True)
def bonded(step, a, b, c, d):  # type: ignore[no-untyped-def]
    """Returns True if one bond ties all four slots; the slots belong to two parts."""
    tied, part = step.tied, step.part
    return tied[a] & tied[b] & tied[c] & tied[d] != 0 and not part[a] == part[b] == part[c] == part[d]


@njit("void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64, int64, int64)", cache=True)
def place(places, x, v, dt, first, stop):  # type: ignore[no-untyped-def]
    """Writes the positions of the slots from ``first`` to ``stop``, now and after the time ``dt``, side by side."""
    for a in range(first, stop):
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
    """Lowers the array Step.least to the altitudes at all exposed faces."""
    for f in range(len(corners)):
        if exposed[f]:
            a, b, c, d = corners[f, 0], corners[f, 1], corners[f, 2], corners[f, 3]
            least[a] = min(least[a], altitude(x, a, b, c, d))
            least[b] = min(least[b], altitude(x, b, c, d, a))
            least[c] = min(least[c], altitude(x, c, d, a, b))
