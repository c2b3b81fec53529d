"""Stages of the solver: kernels over contacts, nodes, slots and sets of contacts. The tables of the stages are in
layout.py.

One thread runs the kernel with the name ``number`` and the kernels that have no range.
"""

from ...kernels.jit import njit
from ...parallel.team import TASK
from . import impulse_work, loading, slot_numbers, stops, sweeps
from .layout import (
    CONTACTS_N,
    DT,
    FASTEST,
    JOULE,
    RATIO,
    RUB,
    SCALE,
    SIZE,
    SLOTS_N,
    SWEEPS,
    TURN,
    WORKS,
    bodies_of,
    books_of,
    bounds_of,
    nodes_of,
    room_of,
    rows_of,
    sorted_of,
    step_of,
    stored_of,
    sums_of,
)
from .quiet import needs_impulse

CONTACTS_OF_A_TASK, SLOTS_OF_A_TASK, KEPT_OF_A_TASK = 1024, 2048, 8192
"""Three numbers in a task: of contacts, of nodes or slots, and of stored impulses. Chosen values: a task takes about 20
us, compared with 2 us to start a parallel region."""
(
    QUIET, REST, MARK, COUNT, ORDER, NUMBER, SORT, LOAD, BEGIN, WEIGH, RESUME, START, SWEEP, GIVE, TURN_OVER,
    CLEAR_PAIRS, CLEAR_CRACKS, STORE, WORK, LEAVE, END,
) = range(21)  # fmt: skip
"""Numbers of the stages in the order of execution, and the number that ends the program."""
WEIGH_BORDER, RESUME_BORDER, SWEEP_BORDER, STORE_BORDER, WORK_BORDER, RESTED = range(END, END + 6)
"""Numbers of the stages over contacts with a node that other ranks share; and number of the next stage if a step needs
no impulse."""


