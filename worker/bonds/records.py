"""Records of the tied rows of a rank, which are arguments of the kernels in sweeps.py and law.py."""

from typing import NamedTuple

from ..kernels.jit import record, types
from ..model.state import Floats, Indices, Ints

PUSH, LAST, SPEED, DAMAGE, OPENING, WIDEST, NORMAL = 0, 3, 6, 9, 10, 11, 12
"""Places in a row of ``TiedRows.state``: impulse on the tied node (3), N s; the impulse before Nesterov's extrapolation
(3), N s; relative velocity after the last step (3), m/s; damage, 0 intact, 1 failed; present opening across the
interface, m; largest opening so far, m; unit normal out of the tied side (3)."""
STATE = 15
"""Number of places in a row of ``TiedRows.state``."""
KEPT = 12
"""Number of places in a row of ``TiedRows.state`` that a checkpoint contains; these are the first places."""
STRENGTH, SHEAR_STRENGTH, ENERGY, SHEAR_ENERGY, BREAKS = range(5)
"""Columns of ``TiedRows.laws``: strengths, Pa, fracture energies, J/m^2, and 1 for a bond that may break, else 0."""


class TiedRows(NamedTuple):
    """Tied rows that this rank computes. Nodes are given by their places in the table of layout.py."""

    node: Indices
    """(r,) tied node of each row."""
    begin: Ints
    """(r + 1,) index of the first weight of each row."""
    master: Indices
    """(e,) mortar nodes of each row."""
    weight: Floats
    """(e,) weights of the mortar nodes."""
    area: Floats
    """(r,) area of the interface that belongs to each row, m^2."""
    inverse: Floats
    """(r, 3) 1 / bound of the l1 norm of each row, for each axis, kg; the value is 0 for an axis that the row does not
    constrain. In a row that may break, the values of the other axes are equal."""
    bond: Indices
    """(r,) index in ``laws`` of the bond of each row."""
    laws: Floats
    """(b, 5) constants of the bonds."""
    side: Ints
    """(r + 1,) index of the first tied face at each tied node."""
    face: Indices
    """(s, 3) corners of the tied faces at each tied node."""
    state: Floats
    """(r, STATE) state of each row."""
    change: Floats
    """(r, 3) change of the impulse in this sweep, N s."""
    own: Ints
    """(r, 3) change of the impulse on the tied node in this sweep, quanta."""


class TiedNodes(NamedTuple):
    """Table of nodes, ordered by global id, and the rows that apply impulses to each node."""

    x: Floats
    """(n, 3) positions of the nodes, m."""
    v: Floats
    """(n, 3) velocities of the nodes, m/s."""
    mobility: Floats
    """(n, 3) mobilities (inverse masses) of the nodes, 1/kg."""
    words: Ints
    """(n, 3) sums of the impulses of a sweep, quanta."""
    total: Ints
    """(n, 3) sums of the impulses of the step, quanta."""
    first: Ints
    """(n + 1,) index of the first entry of each node in ``row`` and ``share``."""
    row: Indices
    """(m,) number of each row that applies an impulse to the node."""
    share: Floats
    """(m,) weight of the node in this row; NaN for the tied node."""


_F1, _F2, _I1, _I2, _N1, _N2 = (
    types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1], types.int32[::1],
    types.int32[:, ::1],
)  # fmt: skip
ROWS = record(TiedRows, _N1, _I1, _N1, _F1, _F1, _F2, _N1, _F2, _I1, _N2, _F2, _F2, _I2)
NODES = record(TiedNodes, _F2, _F2, _F2, _I2, _I2, _I1, _N1, _F1)
