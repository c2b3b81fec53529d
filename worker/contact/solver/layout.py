"""Tables of the solver, under one handle for all stages of a step (parallel/arguments.py), and the numbers that the
stages share.

The owner of the arrays of a table sets the table. A table changes only if one of its arrays is replaced.
"""

import numpy as np

from ...kernels.jit import types
from ...parallel.arguments import Handle, table_of
from ..narrow_phase.tables import CONTACT_ROWS
from .active import CONTACTS, KEPT, LOADED, NODES
from .stops import BRACED, STOPS, SURFACE

_B1, _U1, _N1, _N2 = types.boolean[::1], types.uint8[::1], types.int32[::1], types.int32[:, ::1]
_I1, _I2, _I3 = types.int64[::1], types.int64[:, ::1], types.int64[:, :, ::1]
_F1, _F2 = types.float64[::1], types.float64[:, ::1]

STEP, ROWS, NODES_OF, ROOM, SORTED, STORED, BOUNDS, BODIES, BOOKS, SUMS = range(10)
"""Indices of the tables: numbers of the step; rows of the narrow phase; surface nodes; working arrays; contacts in the
order of their sets; stored impulses; walls and planes; nodes of the rank; energies; sums of each task."""
_KINDS = {
    STEP: (_I1, _F1, _I1),
    ROWS: (CONTACT_ROWS, _N1),
    NODES_OF: (SURFACE, _F2, _I2, _N1),
    ROOM: (NODES, _N1, _N2, _F1, _N1, _N1, _N1, _U1, _U1, LOADED, BRACED),
    SORTED: (CONTACTS,),
    STORED: (KEPT,),
    BOUNDS: (STOPS, _B1),
    BODIES: (_F2, _N1, _B1),
    BOOKS: (_F1, _F1),
    SUMS: (_I1, _I2, _I2, _I1, _F1, _I3, _I3, _I2, _I3),
}
rows_of = table_of(ROWS, *_KINDS[ROWS])
"""Fields of the table ROWS: rows of the narrow phase (ContactRows), and the numbers of the active rows."""
nodes_of = table_of(NODES_OF, *_KINDS[NODES_OF])
"""Fields of the table NODES_OF, for the surface nodes: fields of Surface, velocity v(n-1/2), impulse of the step,
zone."""
room_of = table_of(ROOM, *_KINDS[ROOM])
"""Fields of the table ROOM: ActiveNodes; row, slots, reach and set of each contact; places, slot, touched, shared
(slot_numbers.py); Loaded, Braced."""
sorted_of = table_of(SORTED, *_KINDS[SORTED])
"""Fields of the table SORTED: active contacts (ActiveContacts)."""
stored_of = table_of(STORED, *_KINDS[STORED])
"""Fields of the table STORED: stored impulses of the pairs (Kept)."""
bounds_of = table_of(BOUNDS, *_KINDS[BOUNDS])
"""Fields of the table BOUNDS: walls and symmetry planes that stop nodes, and nodes without tets."""
bodies_of = table_of(BODIES, *_KINDS[BODIES])
"""Fields of the table BODIES, for the nodes of the rank: velocity, part, and flag for nodes that the rank owns."""
books_of = table_of(BOOKS, *_KINDS[BOOKS])
"""Fields of the table BOOKS, for the nodes of the rank: energy lost by contact, external work."""
step_of = table_of(STEP, *_KINDS[STEP])
"""Fields of the table STEP: integers, floating point numbers, control word of the program."""
sums_of = table_of(SUMS, *_KINDS[SUMS])
"""Fields of the table SUMS. For each task: contacts that need an impulse; contacts of each set, and first row of each
set; touched nodes; largest velocity. For each set: work along the normals, and work of friction. For each task:
residual, and impulses of the parts."""

CONTACTS_N, NODES_N, SLOTS_N, PAIRS_N, CRACKS_N, ONE, TURN, SWEEPS, WORKS, COUNTS = range(10)
"""Indices of the integers: number of active contacts; of surface nodes; of slots; of node-face pairs; of node pairs
across cracks; the number 1; number of the present sweep; number of sweeps of the step; and a number for the work that
is computed: 1 along the normals, 2 of friction, 3 both."""
DT, RATIO, SCALE, FASTEST, SIZE, JOULE, RUB, REALS = range(8)
"""Indices of the floating point numbers: time step, s; factor of the stored impulses; quanta per N s; upper bound of
the velocities, m/s; size of a face, m; quanta per J of the account, and of friction."""


def handle() -> Handle:
    """Returns the handle of the tables of a solver."""
    return Handle(*_KINDS.values())


def numbers() -> "tuple[np.ndarray, np.ndarray]":
    """Returns the integers and the floating point numbers of a solver."""
    counts, reals = np.zeros(COUNTS, np.int64), np.zeros(REALS)
    counts[ONE] = 1
    return counts, reals
