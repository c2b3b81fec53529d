"""Input of the solver in a step: arrays of the scene, of the rank and of the accounts, and some numbers."""

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
    """Surface nodes with their positions, and their velocities before contact."""
    before: Floats
    """(surface_nodes, 3) velocities v(n-1/2), m/s."""
    total: Ints
    """(surface_nodes, 3) impulses of the step, quanta; the solver writes this array."""
    state: Nodes
    """Nodes of the rank; the solver writes their velocities."""
    loose: Flags
    """(nodes,) True for each node that has no tets."""
    books: Books
    """Accounts of energies and impulses; the solver adds to them."""
    unsettled: Ints
    """(2,) residual of the sweeps (sweep_count.py); the solver writes this array."""
    kept: Kept
    """Stored impulses of the last step. The solver replaces the stored impulses by the impulses of this step."""
    ratio: float
    """Factor by which the stored impulses are multiplied at the start of the step."""
    sweeps: int
    """Number of sweeps."""
    rubs: bool
    """True if any contact has friction."""
    size: float
    """Typical size of a face, m."""
    dt: float
    """Length of the step, s."""