@njit(TASK, cache=True)
def quiet(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: writes 1 if a contact of its range may need an impulse, else 0."""
    rows, found = rows_of(table)
    (kept,), (planes, loose), (_, reals, _) = stored_of(table), bounds_of(table), step_of(table)
    flags = sums_of(table)[0]
    flags[first // CONTACTS_OF_A_TASK] = needs_impulse(
        rows, found, kept, planes, nodes_of(table)[0], loose, reals[DT], first, stop
    )


@njit(TASK, cache=True)
def rest(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Ends the step if no contact needs an impulse: RESTED becomes the number of the next stage."""
    (counts, _, control), flags = step_of(table), sums_of(table)[0]
    many = (counts[CONTACTS_N] + CONTACTS_OF_A_TASK - 1) // CONTACTS_OF_A_TASK
    for k in range(many):
        if flags[k] != 0:
            return
    control[0] = RESTED


@njit(TASK, cache=True)
def mark(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``slot_numbers.mark`` for a range of contacts."""
    (rows, found), zone, many = rows_of(table), nodes_of(table)[3], sums_of(table)[1]
    _, _, _, _, set_of, _, _, touched, shared, _, _ = room_of(table)
    k = first // CONTACTS_OF_A_TASK
    many[k] = 0
    slot_numbers.mark(touched, set_of, rows.nodes, found, zone, shared, many, k, first, stop)


@njit(TASK, cache=True)
def count(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: counts the touched nodes of the range."""
    touched, counted, n = room_of(table)[7], sums_of(table)[3], 0
    for a in range(first, stop):
        n += touched[a]
    counted[first // SLOTS_OF_A_TASK] = n


@njit(TASK, cache=True)
def order(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Sets the first slot of each range of nodes, the first row of each set of contacts, and the first row of each task
    in each set. Sets the loaded contacts and the work of all sets to zero.
    """
    counts, _, _ = step_of(table)
    _, many, begins, counted, _, along, friction, _, _ = sums_of(table)
    loaded, nodes = room_of(table)[9], len(nodes_of(table)[3])
    counts[SLOTS_N] = slot_numbers.offsets(counted, (nodes + SLOTS_OF_A_TASK - 1) // SLOTS_OF_A_TASK)
    tasks = (counts[CONTACTS_N] + CONTACTS_OF_A_TASK - 1) // CONTACTS_OF_A_TASK
    slot_numbers.set_offsets(loaded.begin, begins, many, tasks)
    loaded.many[:], along[:], friction[:] = 0, 0, 0
    counts[TURN] = 0


@njit(TASK, cache=True)
def number(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``slot_numbers.number`` for a range of nodes."""
    _, _, _, _, _, places, slot, touched, _, _, _ = room_of(table)
    slot_numbers.number(places, slot, touched, sums_of(table)[3][first // SLOTS_OF_A_TASK], first, stop)


@njit(TASK, cache=True)
def sort(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``slot_numbers.sort`` for a range of contacts."""
    (rows, found), begins = rows_of(table), sums_of(table)[2]
    _, row, slots, reach, set_of, _, slot, _, _, _, _ = room_of(table)
    k = first // CONTACTS_OF_A_TASK
    slot_numbers.sort(row, slots, reach, begins, set_of, found, rows.nodes, slot, k, first, stop)


@njit(TASK, cache=True)
def load(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``slot_numbers.load`` for a range of slots, then finds the slots near stops and stops these slots."""
    active, _, _, _, _, places, _, _, _, _, braced = room_of(table)
    nodes = nodes_of(table)[0]
    (planes, loose), (_, reals, _) = bounds_of(table), step_of(table)
    k = first // SLOTS_OF_A_TASK
    sums_of(table)[4][k] = slot_numbers.load(active, places, nodes.v, nodes.mobility, first, stop)
    if len(planes.points) > 0:
        stops.find(braced, active, planes, places, nodes, loose, reals[SIZE], reals[DT], k, first, stop)
        stops.stop(active, braced, k, first * len(planes.points))


@njit(TASK, cache=True)
def begin(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Sets the upper bound of the velocities of the slots to the maximum over the tasks."""
    (counts, reals, _), fastest, most = step_of(table), sums_of(table)[4], 0.0
    for k in range((counts[SLOTS_N] + SLOTS_OF_A_TASK - 1) // SLOTS_OF_A_TASK):
        most = max(most, fastest[k])
    reals[FASTEST] = most


@njit(TASK, cache=True)
def weigh(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweeps.add_row_weights`` for a range of sets."""
    (contacts,), room = sorted_of(table), room_of(table)
    for k in range(first, stop):
        sweeps.add_row_weights(room[0], contacts, room[9], k)


@njit(TASK, cache=True)
def resume(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``loading.load_kept`` and ``sweeps.resume`` for a range of sets."""
    (contacts,), (kept,), room, (_, reals, _) = sorted_of(table), stored_of(table), room_of(table), step_of(table)
    for k in range(first, stop):
        loading.load_kept(room[9], contacts, room[0], kept, k)
        sweeps.resume(room[0], room[9], kept, contacts.pair, reals[RATIO], reals[SCALE], k)


@njit(TASK, cache=True)
def sweep(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``loading.load`` and ``sweeps.sweep`` for a range of sets."""
    (contacts,), room, (counts, reals, _) = sorted_of(table), room_of(table), step_of(table)
    ahead = sweeps.momentum(counts[TURN], counts[SWEEPS])
    for k in range(first, stop):
        loading.load(room[9], contacts, room[0], reals[FASTEST], k)
        sweeps.sweep(room[0], room[9], ahead, reals[SCALE], k)


@njit(TASK, cache=True)
def give(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweeps.give`` for a range of slots, then stops the slots at walls and symmetry planes."""
    room, (counts, reals, _) = room_of(table), step_of(table)
    sweeps.give(room[0], reals[SCALE], counts[TURN] + 1 == counts[SWEEPS], first, stop)
    planes = len(bounds_of(table)[0].points)
    if planes > 0:
        stops.stop(room[0], room[10], first // SLOTS_OF_A_TASK, first * planes)


@njit(TASK, cache=True)
def turn(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Increases the number of the present sweep by one. Until all sweeps are done, the next stage is SWEEP."""
    counts, _, control = step_of(table)
    counts[TURN] += 1
    if counts[TURN] < counts[SWEEPS]:
        control[0] = SWEEP


@njit(TASK, cache=True)
def clear_pairs(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the stored impulses of a range of node-face pairs to zero."""
    (kept,) = stored_of(table)
    kept.pairs[first:stop] = 0.0


@njit(TASK, cache=True)
def clear_cracks(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: sets the stored impulses of a range of node pairs across cracks to zero."""
    (kept,) = stored_of(table)
    kept.cracks[first:stop] = 0.0


@njit(TASK, cache=True)
def store(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweeps.store`` for a range of sets."""
    (contacts,), (kept,), room = sorted_of(table), stored_of(table), room_of(table)
    for k in range(first, stop):
        sweeps.store(kept, room[9], contacts.pair, k)


@njit(TASK, cache=True)
def work(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``impulse_work.cost`` and ``impulse_work.heat`` for a range of sets, and adds the results to the sums
    of the sets.
    """
    room, (counts, reals, _), before = room_of(table), step_of(table), nodes_of(table)[1]
    _, _, _, _, _, along, friction, _, _ = sums_of(table)
    active, places, loaded = room[0], room[5], room[9]
    for k in range(first, stop):
        if counts[WORKS] & 1:
            impulse_work.cost(along[k], loaded, active, before, places, reals[JOULE], k)
        if counts[WORKS] & 2:
            impulse_work.heat(friction[k], loaded, active, before, places, reals[RUB], k)


@njit(TASK, cache=True)
def leave(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: removes the impulses of stops. Then runs ``slot_numbers.leave`` and ``impulse_work.book``, with separate
    sums for each task.
    """
    room, (v, of, owned), (loss, external), (_, reals, _) = (
        room_of(table), bodies_of(table), books_of(table), step_of(table),
    )  # fmt: skip
    (_, _, mobility, _, local), before, total, _ = nodes_of(table)
    _, _, _, _, _, _, _, left, parts = sums_of(table)
    k, planes = first // SLOTS_OF_A_TASK, len(bounds_of(table)[0].points)
    left[k], parts[k] = 0, 0
    if planes > 0:
        stops.release(room[0], room[10], k, first * planes)
    slot_numbers.leave(v, parts[k], left[k], total, room[0], room[5], local, of, owned, first, stop)
    impulse_work.book(loss, external, room[5], local, before, total, mobility, reals[SCALE], first, stop)
