"""Tables of the narrow phase, under one handle for all its stages (parallel/arguments.py), and the numbers that the
stages share.

A table changes only if one of its arrays is replaced.
"""

from ...kernels.jit import types
from ...parallel.arguments import Handle, table_of
from .tables import CONTACT_ROWS, EDGES, FACES, PAIRS, SLOTS, STEP

_B1, _N1, _N2 = types.boolean[::1], types.int32[::1], types.int32[:, ::1]
_I1, _F1, _F2 = types.int64[::1], types.float64[::1], types.float64[:, ::1]

OWN, PLACES, LINES, SIDES, NUMBERS, ROWS, NOW, FACE_PAIRS, EDGE_PAIRS, CRACKS, SUMS = range(11)
"""Indices of the tables: nodes of this rank; slots; distances of slots from their lines; of faces and edges; numbers of
the step; rows of active contacts; state of the slots; node-face pairs; edge-edge pairs; cracks; sums of each task."""
_KINDS = {
    OWN: (_N1, _N1, _F2, _F2),
    PLACES: (_F2, _F2, _F2, _F2, _F2),
    LINES: (_F1, _F2, _F2, _F1, _F2, _F2, _B1, _F1),
    SIDES: (_F1, _N2, _F1, _N2),
    NUMBERS: (_I1, _F1, _I1),
    ROWS: (CONTACT_ROWS, _N1, _F1, _N1, _N1),
    NOW: (STEP,),
    FACE_PAIRS: (PAIRS, SLOTS, FACES),
    EDGE_PAIRS: (PAIRS, EDGES, _F2),
    CRACKS: (_N2, _I1),
    SUMS: (_I1, _I1, _F1, _F1, _I1, _I1, _I1, _I1),
}
own_of = table_of(OWN, *_KINDS[OWN])
"""Fields of the table OWN: slots and local indices of the nodes of this rank; positions and velocities of all nodes of
this rank."""
places_of = table_of(PLACES, *_KINDS[PLACES])
"""Fields of the table PLACES, for the slots: positions x and velocities v; positions at the beginning and at the end of
the step; velocities v(n-1/2); and bounds of v for each task."""
lines_of = table_of(LINES, *_KINDS[LINES])
"""Fields of the table LINES: distances, positions and velocities of the search lines; the same three of the short
lines; flags of the slots whose motion is measured; and largest distance from the search lines for each task."""
sides_of = table_of(SIDES, *_KINDS[SIDES])
"""Fields of the table SIDES: distances and corners of faces; distances and corners of edges."""
numbers_of = table_of(NUMBERS, *_KINDS[NUMBERS])
"""Fields of the table NUMBERS: integers, floating point numbers, control word of the program."""
rows_of = table_of(ROWS, *_KINDS[ROWS])
"""Fields of the table ROWS: ContactRows, numbers of the active rows, depths, two working arrays (rows.py)."""
now_of = table_of(NOW, *_KINDS[NOW])
"""Fields of the table NOW: those of Step."""
face_pairs_of = table_of(FACE_PAIRS, *_KINDS[FACE_PAIRS])
"""Fields of the table FACE_PAIRS: those of Pairs, SlotTable and FaceTable."""
edge_pairs_of = table_of(EDGE_PAIRS, *_KINDS[EDGE_PAIRS])
"""Fields of the table EDGE_PAIRS: those of Pairs and EdgeTable, and velocities of the short lines."""
cracks_of = table_of(CRACKS, *_KINDS[CRACKS])
"""Fields of the table CRACKS: slots of the cracks, and cracks that open."""
sums_of = table_of(SUMS, *_KINDS[SUMS])
"""Fields of the table SUMS, with one value for each task: number of node-face pairs to be tested; number of their
contacts; squares of the rates of pairs that come near, and of contacts; number of tested edge-edge pairs; number of
their contacts; number of contacts across cracks; number of cracks that open."""

(
    OWN_N, SLOTS_N, FACES_N, EDGES_N, CRACKS_N, FACE_PAIRS_N, EDGE_PAIRS_N, FIRST, ON_FACES, FOUND, RETARGETED, ONE,
    WIDE, RETARGETS, FACE_ROWS, EDGE_ROWS, CRACK_ROWS, COUNTS,
) = range(18)  # fmt: skip
"""Indices of the integers: numbers of nodes of this rank, slots, faces, edges, cracks, pairs; contacts at corners,
contacts with faces, all contacts, contacts whose target changes; the number 1; cracks that open; reason for a change of
targets: 1 restitution, 2 no energy to give back, 3 both; first rows of the kinds of contacts."""
DT, MOST, FAST_SIZE, T, END, BEYOND, STRAYED, LIMIT, SIZE, SHARE, REALS = range(11)
"""Indices of the floating point numbers: length of the step, and largest length of the next step, s; distance above
which closing pairs limit a step, m; beginning and end of the step, s after the search; time after the end of the step,
s; largest distance from the search lines, m; square of the largest rate, 1/s^2; size of a face, m; coefficient of
restitution."""


def handle() -> Handle:
    """Returns the handle of the tables of a narrow phase."""
    return Handle(*_KINDS.values())
