"""Records of the impulse solver: active contacts, their nodes, and the contacts that carry an impulse.

The nodes of the active set are numbered densely: a **slot** each. All that a sweep needs of a node lies in one cache
line, floats and integers side by side.
"""

from typing import NamedTuple

import numpy as np

from ..cache_lines import LINE, cache_lines
from ..jit import record, types
from ..state import Floats, Indices, Ints

V, IMPULSE = 0, 3
"""First word of a slot's velocity, m/s, and of its impulse of the sweep, quanta, in ``ActiveNodes.moving``."""
MOBILITY, TOTAL, CHANGED = 0, 3, 6
"""First word of its mobility, 1/kg, and of its impulse of the step, quanta, in ``ActiveNodes.fixed``, and the l1 norm
of what the last sweep has added to that, quanta."""
WANTED, ROW_NORM, PUSH, MU, LAST = 3, 4, 5, 6, 7
"""Of ``Loaded.normal``, behind the unit normal."""
ROW_NORM_T, PUSH_T = 4, 5
"""Of ``Loaded.tangent``, behind the weights."""


class ActiveContacts(NamedTuple):
    """What the narrow phase has found, in its order; see narrow_phase.ContactRows."""

    slots: Indices
    """(room, 4) of the nodes; the third is -1 in the row of a crack (cracks.across): two nodes, weights 1 and -1."""
    weights: Floats
    """(room, 4)."""
    normals: Floats
    """(room, 3)."""
    wanted: Floats
    """(room,) target normal velocity, m/s."""
    friction: Floats
    """(room,) Coulomb's coefficient."""
    pair: Indices
    """(room,) see narrow_phase.ContactRows."""
    reach: Floats
    """(room,) the sum of the paths of its nodes up to which an idle contact stays idle, m/s."""


class Kept(NamedTuple):
    """Impulses of a step times their row norms, zero where there were none: along the normal and across (3), m/s."""

    pairs: Floats
    """(candidates, 4) of nodes and faces."""
    cracks: Floats
    """(3 cracks, 4) of nodes across cracks."""


class ActiveNodes(NamedTuple):
    """The slots; floats and integers of a line are the same memory."""

    moving: Floats
    """(slots, 8) what a sweep reads and adds to, a cache line each."""
    moving_words: Ints
    fixed: Floats
    """(slots, 8) what turns it into velocities."""
    fixed_words: Ints
    row_weights: Ints
    """(slots, 4) sums of |w| |n_i| and of |w| over the contacts of all ranks, in quanta."""
    path: Floats
    """(slots,) sum of the l1 norms of the changes of velocity in the step, m/s."""

    @classmethod
    def of(cls, n: int) -> "ActiveNodes":
        """Room for as many slots, from the beginning of a cache line on."""
        moving, fixed = cache_lines(2 * n).reshape(2, n, LINE)
        sums, path = np.empty((n, 4), np.int64), np.empty(n)
        return cls(moving, moving.view(np.int64), fixed, fixed.view(np.int64), sums, path)


class Loaded(NamedTuple):
    """Contacts that have asked for an impulse in the step, and those that are idle."""

    normal: Floats
    """(room, 8) unit normal, target velocity, row norm along it, 1/kg, impulse along it, N s, Coulomb's coefficient,
    impulse before momentum took it ahead."""
    tangent: Floats
    """(room, 8) weights, row norm across, 1/kg, impulse of friction (3), N s."""
    slots: Indices
    """(room, 4) as of ActiveContacts."""
    row: Indices
    """(room,) which active contact."""
    idle: Indices
    """(room,) which active contacts have not asked for an impulse yet."""
    many: Ints
    """(2,) how many are loaded, how many idle."""

    def part(self, first: int, end: int, idle: Indices) -> "Loaded":
        """Room from ``first`` to ``end`` for as many contacts, the first of those in ``idle``; none is loaded."""
        some, count = slice(first, end), np.array([0, end - first], np.int64)
        return Loaded(self.normal[some], self.tangent[some], self.slots[some], self.row[some], idle, count)

    @classmethod
    def of(cls, room: int) -> "Loaded":
        """Room for as many."""
        lines, numbers = np.empty((2, room, 8)), np.empty((2, room), np.int32)
        return cls(lines[0], lines[1], np.empty((room, 4), np.int32), numbers[0], numbers[1], np.zeros(2, np.int64))


_I2, _N1, _N2 = types.int64[:, ::1], types.int32[::1], types.int32[:, ::1]
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
CONTACTS = record(ActiveContacts, _N2, _F2, _F2, _F1, _F1, _N1, _F1)
NODES = record(ActiveNodes, _F2, _I2, _F2, _I2, _I2, _F1)
KEPT = record(Kept, _F2, _F2)
LOADED = record(Loaded, _F2, _F2, _N2, _N1, _N1, types.int64[::1])
