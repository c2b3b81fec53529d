"""The columns of cohesive facets, by what changes them, and their numba types."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.state import Flags, Floats, Indices, Ints, extended


class FacetConstants(NamedTuple):
    """What a facet keeps from its insertion on. SI."""

    energy: Floats
    """(m,) J/m^2."""
    area: Floats
    """(m,) at insertion."""
    shear: Floats
    """(m,) b^2."""


class Softening(NamedTuple):
    """The law of each pair of nodes; letting go changes it (law.py)."""

    strength: Floats
    """(m, 3) where the traction begins to fall."""
    critical: Floats
    """(m, 3) from there to where nothing is left."""
    knee: Floats
    """(m, 3) size of the opening at which the traction begins to fall."""
    lent: Floats
    """(m, 3) that down to which it gives back what it has taken: e, less or 0 once it has let go."""
    offset: Floats
    """(m, 3, 3) along the normal, along the first edge, and across both."""


class PairState(NamedTuple):
    """How far each pair has opened; every step changes it."""

    top: Floats
    """(m, 3) largest size of the opening so far, offset included, and the knee at least."""
    size: Floats
    """(m, 3) the present one."""
    opening: Floats
    """(m, 3, 3) how far the nodes are apart."""
    pull: Floats
    """(m, 3, 3) force on the node of the first side, N."""
    work: Floats
    """(m, 3) done on the pair so far, J."""
    foreseen: Floats
    """(m, 3, 3) velocity of opening, m/s, that the forces of the last step would have led to by themselves."""


class Facets(NamedTuple):
    """The cohesive facets of one rank: those whose side of smaller tet id is its own."""

    tets: Ints
    """(m, 2) global ids of the tets of either side."""
    nodes: Indices
    """(m, 6) local nodes of the first side, counter-clockwise seen from outside of it, and those across."""
    constants: FacetConstants
    softening: Softening
    state: PairState

    @classmethod
    def of(cls, columns: Mapping[str, Any]) -> "Facets":
        """From all columns by name."""
        constants = FacetConstants(*(columns[name] for name in FacetConstants._fields))
        softening = Softening(*(columns[name] for name in Softening._fields))
        state = PairState(*(columns[name] for name in PairState._fields))
        return cls(columns["tets"], columns["nodes"], constants, softening, state)

    @classmethod
    def none(cls) -> "Facets":
        """No facets."""
        one, three, nine = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
        return cls(
            np.zeros((0, 2), np.int64), np.zeros((0, 6), np.int32), FacetConstants(one, one, one),
            Softening(three, three, three, three, nine), PairState(three, three, nine, nine, three, nine),
        )  # fmt: skip

    def columns(self) -> dict[str, Any]:
        """All columns by name."""
        records = (self.constants, self.softening, self.state)
        columns = {name: column for each in records for name, column in each._asdict().items()}
        return {"tets": self.tets, "nodes": self.nodes, **columns}

    def take(self, chosen: Flags) -> "Facets":
        """Some of them."""
        return Facets.of({name: column[chosen] for name, column in self.columns().items()})

    def and_more(self, new: "Facets") -> "Facets":
        """These and then the ``new`` ones."""
        rows = new.columns()
        return Facets.of({name: extended(column, rows[name]) for name, column in self.columns().items()})


_F1, _F2, _F3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
FACETS = record(
    Facets, types.int64[:, ::1], types.int32[:, ::1], record(FacetConstants, _F1, _F1, _F1),
    record(Softening, _F2, _F2, _F2, _F2, _F3), record(PairState, _F2, _F2, _F3, _F3, _F2, _F3),
)  # fmt: skip
