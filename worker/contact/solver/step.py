"""Input of the solver in a step: arrays of the scene, of the rank and of the accounts, and numbers."""

from dataclasses import dataclass

from ...model.state import Flags, Floats, Ints, Nodes
from ..books import Books
from ..narrow_phase.rows import ActiveRows
from ..surface.records import SurfaceNodes
from .active import Kept


@dataclass(frozen=True)
class SolverStep:
    """Input and output of the solver in a step."""

    rows: ActiveRows
    """Active contacts."""
    nodes: SurfaceNodes
    """Surface nodes, with the positions, and the velocities before contact."""
    before: Floats
    """(surface_nodes, 3) v(n-1/2), m/s."""
    total: Ints
    """(surface_nodes, 3) impulses of the step, quanta; written."""
    state: Nodes
    """Nodes of the rank; their velocities are written."""
    loose: Flags
    """(nodes,) nodes without tets."""
    books: Books
    """Accounts; written."""
    unsettled: Ints
    """(2,) residual of the sweeps; see sweep_count.py; written."""
    kept: Kept
    """Stored impulses of the last step; replaced by those of this step."""
    ratio: float
    """Factor of the stored impulses at the start of the step."""
    sweeps: int
    """Number of sweeps."""
    rubs: bool
    """Whether any contact has friction."""
    size: float
    """Typical size of a face, m."""
    dt: float
    """Length of the step, s."""
