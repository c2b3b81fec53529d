"""Distances of slots, faces and edges from their reference motions in a step. The threads of a rank compute the
distances in passes.
"""

import numpy as np

from ...kernels.jit import njit, types
from ...model.growing import Scratch
from ...model.state import Flags, Floats, Indices
from ...parallel.arguments import reader
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from .reference_motion import ReferenceMotion, farthest, largest, leave

_SLOTS, _ROWS = 4096, 8192
"""Number of slots in a task, and number of faces or edges in a task. Chosen values: each task takes 20 us, compared
with 2 us to start a parallel region."""
_F, _I, _F1, _F2, _N2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1], types.int32[:, ::1]
_LINE = _F1, _F2, _F2
_LEAVE = *_LINE, *_LINE, _F2, _F2, _F, _F, types.boolean[::1], _F1
_LARGEST = _F1, _N2, _I, _F1
_leave, _largest = reader(*_LEAVE), reader(*_LARGEST)


@njit(TASK, cache=True)
def _slots(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``reference_motion.leave`` for the search lines and the short lines, and ``farthest`` for the search
    lines.
    """
    left, line, course, near, short, mean, x, v, t, dt, tracked, most = _leave(table)
    leave(left, line, course, x, v, t, dt, first, stop)
    leave(near, short, mean, x, v, t, dt, first, stop)
    most[first // _SLOTS] = farthest(left, tracked, first, stop)


@njit(TASK, cache=True)
def _corners(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: runs ``reference_motion.largest`` for a range of faces or edges."""
    out, corners, many, left = _largest(table)
    largest(out, corners, many, left, first, stop)


class Deviation:
    """Passes over the slots, faces and edges of the scenes of a rank."""

    def __init__(self, team: Team) -> None:
        self._slots = Pass(team, _slots, *_LEAVE, size=_SLOTS)
        self._faces, self._edges = (Pass(team, _corners, *_LARGEST, size=_ROWS) for _ in range(2))
        self._scratch = Scratch()

    def measure(
        self, motion: ReferenceMotion, x: Floats, v: Floats, faces: Indices, edges: Indices, tracked: Flags
    ) -> float:  # fmt: skip
        """Sets the distances of slots, faces and edges from their lines, during the step and during the time
        ``motion.beyond`` after it. ``x``, ``v`` (slots, 3): positions, and velocities before contact. Returns the
        largest distance of the ``tracked`` (slots,) slots from their search lines, m.
        """
        strayed = self.of_slots(motion, x, v, tracked)
        self._faces.run(len(faces), motion.faces, faces, 3, motion.short.left)
        self._edges.run(len(edges), motion.edges, edges, 2, motion.short.left)
        return strayed

    def of_slots(self, motion: ReferenceMotion, x: Floats, v: Floats, tracked: Flags) -> float:
        """Sets the distances of the slots only; see ``measure``."""
        n, dt, searched, short = len(x), motion.end - motion.t + motion.beyond, motion.searched, motion.short
        most = self._scratch.of("most", self._slots.many(n), np.float64)
        lines = searched.left, searched.x, searched.course, short.left, short.x, short.course
        self._slots.run(n, *lines, x, v, motion.t, dt, tracked, most)
        return float(most.max(initial=0.0))
