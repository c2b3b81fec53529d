"""Stages of the narrow phase: kernels over slots, faces, edges, cracks, pairs and contacts. Their tables are in
layout.py.

Each task writes its rows from its own offset on, and writes the number of its rows to its element of the sums. One
thread runs each kernel that has no range.
"""

from ...kernels.jit import njit, types
from ...parallel.arguments import reader
from ...parallel.team import TASK
from ..broad_phase import reference_motion
from ..solver import restitution, slot_numbers
from ..surface.families import CORNERS
from . import closing_speed, corner_contact, crack_contact, edge_edge, node_face, single_contact, tables
from .corner_contact import NARROW
from .layout import (
    BEYOND,
    CRACK_ROWS,
    CRACKS_N,
    DT,
    EDGE_PAIRS_N,
    EDGE_ROWS,
    END,
    FACE_PAIRS_N,
    FACE_ROWS,
    FAST_SIZE,
    FIRST,
    FOUND,
    LIMIT,
    MOST,
    ON_FACES,
    RETARGETS,
    SHARE,
    SIZE,
    SLOTS_N,
    STRAYED,
    WIDE,
    T,
    cracks_of,
    edge_pairs_of,
    face_pairs_of,
    lines_of,
    now_of,
    numbers_of,
    own_of,
    places_of,
    rows_of,
    sides_of,
    sums_of,
)
from .rows import collected
from .tables import CONTACT_ROWS, STEP

PAIRS_OF_A_TASK = 1024
"""Number of candidate pairs in a task. Chosen value: a task takes about 20 us, compared with 2 us to start a parallel
region."""
CRACKS_OF_A_TASK, FAMILIES_OF_A_TASK, CONTACTS_OF_A_TASK, SLOTS_OF_A_TASK, SIDES_OF_A_TASK = 512, 128, 1024, 2048, 8192
"""Numbers of cracks, of families, of contacts, of slots, and of faces or edges in a task. Chosen values: a task takes
about 20 us, compared with 2 us to start a parallel region."""
TAKE, AHEAD, SPREAD, LEAVE, LARGEST_FACES, LARGEST_EDGES, CHECK, ACROSS, DUE, NODE_FACE, LINK, ADMIT = range(12)
NEAREST, APPROACH, EDGE_EDGE, COLLECT, RETARGET, CORNERS_FROM = range(12, 18)
"""Numbers of the stages, in the order of execution. The last of these stages is the first stage over corners; each
block has one such stage."""
AT_CORNERS = CONTACT_ROWS, types.int64, types.int64, NARROW, CORNERS, STEP, types.int64[::1]
_at_corners = reader(*AT_CORNERS)


@njit("int64(int64, int64)", cache=True)
def tasks_of(n, size):  # type: ignore[no-untyped-def]
    """Number of tasks of length ``size`` in a range from 0 to ``n``."""
    return (n + size - 1) // size


