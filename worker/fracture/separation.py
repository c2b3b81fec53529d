"""Node separation: what breaks in a step becomes copies of nodes, numbered alike on any number of ranks.

Every rank that holds a node holds all its copies, too: the nodal sums that it completes with the others then reach both
sides of a facet, whichever rank computes them. Each holder learns the whole star of a touched node from the others and
cuts it by itself. The new ids follow from a list of all pieces of all ranks, sorted by the id of the node and the
smallest tet of the piece (the paper's eqs 17 and 18 count per rank, so that ids would depend on the ranks).
"""

from dataclasses import dataclass

import numpy as np

from ..mesh.faces import FACES
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..state import BROKEN, Copies, Flags, Indices, Ints, Model, extended
from ..topology import KEY, Split, keys
from . import stars
from .stars import Stars


@dataclass
class Broken:
    """Facets of one block that break, as this rank's tets have them."""

    places: Indices
    """(m,) of tets; both sides when both are here."""
    faces: Indices
    """(m,) local faces."""


class Separation:
    """The topology of the parts that fracture, on one rank."""

    def __init__(self, model: Model, neighbours: list[Neighbour], comm: Comm) -> None:
        self._model, self._neighbours, self._comm = model, neighbours, comm
        n = model.nodes.n
        self.stars = {b: Stars(block.tets, n) for b, block in enumerate(model.blocks) if len(block.bond)}
        """By index of the block."""
        self._block_of = np.full(len(model.parts), -1, np.int32)
        for b, block in enumerate(model.blocks):
            self._block_of[block.part] = b

    def break_facets(self, broken: dict[int, Broken]) -> Split | None:
        """Breaks facets, by index of their block, and separates nodes; None where no node of any rank does.

        All ranks take part. Connectivity, masses, shared nodes and bonds are changed; forces are left to the caller.
        """
        touched = self._touched(broken)
        rows, label, places, own = self._cut(touched)
        kept = label[np.searchsorted(rows[:, stars.NODE], rows[:, stars.NODE])]
        leaving = label != kept
        mine = np.column_stack(np.divmod(np.unique(keys(rows[leaving, stars.NODE], label[leaving])), KEY))
        every = self._number(mine)
        if not len(every):
            return None
        if not len(mine):
            self._model.nodes_global += len(every)
            return Split.elsewhere(self._model.nodes.n)
        return self._separate(rows, label, places, own, leaving, mine, every)

    def _touched(self, broken: dict[int, Broken]) -> Ints:
        """Local nodes of the facets that break on any rank, ascending; marks the bonds."""
        found = [np.zeros(0, np.int64)]
        for b, facets in broken.items():
            block = self._model.blocks[b]
            block.bond[facets.places, facets.faces] = BROKEN
            found.append(block.tets[facets.places[:, None], FACES[facets.faces]].reshape(-1).astype(np.int64))
        nodes, mine = self._model.nodes, np.unique(np.concatenate(found))
        if self._comm.size == 1:
            return mine
        sends = {}
        if len(mine):
            flags = np.zeros(nodes.n, bool)
            flags[mine] = True
            sends = {o.rank: nodes.id[o.nodes[flags[o.nodes]]] for o in self._neighbours}
        told = self._comm.swap(sends)
        if not told:
            return mine
        return np.unique(np.concatenate([mine, *(np.searchsorted(nodes.id, ids) for ids in told.values())]))

    def _cut(self, touched: Ints) -> tuple[Ints, Ints, Ints, Ints]:
        """Rows of the whole stars of the touched nodes, sorted, and their labels; place, corner and block of the
        tets of this rank, and which of these a row is, -1 for a row of another rank.
        """
        nodes = self._model.nodes
        if not len(touched):
            none = np.zeros(0, np.int64)
            return self._with_others(np.zeros((0, stars.COLUMNS), np.int64)), none, np.zeros((0, 3), np.int64), none
        block_of = self._block_of[nodes.part[touched]]
        tables, where = [np.zeros((0, stars.COLUMNS), np.int64)], [np.zeros((0, 3), np.int64)]
        for b, star in self.stars.items():
            block, chosen = self._model.blocks[b], touched[block_of == b]
            count = int(star.count[chosen].sum())
            table, place = np.empty((count, stars.COLUMNS), np.int64), np.empty((count, 3), np.int64)
            place[:, 2] = b
            found = np.empty((count, 2), np.int64)
            stars.describe(
                table, found, chosen, star.first, star.count, star.pool, block.tets, block.id, nodes.id,
                block.state.reshape(-1).view(np.int64), block.across, block.bond, block.state.shape[1], self._comm.rank,
            )  # fmt: skip
            place[:, :2] = found
            tables.append(table)
            where.append(place)
        mine, places = np.concatenate(tables), np.concatenate(where)
        own = np.arange(len(mine))
        rows = self._with_others(mine)
        own = np.concatenate([own, np.full(len(rows) - len(mine), -1)])
        order = np.lexsort((rows[:, stars.TET], rows[:, stars.NODE]))
        rows = np.ascontiguousarray(rows[order])
        return rows, stars.pieces(rows), places, own[order]

    def _with_others(self, mine: Ints) -> Ints:
        """The rows of this rank's tets and those of the others' round shared nodes."""
        if self._comm.size == 1:
            return mine
        nodes, sends = self._model.nodes, {}
        if len(mine):
            local, flags = np.searchsorted(nodes.id, mine[:, stars.NODE]), np.zeros(nodes.n, bool)
            for other in self._neighbours:
                flags[other.nodes] = True
                sends[other.rank] = mine[flags[local]]
                flags[other.nodes] = False
        told = self._comm.swap(sends)
        if not told:
            return mine
        return np.concatenate([mine, *(words.reshape(-1, stars.COLUMNS) for words in told.values())])

    def _number(self, mine: Ints) -> Ints:
        """(k, 2) node and label of every piece of all ranks that gets a copy, in the order of the new ids."""
        if self._comm.size == 1:
            return mine
        nodes = self._model.nodes
        owned = nodes.owned[np.searchsorted(nodes.id, mine[:, 0])]
        every = self._comm.join(mine[owned]).reshape(-1, 2)
        return every[np.lexsort((every[:, 1], every[:, 0]))]

    def _separate(
        self, rows: Ints, label: Ints, places: Ints, own: Ints, leaving: Flags, mine: Ints, every: Ints
    ) -> Split:
        model, nodes = self._model, self._model.nodes
        at = np.searchsorted(keys(*every.T), keys(*mine.T))
        gone = rows[leaving]
        piece = np.searchsorted(keys(*mine.T), keys(gone[:, stars.NODE], label[leaving]))
        quarters = 0.25 * np.ascontiguousarray(gone[:, stars.MASS]).view(np.float64)
        masses = np.bincount(piece, quarters, len(mine)).astype(np.float64)
        smallest = gone[:, stars.TET] == label[leaving]
        owner = np.zeros(len(mine), np.int32)
        owner[piece[smallest]] = gone[smallest, stars.RANK]
        parents, first = np.searchsorted(nodes.id, mine[:, 0]), nodes.n
        copies = Copies(parents, model.nodes_global + at, owner, owner == self._comm.rank, masses)
        nodes.grow(copies)
        model.nodes_global += len(every)
        self._share(copies, first)
        ours = own[leaving]
        here = places[np.maximum(ours, 0)] if len(places) else np.zeros((len(ours), 3), np.int64)
        place, corner, block = np.where(ours >= 0, here[:, 0], -1), here[:, 1], here[:, 2]
        node = (first + piece).astype(np.int32)
        self._retie(rows, label, places, own, place, corner, block, node)
        key = keys(gone[:, stars.NODE], gone[:, stars.TET])
        return Split(copies, first, key, node, *(n.astype(np.int32) for n in (place, corner, block)))

    def _share(self, copies: Copies, first: int) -> None:
        """Whoever holds a node holds its copies."""
        shared = np.zeros(self._model.nodes.n, bool)
        for other in self._neighbours:
            shared[other.nodes] = True
            new = first + np.flatnonzero(shared[copies.parents])
            shared[other.nodes] = False
            other.nodes = extended(other.nodes, new.astype(np.int32))

    def _retie(
        self, rows: Ints, label: Ints, places: Ints, own: Ints, place: Ints, corner: Ints, block: Ints, node: Indices
    ) -> None:
        """Gives tets their new nodes, and every node its star."""
        here = place >= 0
        for b, star in self.stars.items():
            star.grow(self._model.nodes.n - len(star.count))
            chosen = here & (block == b)
            self._model.blocks[b].tets[place[chosen], corner[chosen]] = node[chosen]
        ours = own >= 0
        index = own[ours]
        for b, star in self.stars.items():
            inside = places[index, 2] == b
            at = places[index[inside]]
            block_tets = self._model.blocks[b].tets
            after = block_tets[at[:, 0], at[:, 1]].astype(np.int64)
            before = np.searchsorted(self._model.nodes.id, rows[ours][inside, stars.NODE])
            order = np.lexsort((after, before))
            before, after, tets = before[order], after[order], at[order, 0]
            _restock(star.pool, star.first, star.count, before, after, tets)


def _restock(pool: Indices, first: Indices, count: Indices, before: Ints, after: Ints, tets: Ints) -> None:
    """Writes the stars of nodes ``before`` and of their copies ``after`` anew, in the stretch of the pool they have."""
    starts = np.flatnonzero(np.r_[True, before[1:] != before[:-1]]) if len(before) else np.zeros(0, np.int64)
    rank = np.arange(len(before)) - np.repeat(starts, np.diff(np.r_[starts, len(before)]))
    at = first[before] + rank
    pool[at] = tets
    count[before] = 0
    change = np.flatnonzero(np.r_[True, after[1:] != after[:-1]]) if len(after) else starts
    first[after[change]] = at[change]
    count[after[change]] = np.diff(np.r_[change, len(after)])
