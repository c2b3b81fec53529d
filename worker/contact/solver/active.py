"""Records of the solver: active contacts, their nodes, and the contacts with an impulse.

The nodes of active contacts are numbered without gaps; such a number is called a **slot**. All data of a node that a
sweep needs is in one cache line, floats and integers side by side.
"""

from typing import NamedTuple

import numpy as np

from ...kernels.jit import record, types
from ...model.cache_lines import LINE, cache_lines
from ...model.state import Floats, Indices, Ints

V, IMPULSE = 0, 3
"""Indices in a row of ``ActiveNodes.moving``: first word of the velocity of the slot, m/s; first word of the impulse of
the sweep on the slot, quanta."""
MOBILITY, TOTAL, CHANGED = 0, 3, 6
"""Indices in a row of ``ActiveNodes.fixed``: first word of the mobility of the slot, 1/kg; first word of the impulse of
the step on the slot, quanta; l1 norm of the change of this impulse by the last sweep, quanta."""
WANTED, ROW_NORM, PUSH, MU, LAST = 3, 4, 5, 6, 7
"""Indices of the columns of ``Loaded.normal`` that follow the unit normal."""
ROW_NORM_T, PUSH_T = 4, 5
"""Indices of the columns of ``Loaded.tangent`` that follow the weights."""


class ActiveContacts(NamedTuple):
    """Active contacts in the order of their sets (zones.py), and the rows of the narrow phase (tables.ContactRows)."""

    row: Indices
    """(contacts,) row of each contact in the arrays of the narrow phase."""
    slots: Indices
    """(contacts, 4) slots of the nodes. The third slot is -1 in a contact of two nodes, which have the weights 1 and
    -1."""
    reach: Floats
    """(contacts,) reach of each contact, m/s. An idle contact has no impulse in the step so far; it remains idle while
    the sum of the velocity changes of its nodes is below its reach. The reach of a loaded contact is infinite."""
    weights: Floats
    """(rows, 4) weights; see tables.ContactRows."""
    normals: Floats
    """(rows, 3) normals; see tables.ContactRows."""
    wanted: Floats
    """(rows,) target of the normal velocity, m/s."""
    friction: Floats
    """(rows,) coefficient of Coulomb friction."""
    pair: Indices
    """(rows,) row of the candidate pair; see tables.ContactRows."""


class Kept(NamedTuple):
    """Stored impulses of the last step, multiplied by their row norms, m/s, for the warm start: along the normal (1
    value) and across it (3 values). The stored impulses are zero for a pair that had no impulse.
    """

    pairs: Floats
    """(candidates, 4) stored impulses of pairs of a node and a face."""
    cracks: Floats
    """(3 cracks, 4) stored impulses of pairs of nodes across cracks."""


class ActiveNodes(NamedTuple):
    """Data of the nodes of active contacts (slots). The float view and the integer view of a cache line use the same
    memory.
    """

    moving: Floats
    """(slots, 8) velocities and impulses, which a sweep reads and writes; a row is a cache line."""
    moving_words: Ints
    fixed: Floats
    """(slots, 8) mobilities, and impulses of the step."""
    fixed_words: Ints
    row_weights: Ints
    """(slots, 4) sums over the contacts of all ranks, quanta: of |w| |n_i|, with the weight w and the normal n of a
    contact, and of |w|."""
    path: Floats
    """(slots,) sum of the l1 norms of the velocity changes of each slot in the step, m/s."""

    @classmethod
    def of(cls, n: int) -> "ActiveNodes":
        """Allocates arrays for ``n`` slots. The rows are aligned to cache lines."""
        moving, fixed = cache_lines(2 * n).reshape(2, n, LINE)
        sums, path = np.empty((n, 4), np.int64), np.empty(n)
        return cls(moving, moving.view(np.int64), fixed, fixed.view(np.int64), sums, path)


class Loaded(NamedTuple):
    """Loaded contacts, which are the contacts with an impulse in the step, in the order of their sets (zones.py). The
    contacts of set k begin at row ``begin[k]``.
    """

    normal: Floats
    """(contacts, 8) unit normal (3), target velocity, row norm along the normal, 1/kg, impulse along the normal, N s,
    Coulomb's coefficient, impulse before the extrapolation."""
    tangent: Floats
    """(contacts, 8) weights (4), row norm across the normal, 1/kg, impulse of friction (3), N s."""
    slots: Indices
    """(contacts, 4) slots of the nodes. The third slot is -1 in a contact of two nodes, which have the weights 1 and
    -1."""
    row: Indices
    """(contacts,) row of each contact in the arrays of the narrow phase."""
    begin: Ints
    """(sets + 1,) offsets of the sets among all active contacts."""
    many: Ints
    """(sets,) number of loaded contacts of each set."""

    @classmethod
    def of(cls, room: int, sets: int) -> "Loaded":
        """Allocates arrays for ``room`` contacts and ``sets`` sets of contacts."""
        lines, slots, row = np.empty((2, room, 8)), np.empty((room, 4), np.int32), np.empty(room, np.int32)
        return cls(lines[0], lines[1], slots, row, np.zeros(sets + 1, np.int64), np.zeros(sets, np.int64))


_I2, _N1, _N2 = types.int64[:, ::1], types.int32[::1], types.int32[:, ::1]
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
CONTACTS = record(ActiveContacts, _N1, _N2, _F1, _F2, _F2, _F1, _F1, _N1)
NODES = record(ActiveNodes, _F2, _I2, _F2, _I2, _I2, _F1)
KEPT = record(Kept, _F2, _F2)
LOADED = record(Loaded, _F2, _F2, _N2, _N1, types.int64[::1], types.int64[::1])
