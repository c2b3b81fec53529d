"""Node separation: what breaks in a step becomes copies of nodes, numbered alike on any number of ranks.

Every rank that holds a node holds all its copies, too: the nodal sums that it completes with the others then reach
both sides of a facet, whichever rank computes them. Each holder receives the rest of the star of a touched node from
the others and cuts it by itself. The new ids follow from a list of all pieces of all ranks, sorted by the id of the
node and the smallest tet of the piece (the paper's eqs 17 and 18 count per rank: ids would depend on the ranks).

Ranks that share touched nodes exchange what they have of them, and all ranks that have some exchange that list; the
others go on with their step meanwhile. Which ranks have some is known before, from the reduction of the step.
"""

import numpy as np

from ..kernels.jit import njit, several, types
from ..mesh.faces import FACES
from ..model.state import BROKEN, Copies, Indices, Ints, Model, extended
from ..model.topology import KEY, Split, keys
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from . import stars
from .records import MESH, Mesh
from .stars import Stars

_I1, _I2, _N1 = types.int64[::1], types.int64[:, ::1], types.int32[::1]

_NO_NODES = np.zeros(0, np.int64)


class Separation:
    """The topology of the parts that fracture, on one rank."""

    def __init__(self, model: Model, neighbours: list[Neighbour], meshes: dict[int, Mesh], comm: Comm) -> None:
        """``meshes``: of the parts that fracture, by index of the block."""
        self._model, self._neighbours, self._comm = model, neighbours, comm
        self.stars = {b: Stars(mesh.tets, model.nodes.n) for b, mesh in meshes.items()}
        """By index of the block."""
        self._meshes = meshes
        self.broken = 0
        """Facets of all ranks that have broken."""
        self._mine = _NO_NODES
        """Local nodes, ascending, of the facets that break in this step."""

    def survey(self, broken: list[Indices], count: int, touched: Ints) -> None:
        """Breaks the bonds of facets, and notes in ``touched`` (ranks,) who has a node of them: 1, and for this rank
        the ``count`` of those whose first side is here besides.

        ``broken``: tables (m, 2, 3) of block, place and face of either side, -1 for one of another rank.
        """
        found = [_broken(mesh, b, sides) for sides in broken for b, mesh in self._meshes.items()]
        mine = found[0] if len(found) == 1 else distinct(np.concatenate([_NO_NODES, *found]))
        self._mine = mine
        if len(mine):
            touched[self._comm.rank] = 1 + count
        for other in self._neighbours:
            if meet(mine, other.nodes):
                touched[other.rank] = 1

    def separate(self, touched: Ints) -> Split:
        """Separates the nodes of what breaks.

        ``touched``: the maximum of those of all ranks; the ranks that are take part. Connectivity, masses and shared
        nodes are changed; forces are left to the caller. The others hear in the reduction of the next step how many
        nodes there are.
        """
        self.broken += int(touched.sum() - np.count_nonzero(touched))
        if not touched[self._comm.rank]:
            return Split.elsewhere(self._model.nodes.n, touched)
        return self._separated(self._touched(touched), touched)

    def _separated(self, some: Ints, touched: Ints) -> Split:
        """``some``: the local nodes of what breaks."""
        model = self._model
        rows, places = self._stars(some)
        of, mine, node, owner, mass = stars.pieces(rows)
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
            star.grow(copies.n)
            star.retie(self._meshes[b].tets, some, rows, places, of, new, b)
        return Split(copies, new, touched, *_leaving(rows, places, of, new))

    def _split_shares(self, rows: Ints, of: Ints, some: Ints, new: int) -> None:
        """What nodes of several parts and their copies have of each, by the ``rows`` of the stars of ``some`` nodes."""
        nodes = self._model.nodes
        node = np.where(of >= 0, new + of, some[np.searchsorted(nodes.id[some], rows[:, stars.NODE])])
        part = np.searchsorted(self._model.part_starts, rows[:, stars.TET], side="right") - 1
        quarters = 0.25 * rows[:, stars.MASS].copy().view(np.float64)
        nodes.shares, touched, stands = nodes.shares.follow(node.astype(np.int32), part.astype(np.int32), quarters)
        nodes.part[touched] = stands

    def _touched(self, touched: Ints) -> Ints:
        """Local nodes of the facets that break on any rank, ascending."""
        ids, mine, self._mine = self._model.nodes.id, self._mine, _NO_NODES
        company = [other for other in self._neighbours if touched[other.rank]]
        if not company:
            return mine
        told = self._comm.trade({o.rank: ids[mine[common(mine, o.nodes)]] for o in company}, [o.rank for o in company])
        some = [np.searchsorted(ids, theirs) for theirs in told.values() if len(theirs)]
        every: Ints = distinct(np.concatenate([mine, *some])) if some else mine
        return every

    def _stars(self, touched: Ints) -> tuple[Ints, Ints]:
        """Rows of the whole stars of the touched nodes, by node and tet, and their places."""
        ids, rank = self._model.nodes.id, self._comm.rank
        found = [
            stars.describe(touched, star.first, star.count, star.pool, ids, self._meshes[b], b, rank)
            for b, star in self.stars.items()
        ]
        told = self._told(touched, found) if self._neighbours else []
        if len(found) == 1 and not told:
            return found[0][0], found[0][1]
        rows = np.concatenate([*(rows for rows, _, _ in found), *told])
        return stars.ordered(rows, np.concatenate([places for _, places, _ in found]))

    def _told(self, touched: Ints, found: list[tuple[Ints, Ints, Ints]]) -> list[Ints]:
        """The rows of others round touched nodes that this rank shares with them; they get those ``found`` here."""
        shared = {other.rank: common(touched, other.nodes) for other in self._neighbours}
        sends = {
            rank: np.concatenate([_stretches(rows, begin[at], begin[at + 1]) for rows, _, begin in found])
            for rank, at in shared.items() if len(at)
        }  # fmt: skip
        return [words.reshape(-1, stars.COLUMNS) for words in self._comm.trade(sends, sends).values() if len(words)]

    def _number(self, mine: Ints, touched: Ints) -> Ints:
        """(k, 2) node and label of every piece of all ranks that gets a copy, in the order of the new ids."""
        others = [rank for rank in np.flatnonzero(touched).tolist() if rank != self._comm.rank]
        if not others:
            return mine
        words = mine[self._model.nodes.owned[np.searchsorted(self._model.nodes.id, mine[:, 0])]]
        told = self._comm.trade(dict.fromkeys(others, words), others)
        every = np.concatenate([words, *(theirs.reshape(-1, 2) for theirs in told.values())])
        return every[np.lexsort((every[:, 1], every[:, 0]))]

    def _share(self, copies: Copies, first: int) -> None:
        """Whoever holds a node holds its copies."""
        for other in self._neighbours:
            new = first + common(copies.parents, other.nodes)
            other.nodes = extended(other.nodes, new.astype(np.int32))


