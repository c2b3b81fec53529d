"""Node separation: a node gets copies if broken facets have cut its star (the tets around the node) into pieces. The
ids of the copies are independent of the number of ranks.

A rank that has a node has all copies of the node. The completed sums of a shared node are therefore available on both
sides of a facet, on any rank that computes one of the sides. Only the ranks that have a node of a broken facet execute
the following steps 1 to 6. All ranks receive the list of these ranks in the reduction of the step; a rank that is not
in the list continues with its next step.

    1. mark the broken facets and their nodes, and the         survey
       nodes of tets that erosion has removed in this step
    2. exchange the touched nodes with neighbours              _touched
    3. exchange the stars of shared touched nodes              _stars: each rank has the complete stars
    4. cut each star into pieces                               stars.pieces: each rank by itself, with equal result
    5. exchange the list of new pieces (node, smallest tet)    _number: sorted, so that ids do not depend on ranks
    6. new nodes, masses, shared nodes, connectivity           _separated

Eqs 17 and 18 of the paper count new nodes on each rank, so the ids in the paper depend on the partition.
"""

import math

import numpy as np

from ..kernels.jit import njit, several, types
from ..mesh.faces import FACES
from ..model.growing import extended
from ..model.ids import among
from ..model.state import BROKEN, Copies, Indices, Ints, Model
from ..model.topology import KEY, Split, keys
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from . import stars
from .records import MESH, Mesh
from .stars import Pieces, Stars

_I1, _I2, _N1 = types.int64[::1], types.int64[:, ::1], types.int32[::1]

_NO_NODES = np.zeros(0, np.int64)


