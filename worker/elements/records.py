"""Records of arrays that the passes over the elements take, and their numba types for signatures."""

from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.state import CHUNK, Bits, Flags, Floats, Ints, Tets
from . import scratch

LARGEST_LIMIT, LIMITING_TET, LARGEST_FORCE, WORN, HOT = range(5)
"""Places in ``Scratch.peaks``: bits of the largest one-over-stable-step, 1/s; smallest global id of the tets that
have it; bits of the largest force, N; state of the worn tets (wear.py); whether faces are overstressed (hot.py)."""
PEAKS = 5
"""Number of places in ``Scratch.peaks``."""
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
    """(nodes, 3) sums of forces, quanta."""


class Body(NamedTuple):
    """Elements of a block."""

    tets: Tets
    """(n, 4) local nodes of each tet."""
    id: Ints
    """(n,) global ids of the tets."""
    state: Floats
    """State of the whole block, flat."""
    rows: int
    """Number of state rows."""
    params: Floats
    """Constants of the material of the block."""
    strength: int
    """Number of the strength law (materials/models.py)."""
    eos: int
    """Number of the equation of state."""
    quiet: Ints
    """(chunks, 3) marks of chunks at rest, see rest.py."""
    flat: Flags
    """(n,) flat tets, whose volume strain is not averaged; (0,) if there is none."""
    averages: Tets
    """(n, 4) for each corner the row of the Means."""


class Marks(NamedTuple):
    """Limits that the passes compare the tets of a block with, and the tets that they mark."""

    worn: Flags
    """(n,) worn tets, which will be removed; (0,) if the part does not erode."""
    life: Floats
    """(5,) limits of worn tets, see wear.py."""
    hot: Bits
    """(n,) overstressed faces as bits, see hot.py; (0,) if the part does not fracture."""
    weakest: Floats
    """(n,) smallest strength of the faces of each tet, Pa."""
    shear: float
    """Weight of shear against normal traction."""


class Scratch(NamedTuple):
    """Scratch for one chunk, and the peaks over all tets of a thread."""

    w: Floats
    """Scratch rows of CHUNK numbers each, see scratch.py."""
    wi: Ints
    """Nine rows of nodal forces of the tets of the chunk, quanta."""
    bits: Ints
    """Same memory as ``w``, as integers."""
    peaks: Ints
    """(5,) peaks of the thread: see LARGEST_LIMIT and the following names."""


class Scratches(NamedTuple):
    """A scratch for each thread."""

    w: Floats
    """(threads, SCRATCH) scratch rows of each thread."""
    wi: Ints
    """(threads, 9 * CHUNK) force rows of each thread."""
    bits: Ints
    """Same memory as ``w``, as integers."""
    peaks: Ints
    """(threads, 8) a cache line for each thread."""

    @classmethod
    def of(cls, threads: int) -> "Scratches":
        """Returns rows that start on a cache line, so that the speed does not depend on the address."""
        room = np.zeros(threads * scratch.SCRATCH + _LINE)
        first = -(room.ctypes.data // room.itemsize) % _LINE
        w = room[first:][: threads * scratch.SCRATCH].reshape(threads, -1)
        return cls(w, np.zeros((threads, 9 * CHUNK), np.int64), w.view(np.int64), np.zeros((threads, _LINE), np.int64))


class Means(NamedTuple):
    """Sums and means of the averaged pressure forms: a row for each node, and for each further material of a node
    (elements/averages.py).
    """

    sums: Ints
    """(rows, 2 or 3) sums of volume change and volume, and of heat or bulking if averaged, quanta."""
    weight: Floats
    """(rows,) one over the reference volume, 1/m^3."""
    strain: Floats
    """(rows,) mean volume strain of each row in the step."""
    more: Floats
    """(rows,) heat or bulking of the step."""
    split: bool
    """True if pressure gradients stabilise; else the arrays below have one row."""
    pressure: Floats
    """(rows,) nodal pressure of each row, Pa."""
    projected: Floats
    """(rows, 3) projected gradient of the pressure, Pa/m."""
    gradient: Ints
    """(rows, 3) sums of the pressure gradient, quanta."""
    matter: Floats
    """(rows, COLUMNS) material state at the nodes, see matter.py; one row if there are no nodal pressures."""

    @classmethod
    def none(cls) -> "Means":
        """Returns the means of the ``standard`` form."""
        row, lines = np.zeros(1), np.zeros((1, 3), np.int64)
        return cls(lines, row, row, row, False, row, np.zeros((1, 3)), lines, np.zeros((1, 8)))


motion_of = attrgetter("x0", "x", "v", "force")
"""Function of ``Nodes``: the fields of their Motion."""
body_of = attrgetter("tets", "id", "flat_state", "rows", "params", "kind", "eos", "quiet", "flat", "averages")
"""Function of a block: the fields of its Body."""
marks_of = attrgetter("worn", "life", "hot", "weakest", "shear_weight")
"""Function of a block: the fields of its Marks."""
_F1, _F2, _I1, _I2 = types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1]
_B1, _INT, _FLAG, _T2 = types.boolean[::1], types.int64, types.boolean, types.uint32[:, ::1]
MOTION = record(Motion, _F2, _F2, _F2, _I2)
BODY = record(Body, _T2, _I1, _F1, _INT, _F1, _INT, _INT, _I2, _B1, _T2)
MARKS = record(Marks, _B1, _F1, types.uint8[::1], _F1, types.float64)
SCRATCH = record(Scratch, _F1, _I1, _I1, _I1)
SCRATCHES = record(Scratches, _F2, _I2, _I2, _I2)
MEANS = record(Means, _I2, _F1, _F1, _F1, _FLAG, _F1, _F2, _I2, _F2)
