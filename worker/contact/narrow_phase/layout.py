"""Tables of the narrow phase: one handle for its stages (parallel/arguments.py), and the numbers that they share.

A table changes only when an array is replaced.
"""

from ...kernels.jit import types
from ...parallel.arguments import Handle, table_of
from .tables import CONTACT_ROWS, EDGES, FACES, PAIRS, SLOTS, STEP

_B1, _N1, _N2 = types.boolean[::1], types.int32[::1], types.int32[:, ::1]
_I1, _F1, _F2 = types.int64[::1], types.float64[::1], types.float64[:, ::1]

OWN, PLACES, LINES, SIDES, NUMBERS, ROWS, NOW, FACE_PAIRS, EDGE_PAIRS, CRACKS, SUMS = range(11)
"""Numbers of the tables: nodes of this rank; slots; distances of slots from their lines; of faces and edges; numbers of
the step; rows of active contacts; state of the slots; node-face pairs; edge-edge pairs; cracks; sums by task."""
_KINDS = {
    OWN: (_N1, _N1, _F2, _F2),
    PLACES: (_F2, _F2, _F2, _F2, _F2),
    LINES: (_F1, _F2, _F2, _F1, _F2, _F2, _B1, _F1),
    SIDES: (_F1, _N2, _F1, _N2),
    NUMBERS: (_I1, _F1, _I1),
    ROWS: (CONTACT_ROWS, _N1, _F1, _N1),
    NOW: (STEP,),
    FACE_PAIRS: (PAIRS, SLOTS, FACES),
    EDGE_PAIRS: (PAIRS, EDGES, _F2),
    CRACKS: (_N2, _I1),
    SUMS: (_I1, _I1, _F1, _F1, _I1, _I1, _I1, _I1),
}
own_of = table_of(OWN, *_KINDS[OWN])
"""Slots and local indices of the nodes of this rank; positions and velocities of all nodes of this rank."""
places_of = table_of(PLACES, *_KINDS[PLACES])
"""Slots: x, v, positions at the beginning and at the end of the step, v(n-1/2); bounds of v by task."""
lines_of = table_of(LINES, *_KINDS[LINES])
"""Search lines: distances, positions, velocities; the same of the short lines; slots that are measured; by
task: largest distance from the search lines."""
sides_of = table_of(SIDES, *_KINDS[SIDES])
"""Faces: distances, corners; the same of the edges."""
numbers_of = table_of(NUMBERS, *_KINDS[NUMBERS])
"""Counts, reals, control word of the program."""
rows_of = table_of(ROWS, *_KINDS[ROWS])
"""ContactRows, numbers of the active rows, depths, working array (rows.py)."""
now_of = table_of(NOW, *_KINDS[NOW])
"""Step."""
face_pairs_of = table_of(FACE_PAIRS, *_KINDS[FACE_PAIRS])
"""Pairs, SlotTable, FaceTable."""
edge_pairs_of = table_of(EDGE_PAIRS, *_KINDS[EDGE_PAIRS])
"""Pairs, EdgeTable, velocities of the short lines."""
cracks_of = table_of(CRACKS, *_KINDS[CRACKS])
"""Slots of the cracks, cracks that open."""
sums_of = table_of(SUMS, *_KINDS[SUMS])
"""By task: node-face pairs to be tested; their contacts; squares of rates of pairs that come near, and of contacts;
tested edge-edge pairs; their contacts; contacts across cracks; cracks that open."""

(
    OWN_N, SLOTS_N, FACES_N, EDGES_N, CRACKS_N, FACE_PAIRS_N, EDGE_PAIRS_N, FIRST, ON_FACES, FOUND, RETARGETED, ONE,
    WIDE, RETARGETS, FACE_ROWS, EDGE_ROWS, CRACK_ROWS, COUNTS,
) = range(18)  # fmt: skip
"""Numbers of the counts: nodes of this rank, slots, faces, edges, cracks, pairs; contacts at corners, contacts with
faces, all contacts, contacts whose target changes; the number 1; cracks that open; whether targets change: 1 by
restitution, 2 without energy to give back, 3 both; first rows of the kinds of contacts."""
DT, MOST, FAST_SIZE, T, END, BEYOND, STRAYED, LIMIT, SIZE, SHARE, REALS = range(11)
"""Numbers of the reals: length of the step, and largest length of the next, s; distance above which closing pairs limit
a step, m; beginning and end of the step, s after the search; time beyond it, s; largest distance from the search lines,
m; square of the largest rate, 1/s^2; size of a face, m; coefficient of restitution."""


def handle() -> Handle:
    """Returns the tables of a narrow phase."""
    return Handle(*_KINDS.values())