class Separation:
    """Node separation on one rank, for the parts that fracture."""

    def __init__(
        self, model: Model, neighbours: list[Neighbour], meshes: dict[int, Mesh], comm: Comm, threads: Team
    ) -> None:
        """``meshes``: meshes of the parts that fracture; the keys are the indices of the blocks of tets. The removal of
        tets replaces the meshes.
        """
        self._model, self._neighbours, self._comm = model, neighbours, comm
        self.stars = {b: Stars(mesh.tets, model.nodes.n, threads) for b, mesh in meshes.items()}
        """Stars of the nodes; the keys are the indices of the blocks of tets."""
        for star in self.stars.values():
            model.nodes.columns.declare(star, **Stars.COLUMNS)
        self._pieces = Pieces(threads)
        self.meshes = meshes
        self.broken = 0
        """Number of broken facets on all ranks."""
        self.first = math.nan
        """Simulated time at which the first facet broke, s."""
        self._mine = self.cut = _NO_NODES
        """Local nodes, ascending, whose stars may be cut in this step: nodes of facets that break, and nodes of removed
        tets."""

    def survey(self, broken: list[Indices], count: int, touched: Ints) -> None:
        """Marks facets as broken. Sets ``touched`` (ranks,) to 1 for each rank that has a node of a broken facet; the
        value for this rank is 1 + ``count``, where ``count`` is the number of broken facets whose first side is on this
        rank.

        ``broken``: tables (m, 2, 3) of block, place and face of each side; -1 for a side on another rank.
        """
        found = [_broken(mesh, b, sides) for sides in broken for b, mesh in self.meshes.items()]
        mine = found[0] if len(found) == 1 else distinct(np.concatenate([_NO_NODES, *found]))
        if len(self.cut):
            mine, self.cut = distinct(np.concatenate([mine, self.cut])), _NO_NODES
        self._mine = mine
        if len(mine):
            touched[self._comm.rank] = 1 + count
        for other in self._neighbours:
            if intersects(mine, other.nodes):
                touched[other.rank] = 1

    def separate(self, touched: Ints) -> Split:
        """Separates the nodes of the broken facets; returns the topology change.

        ``touched`` (ranks,): maximum over all ranks of ``touched`` of ``survey``. Collective among the ranks whose
        value in ``touched`` is above 0. The method changes connectivity, masses and shared nodes; the caller moves the
        forces. Ranks without a changed node receive the new number of nodes in the reduction of the next step.
        """
        self.broken += int(touched.sum() - np.count_nonzero(touched))
        if not touched[self._comm.rank]:
            return Split.elsewhere(self._model.nodes.n, touched)
        return self._separated(self._touched(touched), touched)

    def _separated(self, some: Ints, touched: Ints) -> Split:
        """Separates nodes; ``some``: local nodes of the facets that broke on any rank."""
        model = self._model
        rows, places, begins = self._stars(some)
        of, mine, node, owner, mass = self._pieces.of(rows, begins)
        every, new = self._number(mine, touched), model.nodes.n
        first, model.nodes_global = model.nodes_global, model.nodes_global + len(every)
        if not len(mine):
            return Split.elsewhere(new, touched)
        ids = first + _positions(every, mine)
        copies = Copies(some[node], ids, owner, owner == self._comm.rank, mass)
        model.nodes.grow(copies)
        self._share(copies, new)
        if len(model.nodes.shares.node):
            self._split_shares(rows, of, some, new)
        for b, star in self.stars.items():
            star.reconnect(self.meshes[b].tets, some, rows, places, of, new, b)
        return Split(copies, new, touched, *_leaving(rows, places, of, new))

    def _split_shares(self, rows: Ints, of: Ints, some: Ints, new: int) -> None:
        """Updates, for each separated node of several parts and for its copies, the mass that each part contributes.
        ``rows``: rows of the stars of the nodes ``some``.
        """
        nodes = self._model.nodes
        apart = among(np.unique(rows[of >= 0, stars.NODE]), rows[:, stars.NODE])
        rows, of = rows[apart], of[apart]
        node = np.where(of >= 0, new + of, some[np.searchsorted(nodes.id[some], rows[:, stars.NODE])])
        part = np.searchsorted(self._model.part_starts, rows[:, stars.TET], side="right") - 1
        quarters = 0.25 * rows[:, stars.MASS].copy().view(np.float64)
        nodes.shares, touched, stands = nodes.shares.follow(node.astype(np.int32), part.astype(np.int32), quarters)
        nodes.part[touched] = stands

    def _touched(self, touched: Ints) -> Ints:
        """Returns the local nodes, ascending, of the facets that break on any rank. Collective among the touched
        ranks.
        """
        ids, mine, self._mine = self._model.nodes.id, self._mine, _NO_NODES
        partners = [other for other in self._neighbours if touched[other.rank]]
        if not partners:
            return mine
        sends = {other.rank: ids[mine[common(mine, other.nodes)]] for other in partners}
        received = self._comm.trade(sends, sends)
        some = [np.searchsorted(ids, theirs) for theirs in received.values() if len(theirs)]
        every: Ints = distinct(np.concatenate([mine, *some])) if some else mine
        return every

    def _stars(self, touched: Ints) -> tuple[Ints, Ints, Ints]:
        """Returns the rows of the complete stars of the touched nodes, ordered by node and tet; also returns the places
        of the tets, and the first row of each node.
        """
        ids, rank = self._model.nodes.id, self._comm.rank
        found = [star.describe(touched, ids, self.meshes[b], b, rank) for b, star in self.stars.items()]
        received = self._received(touched, found) if self._neighbours else []
        if len(found) == 1 and not received:
            return found[0]
        rows = np.concatenate([*(rows for rows, _, _ in found), *received])
        rows, places = stars.ordered(rows, np.concatenate([places for _, places, _ in found]))
        return rows, places, stars.node_begins(rows)

    def _received(self, touched: Ints, found: list[tuple[Ints, Ints, Ints]]) -> list[Ints]:
        """Exchanges the star rows of shared touched nodes. Sends the rows ``found`` on this rank; returns the rows of
        other ranks.
        """
        shared = {other.rank: common(touched, other.nodes) for other in self._neighbours}
        sends = {
            rank: np.concatenate([_stretches(rows, begin[at], begin[at + 1]) for rows, _, begin in found])
            for rank, at in shared.items() if len(at)
        }  # fmt: skip
        return [words.reshape(-1, stars.COLUMNS) for words in self._comm.trade(sends, sends).values() if len(words)]

    def _number(self, mine: Ints, touched: Ints) -> Ints:
        """(k, 2) node and label of every piece that gets a copy, on all ranks, in the order of the new node ids."""
        others = [rank for rank in np.flatnonzero(touched).tolist() if rank != self._comm.rank]
        if not others:
            return mine
        words = mine[self._model.nodes.owned[np.searchsorted(self._model.nodes.id, mine[:, 0])]]
        received = self._comm.trade(dict.fromkeys(others, words), others)
        every = np.concatenate([words, *(theirs.reshape(-1, 2) for theirs in received.values())])
        return every[np.lexsort((every[:, 1], every[:, 0]))]

    def _share(self, copies: Copies, first: int) -> None:
        """Adds the copies to the shared nodes, because a rank that has a node has all its copies."""
        for other in self._neighbours:
            new = first + common(copies.parents, other.nodes)
            other.nodes = extended(other.nodes, new.astype(np.int32))


