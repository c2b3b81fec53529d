"""Records of the impulse solver: active contacts, their nodes, and the contacts that carry an impulse.

The nodes of the active set are numbered densely: a **slot** each. All that a sweep needs of a node lies in one cache
line, floats and integers side by side.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import record, types
from ...model.cache_lines import LINE, cache_lines
from ...model.state import Floats, Indices, Ints

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
    """The active contacts in the order of their sets (zones.py), and the rows that the narrow phase has made of them:
    see tables.ContactRows.
    """

    row: Indices
    """(contacts,) which row each has."""
    slots: Indices
    """(contacts, 4) the third is -1 in a row of two nodes, of weights 1 and -1."""
    reach: Floats
    """(contacts,) the sum of the paths of its nodes up to which an idle contact stays idle, m/s; infinite for a loaded
    one."""
    weights: Floats
    """(room, 4)."""
    normals: Floats
    """(room, 3)."""
    wanted: Floats
    """(room,) target normal velocity, m/s."""
    friction: Floats
    """(room,) Coulomb's coefficient."""
    pair: Indices
    """(room,) see tables.ContactRows."""


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
    """Contacts that have asked for an impulse in the step, in the order of their sets (zones.py): those of set k stand
    from ``begin[k]`` on.
    """

    normal: Floats
    """(contacts, 8) unit normal, target velocity, row norm along it, 1/kg, impulse along it, N s, Coulomb's
    coefficient, impulse before momentum took it ahead."""
    tangent: Floats
    """(contacts, 8) weights, row norm across, 1/kg, impulse of friction (3), N s."""
    slots: Indices
    """(contacts, 4) the third is -1 in a row of two nodes, of weights 1 and -1."""
    row: Indices
    """(contacts,) row of each that is loaded."""
    begin: Ints
    """(sets + 1,) which of all active contacts are those of each set."""
    many: Ints
    """(sets,) how many of these are loaded."""

    @classmethod
    def of(cls, room: int, sets: int) -> "Loaded":
        """Room for as many."""
        lines, slots, row = np.empty((2, room, 8)), np.empty((room, 4), np.int32), np.empty(room, np.int32)
        return cls(lines[0], lines[1], slots, row, np.zeros(sets + 1, np.int64), np.zeros(sets, np.int64))


_I2, _N1, _N2 = types.int64[:, ::1], types.int32[::1], types.int32[:, ::1]
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
CONTACTS = record(ActiveContacts, _N1, _N2, _F1, _F2, _F2, _F1, _F1, _N1)
NODES = record(ActiveNodes, _F2, _I2, _F2, _I2, _I2, _F1)
KEPT = record(Kept, _F2, _F2)
LOADED = record(Loaded, _F2, _F2, _N2, _N1, types.int64[::1], types.int64[::1])
