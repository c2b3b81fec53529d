"""Records of arrays that are arguments of the fracture kernels, and their numba types for signatures."""

from typing import NamedTuple

import numpy as np

from ..kernels.jit import record, types
from ..model.state import Bits, Flags, Floats, Indices, Ints, Tets


class Mesh(NamedTuple):
    """The tets of a body, as arguments of kernels."""

    tets: Tets
    """(n, 4) local nodes of each tet."""
    id: Ints
    """(n,) global ids of the tets."""
    across: Indices
    """(n, 4) the face that was in contact with each face at the start, 4 * global tet id + local face; -1 for an
    exposed face."""
    beside: Indices
    """(n, 4) place of the neighbour tet behind each face; -1 if there is no tet, -2 if the tet is on another rank."""
    bond: Bits
    """(n, 4) state of each facet of each tet: INTACT, BROKEN or WIDE."""
    intact: Bits
    """(n,) bits of each tet: bit k is set if facet k is intact and its two tets are in this block."""
    state: Floats
    """Element state of the whole block of tets, as a flat array."""
    columns: int
    """Number of rows of the element state."""


class FacetTable(NamedTuple):
    """Facets of a body. A facet has two indices: the place and the local face of its tet of smaller id. If only one tet
    of the facet is in the block, the indices are those of this tet.
    """

    strength: Floats
    """(n, 4) strength of each facet, Pa, equal on both sides; infinite for faces on the surface."""
    since: Floats
    """(n, 4) time at which the clock of the delayed criterion started, s."""
    seen: Ints
    """(n, 4) number of the last step in which the facet was overstressed. The clock continues if this step was the
    previous step."""


class InterfaceFacets(NamedTuple):
    """Facets whose other tet is on another rank, or in another block of this rank. The facets are ordered by rank and
    facet id; a facet between two blocks of this rank has one row for each side.
    """

    sides: Indices
    """(m, 2) place of this rank's tet of each facet, and local face of this tet."""
    first: Flags
    """(m,) True if this rank has the tet of smaller id of the facet."""
    mass: Floats
    """(m,) mass of the other tet of each facet, kg."""
    own: Floats
    """(m, 3) traction of this rank's tet on the outward normal of the tet of smaller id, Pa."""
    theirs: Floats
    """(m, 3) traction of the other tet on the outward normal of the tet of smaller id, Pa."""
    of: Ints
    """(m,) index of the other rank among the neighbours; for this rank itself the value is the number of neighbours."""
    hot: Ints
    """(neighbours + 1,) 1 if a facet shared with the neighbour is overstressed on at least one side, else 0; the last
    entry is for facets between two blocks of this rank."""
    there: Indices
    """(m, 3) block, place and face of the other tet of a facet between two blocks of this rank; -1 for other facets."""


class Law(NamedTuple):
    """Constants of the fracture criterion of a body."""

    weight: float
    """Weight of shear traction relative to normal traction."""
    friction: float
    """Coefficient of internal friction."""
    delay: float
    """Product of the characteristic time t_c of the delayed criterion and the square of the strength, Pa^2 s."""


class Candidates(NamedTuple):
    """Intact facets whose traction reaches their strength in a step. Facets within the rank come first, then shared
    facets.
    """

    place: Ints
    """(m,) place of the tet of smaller id; for a shared facet, place of the tet on this rank."""
    face: Ints
    """(m,) local face of the tet in ``place``."""
    shared: Ints
    """(m,) row of a shared facet in InterfaceFacets; -1 for a facet within the rank."""
    traction: Floats
    """(m, 4) traction on the outward normal of the tet of smaller id (three components), and effective traction, Pa."""

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
    """(m, 2) global ids of the two faces of each facet, 4 * tet + local face, the smaller id first."""
    nodes: Indices
    """(m, 3) local nodes, counter-clockwise seen from outside of the first side."""
    sides: Indices
    """(m, 2, 3) block, place and face of the tet on each side; -1 for a side on another rank."""
    first: Flags
    """(m,) true if the first side is on this rank."""
    traction: Floats
    """(m, 4) traction on the outward normal of the first side (three components), and effective traction, Pa."""
    mass: Floats
    """(m,) mass of the lighter tet, kg."""

    @property
    def tets(self) -> Ints:
        """(m, 2) global ids of the tets on the two sides."""
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
"""Numba type of positions."""
MESH = record(Mesh, types.uint32[:, ::1], _I1, _N2, _N2, types.uint8[:, ::1], types.uint8[::1], _F1, types.int64)
TABLE = record(FacetTable, _F2, _F2, _I2)
INTERFACE = record(InterfaceFacets, _N2, _B1, _F1, _F2, _F2, _I1, _I1, _N2)
LAW = record(Law, types.float64, types.float64, types.float64)
CANDIDATES = record(Candidates, _I1, _I1, _I1, _F2)
BREAKING = record(BreakingFacets, _I2, _N2, _N3, _B1, _F2, _F1)