def _positions(every: Ints, mine: Ints) -> Ints:
    """(k,) where the rows of ``mine`` (k, 2) stand among those of ``every``, both sorted."""
    return np.arange(len(mine)) if len(every) == len(mine) else np.searchsorted(keys(*every.T), keys(*mine.T))


@njit(types.int64[::1](_I1), cache=True)
def distinct(values):  # type: ignore[no-untyped-def]
    """The values, ascending, each once."""
    out, n = np.sort(values), 0
    for value in out:
        if n == 0 or value != out[n - 1]:
            out[n] = value
            n += 1
    return out[:n].copy()


@njit(types.int64[::1](MESH, types.int64, types.int32[:, :, ::1]), cache=True)
def _broken(mesh, block, sides):  # type: ignore[no-untyped-def]
    """Marks the bonds of those ``sides`` (m, 2, 3) that are of this ``block``; returns their nodes, each once."""
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
    """Places in ``some`` of values that are among the ascending ``others``."""
    out, n = np.empty(len(some), np.int64), 0
    for i in range(len(some)):
        at = np.searchsorted(others, some[i])
        if at < len(others) and others[at] == some[i]:
            out[n] = i
            n += 1
    return out[:n].copy()


@njit(types.boolean(_I1, types.int32[::1]), cache=True)
def meet(some, others):  # type: ignore[no-untyped-def]
    """Whether one of ``some`` is among the ascending ``others``."""
    for value in some:
        at = np.searchsorted(others, value)
        if at < len(others) and others[at] == value:
            return True
    return False


@njit(types.int64[:, ::1](_I2, _I1, _I1), cache=True)
def _stretches(rows, begin, end):  # type: ignore[no-untyped-def]
    """Rows from each of ``begin`` (k,) to each of ``end``, one stretch after the other."""
    out, n = np.empty(((end - begin).sum(), rows.shape[1]), np.int64), 0
    for i in range(len(begin)):
        out[n : n + end[i] - begin[i]] = rows[begin[i] : end[i]]
        n += end[i] - begin[i]
    return out


@njit(several(_I1, _N1, _N1, _N1, _N1)(_I2, _I2, _I1, types.int64), cache=True)
def _leaving(rows, places, of, new):  # type: ignore[no-untyped-def]
    """Of the rows whose node becomes a copy: ids of node and tet as one number, the copy, place, corner and block."""
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
