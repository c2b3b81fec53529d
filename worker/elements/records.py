"""Records of arrays that are arguments of the passes over the elements, and their numba types for signatures."""

from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.state import CHUNK, Bits, Flags, Floats, Ints, Tets
from . import scratch

LARGEST_LIMIT, LIMITING_TET, LARGEST_FORCE, WORN, HOT = range(5)
"""Indices in ``Scratch.peaks``: bit pattern of the largest 1 / stable step, 1/s; smallest global id of the tets that
have this value; bit pattern of the largest force, N; state of the tets that erosion will remove (wear.py); flag for
overstressed faces (hot.py)."""
PEAKS = 5
"""Number of values in ``Scratch.peaks``."""
_LINE = 8
"""Number of float64 in a cache line."""


class Motion(NamedTuple):
    """Nodes of a rank, and the sums of the forces on them."""

    x0: Floats
    """(nodes, 3) initial positions, m."""
    x: Floats
    """(nodes, 3) positions at n+1, m."""
    v: Floats
    """(nodes, 3) velocities at n+1/2, m/s."""
    force: Ints
    """(nodes, 4) sums of forces, quanta (model/state.py)."""


class Body(NamedTuple):
    """Elements of a block of tets of one part."""

    tets: Tets
    """(n, 4) local nodes of each tet."""
    id: Ints
    """(n,) global ids of the tets."""
    state: Floats
    """State of all tets of the block, as a flat array."""
    rows: int
    """Number of state rows."""
    params: Floats
    """Constants of the material of the block."""
    strength: int
    """Number that selects the strength law (materials/models.py)."""
    eos: int
    """Number that selects the equation of state (materials/models.py)."""
    quiet: Ints
    """(chunks, 3) marks of the chunks that are at rest, see rest.py."""
    flat: Flags
    """(n,) True for each flat tet, whose volume strain is not averaged; (0,) if no tet is flat."""
    averages: Tets
    """(n, 4) for each corner of a tet, the row of its node in Means."""


class Marks(NamedTuple):
    """Limits with which the passes compare the tets of a block, and the marks of tets beyond a limit."""

    worn: Flags
    """(n,) True for each tet that erosion will remove; (0,) if the part does not erode."""
    life: Floats
    """(5,) limits beyond which erosion removes a tet, see wear.py."""
    hot: Bits
    """(n,) overstressed faces of each tet, one bit for each face, see hot.py; (0,) if the part does not fracture."""
    weakest: Floats
    """(n,) smallest strength of the faces of each tet, Pa."""
    shear: float
    """Weight of shear traction relative to normal traction."""


class Scratch(NamedTuple):
    """Scratch memory of a thread for one chunk of tets, and the peaks over all tets that the thread has computed."""

    w: Floats
    """Scratch rows of CHUNK numbers each, see scratch.py."""
    wi: Ints
    """Nine rows of nodal forces of the tets of the chunk, quanta."""
    bits: Ints
    """Integer view of the memory of ``w``."""
    peaks: Ints
    """(5,) peaks of the thread; the indices are LARGEST_LIMIT and the following names."""


class Scratches(NamedTuple):
    """Scratch memory of all threads."""

    w: Floats
    """(threads, SCRATCH) scratch rows of each thread."""
    wi: Ints
    """(threads, 9 * CHUNK) force rows of each thread."""
    bits: Ints
    """Integer view of the memory of ``w``."""
    peaks: Ints
    """(threads, 8) peaks of each thread, one cache line each."""

    @classmethod
    def of(cls, threads: int) -> "Scratches":
        """Returns scratch memory whose rows start on a cache line, so that the speed does not depend on the address."""
        room = np.zeros(threads * scratch.SCRATCH + _LINE)
        first = -(room.ctypes.data // room.itemsize) % _LINE
        w = room[first:][: threads * scratch.SCRATCH].reshape(threads, -1)
        return cls(w, np.zeros((threads, 9 * CHUNK), np.int64), w.view(np.int64), np.zeros((threads, _LINE), np.int64))


class Means(NamedTuple):
    """Sums and means of the averaged pressure forms. The arrays have one row for each material of a node
    (elements/averages.py).
    """

    sums: Ints
    """(rows, 2 or 3) sums of volume change, of volume, and of heat or bulking if the form averages it, quanta."""
    weight: Floats
    """(rows,) 1 / reference volume, 1/m^3."""
    strain: Floats
    """(rows,) mean volume strain of the step."""
    more: Floats
    """(rows,) mean heat or bulking of the step."""
    split: bool
    """True if pressure gradients stabilise the volume strain. If False, the arrays after this field have one row."""
    pressure: Floats
    """(rows,) nodal pressure, Pa."""
    projected: Floats
    """(rows, 3) projected gradient of the pressure, Pa/m."""
    gradient: Ints
    """(rows, 3) sums of the pressure gradient, quanta."""
    matter: Floats
    """(rows, COLUMNS) nodal material state, see matter.py. The array has one row if there are no nodal pressures."""

    @classmethod
    def none(cls) -> "Means":
        """Returns the empty record that the ``standard`` form uses."""
        row, lines = np.zeros(1), np.zeros((1, 3), np.int64)
        return cls(lines, row, row, row, False, row, np.zeros((1, 3)), lines, np.zeros((1, 8)))


motion_of = attrgetter("x0", "x", "v", "force")
"""Returns the fields for Motion. The argument is an object of the class ``Nodes``."""
body_of = attrgetter("tets", "id", "flat_state", "rows", "params", "kind", "eos", "quiet", "flat", "averages")
"""Returns the fields for Body from a block."""
marks_of = attrgetter("worn", "life", "hot", "weakest", "shear_weight")
"""Returns the fields for Marks from a block."""
_F1, _F2, _I1, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]
_B1, _INT, _FLAG, _T2 = types.boolean[::1], types.int64, types.boolean, types.uint32[:, ::1]
MOTION = record(Motion, _F2, _F2, _F2, _I2)
BODY = record(Body, _T2, _I1, _F1, _INT, _F1, _INT, _INT, _I2, _B1, _T2)
MARKS = record(Marks, _B1, _F1, types.uint8[::1], _F1, types.float64)
SCRATCH = record(Scratch, _F1, _I1, _I1, _I1)
SCRATCHES = record(Scratches, _F2, _I2, _I2, _I2)
MEANS = record(Means, _I2, _F1, _F1, _F1, _FLAG, _F1, _F2, _I2, _F2)
