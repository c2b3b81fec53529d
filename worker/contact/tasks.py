"""Tasks of the passes over candidates, faces and contacts (parallel/team.py).

Each task writes its rows from its own offset on, and the number of its rows into ``counts``.
"""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from .narrow_phase import closing_speed, corner_contact, crack_contact, edge_edge, node_face, tables
from .narrow_phase.corner_contact import NARROW
from .narrow_phase.tables import CONTACT_ROWS, EDGES, FACES, PAIRS, SLOTS, STEP
from .solver import impulse_work, restitution, slot_numbers
from .surface.families import CORNERS

PAIRS_OF_A_TASK = 1024
"""Number of candidate pairs in a task. Chosen value: a task takes about 20 us; to start a parallel region takes 2
us."""
CRACKS_OF_A_TASK = 512
FAMILIES_OF_A_TASK = 128
CONTACTS_OF_A_TASK = 1024
SLOTS_OF_A_TASK = 2048
"""Numbers of cracks, families, contacts and slots in a task. Chosen values, by the same comparison as
PAIRS_OF_A_TASK."""
_F, _I = types.float64, types.int64
_F1, _F2, _I1, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]
_N1, _N2 = types.int32[::1], types.int32[:, ::1]
DUE_FACES = PAIRS, SLOTS, FACES, _F, _I1
NODE_FACE = CONTACT_ROWS, _F1, _I, PAIRS, SLOTS, FACES, STEP, _F, _I1, _I1, _F1
EDGE_EDGE = CONTACT_ROWS, _I, PAIRS, EDGES, STEP, _F2, _F, _I1, _I1
ACROSS = CONTACT_ROWS, _I, _I1, _N2, _F, STEP, _I1, _I1
ENTERING = CONTACT_ROWS, _I, _I, NARROW, CORNERS, STEP, _I1
APPROACH = CONTACT_ROWS, _N1, PAIRS, FACES, STEP, _F1
REBOUND = CONTACT_ROWS, _N1, _F2, _F2, _F, types.boolean
BOOK = _F1, _F1, _N1, _N1, _F2, _I2, _F2, _F
TAKE = _F2, _F2, _N1, _F2, _F2, _N1
AHEAD = _F2, _F2, _F2, _F2, _F
_due_faces, _node_face, _edge_edge = reader(*DUE_FACES), reader(*NODE_FACE), reader(*EDGE_EDGE)
_across, _entering, _approach = reader(*ACROSS), reader(*ENTERING), reader(*APPROACH)
_rebound, _book, _take, _ahead = reader(*REBOUND), reader(*BOOK), reader(*TAKE), reader(*AHEAD)


@njit(TASK, cache=True)
def due_faces(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``node_face.due``."""
    pairs, slots, faces, end, counts = _due_faces(table)
    counts[first // PAIRS_OF_A_TASK] = node_face.due(pairs, slots, faces, end, first, stop)


@njit(TASK, cache=True)
def node_face_pairs(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``node_face.node_face`` of the pairs to be tested."""
    out, depth, base, pairs, slots, faces, step, end, due, counts, coming = _node_face(table)
    k = first // PAIRS_OF_A_TASK
    counts[k], coming[k] = node_face.node_face(out, depth, base, pairs, slots, faces, step, end, first, first + due[k])


@njit(TASK, cache=True)
def edge_edge_pairs(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``edge_edge.edge_edge``."""
    out, base, pairs, edges, step, course, end, tested, counts = _edge_edge(table)
    k = first // PAIRS_OF_A_TASK
    counts[k], tested[k] = edge_edge.edge_edge(out, base, pairs, edges, step, course, end, first, stop)


@njit(TASK, cache=True)
def across_cracks(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``crack_contact.across``."""
    out, base, opening, some, typical, step, counts, wide = _across(table)
    k = first // CRACKS_OF_A_TASK
    counts[k], wide[k] = crack_contact.across(out, base, opening, some, typical, step, first, stop)


@njit(TASK, cache=True)
def entering_nodes(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``corner_contact.entering``."""
    out, base, each, narrow, of, step, counts = _entering(table)
    counts[first // FAMILIES_OF_A_TASK] = corner_contact.entering(out, base, each, narrow, of, step, first, stop)


@njit(TASK, cache=True)
def approach(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``closing_speed.approach``."""
    out, found, pairs, faces, step, most = _approach(table)
    most[first // CONTACTS_OF_A_TASK] = closing_speed.approach(out, found, pairs, faces, step, first, stop)


@njit(TASK, cache=True)
def rebound(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``restitution.rebound`` with a share above 0, and ``hold_back`` if ``back``."""
    out, found, v, before, share, back = _rebound(table)
    if share > 0.0:
        restitution.rebound(out, found, v, before, share, first, stop)
    if back:
        restitution.hold_back(out, found, before, first, stop)


@njit(TASK, cache=True)
def book(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``impulse_work.book``."""
    loss, external, places, index, before, total, mobility, scale = _book(table)
    impulse_work.book(loss, external, places, index, before, total, mobility, scale, first, stop)


@njit(TASK, cache=True)
def take(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``slot_numbers.take``."""
    x, v, slots, node_x, node_v, local = _take(table)
    slot_numbers.take(x, v, slots, node_x, node_v, local, first, stop)


@njit(TASK, cache=True)
def ahead(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: ``tables.place`` and ``closing_speed.bound``."""
    places, box, x, v, dt = _ahead(table)
    tables.place(places, x, v, dt, first, stop)
    closing_speed.bound(box, first // SLOTS_OF_A_TASK, v, first, stop)


@njit("int64(int32[::1], int64, int64[::1], int64[::1])", cache=True)
def collected(found, n, begins, counts):  # type: ignore[no-untyped-def]
    """Writes the row numbers of tasks, ``counts`` from each of ``begins`` on, into ``found`` from ``n`` on; returns
    the new length.
    """
    for k in range(len(counts)):
        for row in range(begins[k], begins[k] + counts[k]):
            found[n] = row
            n += 1
    return n
