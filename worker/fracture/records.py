"""Records of arrays that the kernels of fracture take, and their numba types for signatures."""

from typing import NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.state import Bits, Flags, Floats, Indices, Ints, Tets


class Mesh(NamedTuple):
    """The tets of a body."""

    tets: Tets
    """(n, 4) local nodes of each tet."""
    id: Ints
    """(n,) global ids of the tets."""
    across: Indices
    """(n, 4) the side behind each face at the start, 4 * global tet id + local face; -1 for an exposed face."""
    beside: Indices
    """(n, 4) place of the tet behind each face; -1 for no tet, -2 for one on another rank."""
    bond: Bits
    """(n, 4) state of each facet: INTACT, BROKEN or WIDE."""
    intact: Bits
    """(n,) bit k: facet k is intact, and both of its tets are in the block."""
    state: Floats
    """State of the whole block, flat."""
    columns: int
    """Number of state rows."""


class FacetTable(NamedTuple):
    """Facets of a body, by place and local face of the tet of smaller id, or of the only one in the block."""

    strength: Floats
    """(n, 4) strength of each facet, Pa, equal on both sides; infinite on the surface."""
    since: Floats
    """(n, 4) start time of the clock of the delayed criterion, s."""
    seen: Ints
    """(n, 4) number of the last step in which the facet was overstressed. The clock continues if this was the
    previous step."""


class InterfaceFacets(NamedTuple):
    """Facets whose other tet is on another rank, or in another block of this one, by rank and id of the facet; a facet
    between two blocks has a row for each side.
    """

    sides: Indices
    """(m, 2) place and face of this rank's tet."""
    first: Flags
    """(m,) whether this rank has the tet of smaller id."""
    mass: Floats
    """(m,) mass of the other tet, kg."""
    own: Floats
    """(m, 3) traction of this rank's tet on the outward normal of the tet of smaller id, Pa."""
    theirs: Floats
    """(m, 3) traction of the other tet on the same normal, Pa."""
    of: Ints
    """(m,) index of the other rank among the neighbours; the number of neighbours for this rank."""
    hot: Ints
    """(neighbours + 1,) 1 if a facet shared with that rank is overstressed on either side, else 0; the last entry is
    for facets between two blocks of this rank."""
    there: Indices
    """(m, 3) block, place and face of the other tet of a facet between two blocks of this rank, else -1."""


class Law(NamedTuple):
    """Constants of the criterion of a body."""

    weight: float
    """Weight of shear against normal traction."""
    friction: float
    """Coefficient of internal friction."""
    delay: float
    """t_c times the square of the strength, Pa^2 s."""


class Candidates(NamedTuple):
    """Intact facets whose traction reaches their strength in a step: first the facets within the rank, then shared
    facets.
    """

    place: Ints
    """(m,) place of the tet of smaller id; of this rank's tet for a shared facet."""
    face: Ints
    """(m,) local face of the tet in ``place``."""
    shared: Ints
    """(m,) row of a shared facet, -1 for one within the rank."""
    traction: Floats
    """(m, 4) traction on the outward normal of the tet of smaller id, and the effective one, Pa."""

    @classmethod
    def of(cls, m: int) -> "Candidates":
        """Allocates arrays for ``m`` facets."""
        places = np.empty((3, m), np.int64)
        return cls(places[0], places[1], places[2], np.empty((m, 4)))

    def first(self, n: int) -> "Candidates":
        """Returns the first ``n`` rows."""
        return Candidates(self.place[:n], self.face[:n], self.shared[:n], self.traction[:n])


class BreakingFacets(NamedTuple):
    """Facets that break in a step."""

    faces: Ints
    """(m, 2) global ids of the faces of either side, 4 * tet + local face, the smaller first."""
    nodes: Indices
    """(m, 3) local nodes, counter-clockwise seen from outside of the first side."""
    sides: Indices
    """(m, 2, 3) block, place and face of either side, -1 for a side on another rank."""
    first: Flags
    """(m,) true if the first side is on this rank."""
    traction: Floats
    """(m, 4) traction on the outward normal of the first side, and the effective one, Pa."""
    mass: Floats
    """(m,) mass of the lighter tet, kg."""

    @property
    def tets(self) -> Ints:
        """(m, 2) global ids of the tets of either side."""
        return self.faces // 4

    def take(self, chosen: Flags) -> "BreakingFacets":
        """Returns the chosen facets."""
        return BreakingFacets(
            self.faces[chosen], self.nodes[chosen], self.sides[chosen], self.first[chosen], self.traction[chosen],
            self.mass[chosen],
        )  # fmt: skip


_I1, _I2, _N2, _N3 = types.int64[::1], types.int64[:, ::1], types.int32[:, ::1], types.int32[:, :, ::1]
_F1, _F2, _B1 = types.float64[::1], types.float64[:, ::1], types.boolean[::1]
POINTS = _F2
"""Numba type of positions; the other types are types of the records."""
MESH = record(Mesh, types.uint32[:, ::1], _I1, _N2, _N2, types.uint8[:, ::1], types.uint8[::1], _F1, types.int64)
TABLE = record(FacetTable, _F2, _F2, _I2)
INTERFACE = record(InterfaceFacets, _N2, _B1, _F1, _F2, _F2, _I1, _I1, _N2)
LAW = record(Law, types.float64, types.float64, types.float64)
CANDIDATES = record(Candidates, _I1, _I1, _I1, _F2)
BREAKING = record(BreakingFacets, _I2, _N2, _N3, _B1, _F2, _F1)
