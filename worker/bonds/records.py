"""Records of the tied rows of a rank: what the kernels of sweeps.py and law.py take."""

from typing import NamedTuple

from ..kernels.jit import record, types
from ..model.state import Floats, Indices, Ints

PUSH, LAST, SPEED, DAMAGE, OPENING, WIDEST, NORMAL = 0, 3, 6, 9, 10, 11, 12
"""First words of a row's ``TiedRows.state``: impulse on the tied node (3), N s, and before momentum took it ahead (3);
the relative velocity after the last step (3), m/s; damage, 0 intact, 1 apart; distance across the interface by which it
has opened, and the largest so far, m; unit normal out of the slave (3)."""
STATE = 15
"""Words of it."""
KEPT = 12
"""Of these, the first that a run must remember."""
STRENGTH, SHEAR_STRENGTH, ENERGY, SHEAR_ENERGY, BREAKS = range(5)
"""Columns of ``TiedRows.laws``: Pa, J/m^2, and 1 for a bond that may break, else 0."""


class TiedRows(NamedTuple):
    """Rows that this rank computes: their nodes stand in the table of layout.py."""

    node: Indices
    """(r,) the tied node."""
    begin: Ints
    """(r + 1,) where the weights of each row begin."""
    master: Indices
    """(e,) the nodes that it is tied to."""
    weight: Floats
    """(e,)."""
    area: Floats
    """(r,) m^2."""
    inverse: Floats
    """(r, 3) one over the bound of the l1 norm of the row, by axis, kg; 0 along an axis that the row leaves alone. Of a
    row that may break the others are equal."""
    bond: Indices
    """(r,) row of ``laws``."""
    laws: Floats
    """(b, 5)."""
    side: Ints
    """(r + 1,) where the slave faces at each tied node begin."""
    face: Indices
    """(s, 3) their corners."""
    state: Floats
    """(r, STATE)."""
    change: Floats
    """(r, 3) of the impulse in this sweep, N s."""
    own: Ints
    """(r, 3) the same as the tied node gets it, quanta."""


class TiedNodes(NamedTuple):
    """The table of nodes, by global id, and the rows that push each."""

    x: Floats
    """(n, 3) m."""
    v: Floats
    """(n, 3) m/s."""
    mobility: Floats
    """(n, 3) 1/kg."""
    words: Ints
    """(n, 3) impulses of a sweep, quanta."""
    total: Ints
    """(n, 3) of the step."""
    first: Ints
    """(n + 1,) where the entries of each node begin."""
    row: Indices
    """(m,) which row pushes it."""
    share: Floats
    """(m,) weight of the node in that row; NaN: it is the tied one."""


_F1, _F2, _I1, _I2, _N1, _N2 = (
    types.float64[::1], types.float64[:, ::1], types.int64[::1], types.int64[:, ::1], types.int32[::1],
    types.int32[:, ::1],
)  # fmt: skip
ROWS = record(TiedRows, _N1, _I1, _N1, _F1, _F1, _F2, _N1, _F2, _I1, _N2, _F2, _F2, _I2)
NODES = record(TiedNodes, _F2, _F2, _F2, _I2, _I2, _I1, _N1, _F1)