def _positions(every: Ints, mine: Ints) -> Ints:
    """(k,) indices in ``every`` of the rows ``mine`` (k, 2); both arrays are sorted."""
    return np.arange(len(mine)) if len(every) == len(mine) else np.searchsorted(keys(*every.T), keys(*mine.T))


@njit(types.int64[::1](_I1), cache=True)
def distinct(values):  # type: ignore[no-untyped-def]
    """Returns the distinct values of an array, ascending."""
    out, n = np.sort(values), 0
    for value in out:
        if n == 0 or value != out[n - 1]:
            out[n] = value
            n += 1
    return out[:n].copy()


@njit(types.int64[::1](MESH, types.int64, types.int32[:, :, ::1]), cache=True)
def _broken(mesh, block, sides):  # type: ignore[no-untyped-def]
    """Marks the facets of ``sides`` (m, 2, 3) that are in this ``block`` of tets as broken. Returns the nodes of the
    facets, each node once.
    """
    nodes, n = np.empty(6 * len(sides), np.int64), 0
    for m in range(len(sides)):
        for s in range(2):
            if sides[m, s, 0] == block:
                e, face = sides[m, s, 1], sides[m, s, 2]
                mesh.bond[e, face] = BROKEN
                mesh.intact[e] &= ~(1 << face)
                for k in range(3):
                    nodes[n] = mesh.tets[e, FACES[face, k]]
                    n += 1
    return distinct(nodes[:n])


@njit(types.int64[::1](_I1, types.int32[::1]), cache=True)
def common(some, others):  # type: ignore[no-untyped-def]
    """Returns the indices of the elements of ``some`` that are among ``others``; ``others`` is ascending."""
    out, n = np.empty(len(some), np.int64), 0
    for i in range(len(some)):
        at = np.searchsorted(others, some[i])
        if at < len(others) and others[at] == some[i]:
            out[n] = i
            n += 1
    return out[:n].copy()


@njit(types.boolean(_I1, types.int32[::1]), cache=True)
def intersects(some, others):  # type: ignore[no-untyped-def]
    """Returns True if any element of ``some`` is among ``others``; ``others`` is ascending."""
    for value in some:
        at = np.searchsorted(others, value)
        if at < len(others) and others[at] == value:
            return True
    return False


@njit(types.int64[:, ::1](_I2, _I1, _I1), cache=True)
def _stretches(rows, begin, end):  # type: ignore[no-untyped-def]
    """Returns the concatenation of the ranges of rows from ``begin[i]`` to ``end[i]``; ``begin``, ``end`` (k,)."""
    out, n = np.empty(((end - begin).sum(), rows.shape[1]), np.int64), 0
    for i in range(len(begin)):
        out[n : n + end[i] - begin[i]] = rows[begin[i] : end[i]]
        n += end[i] - begin[i]
    return out


@njit(several(_I1, _N1, _N1, _N1, _N1)(_I2, _I2, _I1, types.int64), cache=True)
def _leaving(rows, places, of, new):  # type: ignore[no-untyped-def]
    """Selects the rows whose node becomes a copy. Returns several values for each row: the key of node and tet, the
    copy, and the place, corner and block of the tet.
    """
    m = (of >= 0).sum()
    key, found, n = np.empty(m, np.int64), np.empty((4, m), np.int32), 0
    for r in range(len(rows)):
        if of[r] >= 0:
            key[n] = rows[r, stars.NODE] * KEY + rows[r, stars.TET]
            found[0, n] = new + of[r]
            for k in range(3):
                found[1 + k, n] = places[r, k]
            n += 1
    return key, found[0], found[1], found[2], found[3]