@njit(TASK, cache=True)
def take(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: copies positions and velocities of the nodes of this rank to their slots."""
    slots, local, node_x, node_v = own_of(table)
    x, v, _, _, _ = places_of(table)
    slot_numbers.take(x, v, slots, node_x, node_v, local, first, stop)


@njit(TASK, cache=True)
def ahead(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``tables.place`` and ``closing_speed.bound`` for a range of slots."""
    x, v, places, _, boxes = places_of(table)
    tables.place(places, x, v, numbers_of(table)[1][DT], first, stop)
    closing_speed.bound(boxes, first // SLOTS_OF_A_TASK, v, first, stop)


@njit(TASK, cache=True)
def spread(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Sets the length of time, after the end of the step, in which closing pairs are detected. If the velocities show
    that two slots may approach by FAST_SIZE in the longest possible next step, it is the length of this step, else 0.
    Slower pairs cannot limit a step. Therefore ranks that have only slow nodes need no data of other ranks.
    """
    (counts, reals, _), boxes = numbers_of(table), places_of(table)[4]
    fastest = closing_speed.spread(boxes, tasks_of(counts[SLOTS_N], SLOTS_OF_A_TASK))
    reals[BEYOND] = reals[MOST] if fastest * reals[MOST] > reals[FAST_SIZE] else 0.0


@njit(TASK, cache=True)
def leave(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: computes the distances of slots from their lines (reference_motion.py)."""
    x, v, _, _, _ = places_of(table)
    left, line, course, near, short, mean, tracked, strayed = lines_of(table)
    _, reals, _ = numbers_of(table)
    t, dt = reals[T], reals[END] - reals[T] + reals[BEYOND]
    reference_motion.leave(left, line, course, x, v, t, dt, first, stop)
    reference_motion.leave(near, short, mean, x, v, t, dt, first, stop)
    strayed[first // SLOTS_OF_A_TASK] = reference_motion.farthest(left, tracked, first, stop)


@njit(TASK, cache=True)
def largest_faces(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``reference_motion.largest`` for faces."""
    left, corners, _, _ = sides_of(table)
    reference_motion.largest(left, corners, 3, lines_of(table)[3], first, stop)


@njit(TASK, cache=True)
def largest_edges(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``reference_motion.largest`` for edges."""
    _, _, left, corners = sides_of(table)
    reference_motion.largest(left, corners, 2, lines_of(table)[3], first, stop)


@njit(TASK, cache=True)
def check(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Sets the largest distance of a slot from its search line to the maximum over the tasks."""
    (counts, reals, _), strayed = numbers_of(table), lines_of(table)[7]
    reals[STRAYED] = 0.0
    for k in range(tasks_of(counts[SLOTS_N], SLOTS_OF_A_TASK)):
        reals[STRAYED] = max(reals[STRAYED], strayed[k])


@njit(TASK, cache=True)
def across(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``crack_contact.across`` for a range of cracks."""
    (counts, reals, _), (cracks, opening), k = numbers_of(table), cracks_of(table), first // CRACKS_OF_A_TASK
    _, _, _, _, _, _, found, wide = sums_of(table)
    found[k], wide[k] = crack_contact.across(
        rows_of(table)[0], counts[CRACK_ROWS], opening, cracks, reals[SIZE], now_of(table)[0], first, stop
    )


@njit(TASK, cache=True)
def due(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``node_face.due`` for a range of pairs."""
    (pairs, slots, faces), (_, reals, _) = face_pairs_of(table), numbers_of(table)
    many = sums_of(table)[0]
    end = reals[END] + reals[BEYOND]
    many[first // PAIRS_OF_A_TASK] = node_face.due(pairs, slots, faces, end, first, stop)


@njit(TASK, cache=True)
def on_faces(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``node_face.node_face`` for the pairs to be tested."""
    (out, _, depth, _, _), (pairs, slots, faces), (step,) = rows_of(table), face_pairs_of(table), now_of(table)
    (counts, reals, _), (many, found, coming, _, _, _, _, _) = numbers_of(table), sums_of(table)
    k = first // PAIRS_OF_A_TASK
    found[k], coming[k] = node_face.node_face(
        out, depth, counts[FACE_ROWS], pairs, slots, faces, step, reals[END], first, first + many[k]
    )


@njit(TASK, cache=True)
def link(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Lists the possible contacts of nodes with faces, and runs ``single_contact.link``."""
    (out, found, _, earlier, last), (counts, reals, _) = rows_of(table), numbers_of(table)
    _, many, coming, _, _, _, _, _ = sums_of(table)
    tasks = tasks_of(counts[FACE_PAIRS_N], PAIRS_OF_A_TASK)
    n = collected(found, counts[FIRST], counts[FACE_ROWS], PAIRS_OF_A_TASK, many, tasks)
    single_contact.link(earlier, last, found[counts[FIRST] : n], out.nodes)
    counts[ON_FACES], reals[LIMIT] = n - counts[FIRST], 0.0
    for k in range(tasks):
        reals[LIMIT] = max(reals[LIMIT], coming[k])


@njit(TASK, cache=True)
def admit(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``single_contact.admitted`` for a range of contacts."""
    (out, found, depth, earlier, last), (pairs, slots, faces) = rows_of(table), face_pairs_of(table)
    (step,), (counts, reals, _) = now_of(table), numbers_of(table)
    single_contact.admitted(
        out, depth, pairs, slots, faces, step, found[counts[FIRST] :], earlier, last, reals[END], first, stop
    )


@njit(TASK, cache=True)
def nearest(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Runs ``single_contact.nearest`` for all contacts of nodes with faces."""
    (out, found, depth, earlier, last), (pairs, _, faces) = rows_of(table), face_pairs_of(table)
    counts, begin = numbers_of(table)[0], numbers_of(table)[0][FIRST]
    listed = found[begin : begin + counts[ON_FACES]]
    counts[ON_FACES] = single_contact.nearest(listed, out, depth, pairs, faces, now_of(table)[0].part, earlier, last)


@njit(TASK, cache=True)
def approach(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``closing_speed.approach`` for a range of contacts."""
    (out, found, _, _, _), (pairs, _, faces) = rows_of(table), face_pairs_of(table)
    most, begin = sums_of(table)[3], numbers_of(table)[0][FIRST]
    most[first // CONTACTS_OF_A_TASK] = closing_speed.approach(
        out, found, pairs, faces, now_of(table)[0], begin + first, begin + stop
    )


@njit(TASK, cache=True)
def on_edges(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``edge_edge.edge_edge`` for a range of pairs."""
    (out, _, _, _, _), (pairs, edges, course), (step,) = rows_of(table), edge_pairs_of(table), now_of(table)
    (counts, reals, _), (_, _, _, _, tested, found, _, _) = numbers_of(table), sums_of(table)
    k = first // PAIRS_OF_A_TASK
    found[k], tested[k] = edge_edge.edge_edge(
        out, counts[EDGE_ROWS], pairs, edges, step, course, reals[END], first, stop
    )


@njit(TASK, cache=True)
def collect(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Lists all other contacts. Combines the results of the tasks: the limit of the next step, and the cracks that
    open.
    """
    (_, found, _, _, _), (counts, reals, _) = rows_of(table), numbers_of(table)
    _, _, _, most, _, on_edge, on_crack, wide = sums_of(table)
    for k in range(tasks_of(counts[ON_FACES], CONTACTS_OF_A_TASK)):
        reals[LIMIT] = max(reals[LIMIT], most[k])
    tasks, counts[WIDE] = tasks_of(counts[CRACKS_N], CRACKS_OF_A_TASK), 0
    n = counts[FIRST] + counts[ON_FACES]
    n = collected(found, n, counts[CRACK_ROWS], 3 * CRACKS_OF_A_TASK, on_crack, tasks)
    for k in range(tasks):
        counts[WIDE] += wide[k]
    tasks = tasks_of(counts[EDGE_PAIRS_N], PAIRS_OF_A_TASK)
    counts[FOUND] = collected(found, n, counts[EDGE_ROWS], PAIRS_OF_A_TASK, on_edge, tasks)


@njit(TASK, cache=True)
def retarget(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``restitution.rebound`` and ``restitution.hold_back`` for a range of contacts."""
    (out, found, _, _, _), (_, v, _, before, _) = rows_of(table), places_of(table)
    counts, reals, _ = numbers_of(table)
    if counts[RETARGETS] & 1:
        restitution.rebound(out, found, v, before, reals[SHARE], first, stop)
    if counts[RETARGETS] & 2:
        restitution.hold_back(out, found, before, first, stop)


@njit(TASK, cache=True)
def at_corners(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``corner_contact.entering`` for a range of families."""
    out, base, each, narrow, of, step, counts = _at_corners(table)
    counts[first // FAMILIES_OF_A_TASK] = corner_contact.entering(out, base, each, narrow, of, step, first, stop)
