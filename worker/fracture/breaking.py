"""The facets of one body that break in a step."""

from dataclasses import dataclass

import numpy as np

from ..kernels.jit import njit, types
from ..mesh.faces import FACES
from ..model.rows import MASS
from ..model.state import CHUNK, Flags, Floats, Ints
from .facets import Body
from .records import BREAKING, CANDIDATES, INTERFACE, MESH, BreakingFacets, Candidates, InterfaceFacets


@dataclass
class Breaking:
    """The facets of one body that break in a step."""

    body: Body
    facets: BreakingFacets

    @property
    def rows(self) -> Ints:
        """(m, 2) indices of each facet into the facet table of the body: place of its tet, and local face of the
        tet.
        """
        one, two = self.facets.sides[:, 0, 1:], self.facets.sides[:, 1, 1:]
        return np.where(one[:, :1] >= 0, one, two).astype(np.int64)

    @property
    def load(self) -> Floats:
        """(m,) ratio of the effective traction to the strength of each facet."""
        place, face = self.rows.T
        return np.asarray(self.facets.traction[:, 3] / self.body.facets.strength[place, face])

    def take(self, chosen: Flags) -> "Breaking":
        """Returns the chosen facets."""
        return Breaking(self.body, self.facets.take(chosen))


def gathered(body: Body, found: Candidates, shared: InterfaceFacets) -> Breaking | None:
    """Collects the data of the facets ``found``. Returns None if no facet breaks."""
    facets: BreakingFacets = _gather(found, shared, body.mesh, body.index)
    return Breaking(body, facets) if len(facets.mass) else None


@njit(types.float64(MESH, types.int64), cache=True)
def _mass(mesh, e):  # type: ignore[no-untyped-def]
    return mesh.state[(e // CHUNK * mesh.columns + MASS) * CHUNK + e % CHUNK]


@njit(types.void(BREAKING, types.int64, types.int64, CANDIDATES, INTERFACE, MESH, types.int64), cache=True)
def _fill(out, m, i, found, shared, mesh, block):  # type: ignore[no-untyped-def]
    """Writes the data of the candidate facet ``i`` to row ``m`` of ``out``."""
    place, face, row = found.place[i], found.face[i], found.shared[i]
    behind, mass = mesh.across[place, face], _mass(mesh, place)
    first = row < 0 or shared.first[row]
    here = 0 if first else 1
    out.sides[m, here, 0], out.sides[m, here, 1], out.sides[m, here, 2] = block, place, face
    if row < 0:
        there = mesh.beside[place, face]
        out.sides[m, 1, 0], out.sides[m, 1, 1], out.sides[m, 1, 2] = block, there, behind % 4
        out.mass[m] = min(mass, _mass(mesh, there))
    else:
        out.mass[m] = min(mass, shared.mass[row])
        for k in range(3):
            out.sides[m, 1 - here, k] = shared.there[row, k]
    out.faces[m, here], out.faces[m, 1 - here] = 4 * mesh.id[place] + face, behind
    a, b, c = mesh.tets[place, FACES[face, 0]], mesh.tets[place, FACES[face, 1]], mesh.tets[place, FACES[face, 2]]
    out.nodes[m, 0], out.nodes[m, 1], out.nodes[m, 2] = a, b if first else c, c if first else b
    out.first[m] = first
    for k in range(4):
        out.traction[m, k] = found.traction[i, k]


@njit(BREAKING(CANDIDATES, INTERFACE, MESH, types.int64), cache=True)
def _gather(found, shared, mesh, block):  # type: ignore[no-untyped-def]
    """Fills the table with the facets of ``gathered``. ``block``: index of the block of tets of the body. A facet
    between two blocks of this rank is collected once, with the block of its first side.
    """
    n = len(found.place)
    out = BreakingFacets(
        np.empty((n, 2), np.int64), np.empty((n, 3), np.int32), np.full((n, 2, 3), -1, np.int32),
        np.empty(n, np.bool_), np.empty((n, 4)), np.empty(n),
    )  # fmt: skip
    m = 0
    for i in range(n):
        row = found.shared[i]
        if row < 0 or shared.first[row] or shared.there[row, 0] < 0:
            _fill(out, m, i, found, shared, mesh, block)
            m += 1
    return BreakingFacets(
        out.faces[:m], out.nodes[:m], out.sides[:m], out.first[:m], out.traction[:m], out.mass[:m]
    )  # fmt: skip
