"""Numbers of a program of quiet steps (stretch.py), and the stage ``decide``, which ends a step or the program."""

import math
from typing import NamedTuple

import numpy as np

from .clock import DT, LAST_DT, LOST, MEAN_DT, SHORTER, STABLE, T, advanced, chosen
from .elements.chunks import gather_peaks
from .elements.records import HOT, LARGEST_FORCE, LARGEST_LIMIT, WORN
from .kernels.jit import njit, record, types
from .model.state import Floats, Ints
from .parallel.arguments import reader
from .parallel.fixed_point import outgrown, scale_for
from .parallel.team import TASK
from .parallel.words import now, write_real

SCALE, NEXT_SCALE, IMPULSE_QUANTUM, SHORTER_QUANTUM = range(STABLE + 1, STABLE + 5)
"""Indices of the numbers that follow those of the clock: quanta per newton of the present forces, and of the next
forces; mean of two time steps divided by the scale, N s; a quarter of the difference of two time steps divided by the
scale (motion.py)."""
SAFETY, GROWTH, LEAST_STABLE, LANDING, NEXT, FLOOR, MANY = range(SHORTER_QUANTUM + 1, SHORTER_QUANTUM + 8)
"""Indices of numbers that are constant in a program: limits of the clock (``Clock.limits``); simulated time of the
first output or request, s; force, N, that limits the force quantum from below. MANY: count of all numbers."""
STOP, CONTROL, STEPS, MOST_STEPS, DEADLINE, TIME = range(6)
"""Indices of the words of a program: 0, or the reason why the program ends; number of the next stage
(parallel/program.py); number of steps so far, and largest number of steps; wall time at which the program ends, ns; two
words in which the wall clock is read."""
SCHEDULED, EVENT = 1, 2
"""Reasons why a program ends."""
SIZE = TIME + 2
"""Count of the words of a program."""
_END = 1 << 62
"""Number of a stage that does not exist; it ends the program."""


class Ties(NamedTuple):
    """Words in the argument tables of all stages that depend on the numbers of the program (parallel/arguments.py)."""

    number: Ints
    """(k,) index of the number that determines each word."""
    factor: Floats
    """(k,) constant factor of each word."""
    address: Ints
    """(k,) address of each word."""


_F1, _I1, _I2 = types.float64[::1], types.int64[::1], types.int64[:, ::1]
_TIES = record(Ties, _I1, _F1, _I1)
DECIDE = _I1, _F1, _I2, _TIES
"""Types of the arguments of ``decide``: words, numbers, peaks of each thread (elements/records.py), and ties of the
words in argument tables."""
_of_decide = reader(*DECIDE)


@njit(types.void(_F1, _TIES), cache=True, error_model="numpy")
def spread(numbers, ties):  # type: ignore[no-untyped-def]
    """Computes the force quanta from the time steps and the scale. Writes the numbers into the argument tables of the
    stages.
    """
    numbers[IMPULSE_QUANTUM] = numbers[MEAN_DT] / numbers[SCALE]
    numbers[SHORTER_QUANTUM] = numbers[SHORTER] / numbers[SCALE]
    for k in range(len(ties.number)):
        write_real(ties.address[k], numbers[ties.number[k]] * ties.factor[k])


@njit("int64(int64[::1], float64[::1], int64[::1])", cache=True, error_model="numpy")
def _ends(words, numbers, peaks):  # type: ignore[no-untyped-def]
    """Returns whether code outside of the program must complete the step. EVENT: a tet or a force has failed, erosion
    will remove a tet, or a face is overstressed; SCHEDULED: an output or a request is scheduled; 0: neither.
    """
    limit = np.int64(peaks[LARGEST_LIMIT]).view(np.float64)
    force = np.int64(peaks[LARGEST_FORCE]).view(np.float64)
    if not (math.isfinite(limit) and math.isfinite(force)) or outgrown(force, numbers[SCALE]):
        return EVENT
    if peaks[WORN] != 0 or peaks[HOT] != 0:
        return EVENT
    late = words[STEPS] >= words[MOST_STEPS] or now(words, TIME) >= words[DEADLINE]
    return SCHEDULED if late or numbers[T] >= numbers[NEXT] else 0


@njit(TASK, cache=True, error_model="numpy")
def decide(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: executes the stage ``decide``, which follows the elements. The stage advances the simulated time. Then the
    stage either ends the program, or chooses the next time step in the same way as step.py and prepares all argument
    tables for this step.
    """
    words, numbers, peaks, ties = _of_decide(table)
    gather_peaks(peaks)
    numbers[SCALE] = numbers[NEXT_SCALE]
    numbers[T], numbers[LOST] = advanced(numbers[T], numbers[LOST], numbers[DT], numbers[LANDING])
    words[STEPS] += 1
    words[STOP] = _ends(words, numbers, peaks[0])
    if words[STOP] != 0:
        words[CONTROL] = _END
        return
    limit = np.int64(peaks[0, LARGEST_LIMIT]).view(np.float64)
    last_dt, left = numbers[DT], numbers[LANDING] - numbers[T]
    stable, dt, mean_dt, shorter = chosen(limit, numbers[SAFETY], numbers[GROWTH], numbers[STABLE], last_dt, left)
    if stable < numbers[LEAST_STABLE]:
        words[STOP], words[CONTROL] = EVENT, _END
        return
    numbers[STABLE], numbers[LAST_DT], numbers[DT] = stable, last_dt, dt
    numbers[MEAN_DT], numbers[SHORTER] = mean_dt, shorter
    force = np.int64(peaks[0, LARGEST_FORCE]).view(np.float64)
    numbers[NEXT_SCALE] = scale_for(max(force, numbers[FLOOR]))
    peaks[:] = 0
    spread(numbers, ties)
