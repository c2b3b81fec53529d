"""Columns of the cohesive facets and their numba types. There are three groups: constants, columns that unloading
changes, and columns that every step changes.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.growing import extended
from ..model.state import Flags, Floats, Indices, Ints


class FacetConstants(NamedTuple):
    """Columns of a facet that are constant after its insertion, in SI units."""

    energy: Floats
    """(m,) fracture energy per area, J/m^2."""
    area: Floats
    """(m,) area at insertion, m^2."""
    shear: Floats
    """(m,) weight b^2 of shear in the effective opening."""


class Softening(NamedTuple):
    """Traction-separation law of each pair of nodes; only unloading changes the law (law.py)."""

    strength: Floats
    """(m, 3) traction at which softening begins, Pa."""
    critical: Floats
    """(m, 3) opening from the start of softening to zero traction, m."""
    knee: Floats
    """(m, 3) size D of the opening at which softening begins, m."""
    lent: Floats
    """(m, 3) effective opening D at insertion, e, m; a pair whose effective opening becomes smaller than e would
    release more energy than it absorbed. Unloading of the pair decreases e, possibly to 0."""
    offset: Floats
    """(m, 3, 3) offset of the opening, m; its components are along the normal, along the first edge, and perpendicular
    to both."""


class PairState(NamedTuple):
    """Present state of each pair of nodes. Every step changes the state."""

    top: Floats
    """(m, 3) largest effective opening D so far, including the offset, m; the value is never below the opening at which
    softening begins."""
    size: Floats
    """(m, 3) present effective opening D, m."""
    opening: Floats
    """(m, 3, 3) position of the node of the second side relative to the node of the first side, m."""
    pull: Floats
    """(m, 3, 3) force on the node of the first side, N."""
    work: Floats
    """(m, 3) work done on the pair so far, J."""
    foreseen: Floats
    """(m, 3, 3) opening velocity, m/s, that would result if only the nodal forces of the last step acted."""


class Facets(NamedTuple):
    """Cohesive facets of one rank. A facet belongs to the rank that has its tet of smaller id."""

    tets: Ints
    """(m, 2) global ids of the tets of the two sides."""
    nodes: Indices
    """(m, 6) local nodes: three nodes of the first side, counter-clockwise seen from outside of its tet, then the
    opposite nodes of the second side."""
    constants: FacetConstants
    softening: Softening
    state: PairState

    @classmethod
    def of(cls, columns: Mapping[str, Any]) -> "Facets":
        """Builds the records from a dictionary of all columns; the keys are the names of the columns."""
        constants = FacetConstants(*(columns[name] for name in FacetConstants._fields))
        softening = Softening(*(columns[name] for name in Softening._fields))
        state = PairState(*(columns[name] for name in PairState._fields))
        return cls(columns["tets"], columns["nodes"], constants, softening, state)

    @classmethod
    def none(cls) -> "Facets":
        """Returns a table with no facet."""
        one, three, nine = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
        return cls(
            np.zeros((0, 2), np.int64), np.zeros((0, 6), np.int32), FacetConstants(one, one, one),
            Softening(three, three, three, three, nine), PairState(three, three, nine, nine, three, nine),
        )  # fmt: skip

    def columns(self) -> dict[str, Any]:
        """Returns all columns as a dictionary; the keys are the names of the columns."""
        records = (self.constants, self.softening, self.state)
        columns = {name: column for each in records for name, column in each._asdict().items()}
        return {"tets": self.tets, "nodes": self.nodes, **columns}

    def take(self, chosen: Flags) -> "Facets":
        """Returns the facets for which ``chosen`` (m,) is True."""
        return Facets.of({name: column[chosen] for name, column in self.columns().items()})

    def and_more(self, new: "Facets") -> "Facets":
        """Returns a table of the present facets, followed by the ``new`` facets."""
        rows = new.columns()
        return Facets.of({name: extended(column, rows[name]) for name, column in self.columns().items()})


_F1, _F2, _F3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
COLUMNS = (
    types.int64[:, ::1], types.int32[:, ::1], record(FacetConstants, _F1, _F1, _F1),
    record(Softening, _F2, _F2, _F2, _F2, _F3), record(PairState, _F2, _F2, _F3, _F3, _F2, _F3),
)  # fmt: skip
"""Numba types of the fields of Facets."""
FACETS = record(Facets, *COLUMNS)
