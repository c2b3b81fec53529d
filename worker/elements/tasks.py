"""Passes over the elements as tasks of a team of threads (parallel/team.py). Each thread has its own scratch memory."""

from ..kernels.jit import njit, types
from ..parallel.arguments import reader
from ..parallel.team import TASK
from . import sweep
from .records import BODY, MARKS, MEANS, MOTION, SCRATCHES, Scratch

_F = types.float64
STANDARD = MOTION, BODY, MARKS, SCRATCHES, _F, _F
STRAINS = MOTION, BODY, MARKS, SCRATCHES, MEANS, _F
FORCES = MOTION, BODY, MARKS, SCRATCHES, MEANS, _F, _F
AGAIN = MOTION, BODY, SCRATCHES, MEANS, _F
_standard, _strains, _forces, _again = reader(*STANDARD), reader(*STRAINS), reader(*FORCES), reader(*AGAIN)


@njit(TASK, cache=True, error_model="numpy")
def standard(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweep.standard_pass`` for a range of chunks."""
    motion, body, marks, rooms, dt, scale = _standard(table)
    scratch = Scratch(rooms.w[thread], rooms.wi[thread], rooms.bits[thread], rooms.peaks[thread])
    sweep.standard_pass(motion, body, marks, scratch, begin, end, dt, scale)


@njit(TASK, cache=True, error_model="numpy")
def strains(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweep.strain_pass`` for a range of chunks."""
    motion, body, marks, rooms, means, dt = _strains(table)
    scratch = Scratch(rooms.w[thread], rooms.wi[thread], rooms.bits[thread], rooms.peaks[thread])
    sweep.strain_pass(motion, body, marks, scratch, means, begin, end, dt)


@njit(TASK, cache=True, error_model="numpy")
def forces(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweep.force_pass`` for a range of chunks."""
    motion, body, marks, rooms, means, dt, scale = _forces(table)
    scratch = Scratch(rooms.w[thread], rooms.wi[thread], rooms.bits[thread], rooms.peaks[thread])
    sweep.force_pass(motion, body, marks, scratch, means, begin, end, dt, scale)


@njit(TASK, cache=True, error_model="numpy")
def again(table, begin, end, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``sweep.forces_again`` for a range of chunks."""
    motion, body, rooms, means, scale = _again(table)
    scratch = Scratch(rooms.w[thread], rooms.wi[thread], rooms.bits[thread], rooms.peaks[thread])
    sweep.forces_again(motion, body, scratch, means, begin, end, scale)
