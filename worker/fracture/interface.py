"""Shared facets: facets whose two tets are on different ranks, or in two blocks of tets of one rank; the two ranks at a
facet compute the same mean traction.

A facet breaks only if the traction of one of its tets reaches the strength. Therefore two ranks exchange tractions only
in steps in which a facet shared by them is overstressed; a flag for overstressed shared facets is sent with the forces
of shared nodes.
"""

import numpy as np

from ..model.ids import places
from ..model.rows import MASS
from ..model.state import Floats, Ints
from ..parallel.comm import Comm, Exchange
from ..parallel.ownership import Neighbour
from ..parallel.tags import Tag
from . import criterion
from .facets import ELSEWHERE, Body
from .records import InterfaceFacets


class Interface:
    """Facets that this rank shares with other ranks, and the exchange of their tractions."""

    def __init__(self, bodies: list[Body], neighbours: list[Neighbour], comm: Comm) -> None:
        """Finds the shared facets. Collective."""
        mine = np.concatenate([np.zeros((0, 5), np.int64), *(_rows(b, body) for b, body in enumerate(bodies))])
        received = comm.swap({other.rank: mine[:, [0, 2]] for other in neighbours}) if comm.size > 1 else {}
        met = {rank: _met(mine, words.reshape(-1, 2)) for rank, words in received.items()}
        met[comm.rank] = _met(mine, mine[:, [0, 2]])
        table = np.concatenate([np.zeros((0, 6), np.int64), *met.values()])
        m, last = len(table), len(neighbours)
        index = {other.rank: k for k, other in enumerate(neighbours)} | {comm.rank: last}
        of = np.repeat(np.array([index[rank] for rank in met], np.int64), [len(rows) for rows in met.values()])
        self._inner: Ints = np.flatnonzero(of == last)
        """Rows of the facets between two blocks of tets of this rank."""
        self._partner = _partners(table[self._inner])
        """Index of the other side of each facet between two blocks of this rank, among these facets."""
        self.facets = InterfaceFacets(
            np.column_stack([table[:, 3], table[:, 0] % 4]).astype(np.int32), table[:, 0] < table[:, 1],
            np.ascontiguousarray(table[:, 5]).view(np.float64), np.zeros((m, 3)), np.zeros((m, 3)),
            of, np.zeros(last + 1, np.int64), np.full((m, 3), -1, np.int32),
        )  # fmt: skip
        blocks = np.array([body.index for body in bodies], np.int64)[table[self._inner, 4]]
        here = np.column_stack([blocks, self.facets.sides[self._inner]])
        self.facets.there[self._inner] = here[self._partner]
        self._bodies = bodies
        self.of_body: list[Ints] = [np.flatnonzero(table[:, 4] == b) for b in range(len(bodies))]
        """Rows of the shared facets of each body."""
        self._outer = [rows[of[rows] != last] for rows in self.of_body]
        ends = np.cumsum([0, *map(len, met.values())])
        own, theirs = self.facets.own.view(np.int64), self.facets.theirs.view(np.int64)
        self._exchanges: dict[int, Exchange] = {
            index[rank]: comm.exchange([(rank, own[a:b])], [(rank, theirs[a:b])], Tag.TRACTION)
            for rank, a, b in zip(met, ends[:-1], ends[1:], strict=True) if b > a and rank != comm.rank
        }  # fmt: skip
        """Exchanges of shared facets, keyed by the index of the neighbour rank."""
        self.hot = False
        """True if a shared facet is overstressed on at least one side."""

    def words(self, hot: bool) -> Ints:
        """(neighbours,) flags to send. The flag for a neighbour is 1 if a facet shared with it is overstressed on this
        side. ``hot``: True if a tet at a shared node has an overstressed face.
        """
        self.facets.hot[:] = 0
        for body, rows in zip(self._bodies, self._outer, strict=True):
            if hot and len(rows):
                criterion.mark_shared(self.facets, rows, body.mesh, body.block.hot)
        return self.facets.hot[:-1]

    def receive(self, words: Ints) -> None:
        """Combines the flags received from the neighbours with the flags of this rank."""
        np.maximum(self.facets.hot[:-1], words, out=self.facets.hot[:-1])
        self.hot = bool(self.facets.hot.any())

    def mark_inner(self, hot: bool) -> None:
        """Marks the overstressed facets between two blocks of this rank; to be called after the stress of all tets of
        the rank is computed. ``hot``: True if at least one face of the rank is overstressed.
        """
        if len(self._inner):
            self.facets.hot[-1] = 0
            for body, rows in zip(self._bodies, self.of_body, strict=True):
                some = rows[self.facets.there[rows, 0] >= 0]
                if hot and len(some):
                    criterion.mark_shared(self.facets, some, body.mesh, body.block.hot)
            self.hot = bool(self.facets.hot.any())

    def exchange(self, x: Floats) -> None:
        """Computes the tractions of this rank at the positions ``x`` (nodes, 3) and exchanges them with the neighbours.
        The function does nothing if no shared facet is overstressed. Collective among neighbours.
        """
        if not self.hot:
            return
        for body, rows in zip(self._bodies, self.of_body, strict=True):
            if len(rows):
                criterion.own_tractions(self.facets, rows, body.mesh, x)
        self.facets.theirs[self._inner] = self.facets.own[self._inner[self._partner]]
        asked = [exchange for k, exchange in self._exchanges.items() if self.facets.hot[k]]
        for exchange in asked:
            exchange.begin()
        for exchange in asked:
            exchange.finish()

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        for exchange in self._exchanges.values():
            exchange.free()


def _rows(index: int, body: Body) -> Ints:
    """(k, 5) facets of the block whose other tet is not in the block. Columns: own side, other side (4 * tet + face),
    bit pattern of the mass of the tet, its place, and the body.
    """
    block = body.block
    place, face = np.nonzero((body.mesh.beside == ELSEWHERE) & body.has(block.across))
    own, mass = 4 * block.id[place] + face, block.row(MASS)[place].view(np.int64)
    return np.column_stack([own, block.across[place, face], mass, place, np.full(len(place), index)])


def _met(mine: Ints, theirs: Ints) -> Ints:
    """(m, 6) rows of ``mine`` whose facet is also in ``theirs`` (k, 2), ordered by facet id. ``theirs`` was sent by
    another rank; it has the facet id and the bit pattern of the mass of the other tet, and this mass is the last column
    of the result.
    """
    theirs = theirs[np.argsort(theirs[:, 0])]
    at = places(theirs[:, 0], mine[:, 1])
    met = at >= 0
    rows = np.column_stack([mine[met], theirs[at[met], 1]])
    return np.asarray(rows[np.argsort(rows[:, :2].min(axis=1))])


def _partners(table: Ints) -> Ints:
    """(m,) row of the other side of each facet. ``table`` (m, 6): result of ``_met``; it contains both sides of each
    facet.
    """
    order = np.argsort(table[:, 0])
    return np.asarray(order[np.searchsorted(table[order, 0], table[:, 1])])
