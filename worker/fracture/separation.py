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
        rows, places = self._stars(touched)
        label, leaving = stars.pieces(rows)
        mine = np.column_stack(np.divmod(np.unique(keys(rows[leaving, stars.NODE], label[leaving])), KEY))
        every = self._number(mine)
        if not len(every):
            return None
        if not len(mine):
            self._model.nodes_global += len(every)
            return Split.elsewhere(self._model.nodes.n)
        return self._separate(touched, rows, places, label, leaving, mine, every)

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

    def _stars(self, touched: Ints) -> tuple[Ints, Ints]:
        """Rows of the whole stars of the touched nodes, sorted; and place, corner and block of their tets, -1 for those
        of another rank.
        """
        nodes = self._model.nodes
        tables, where = [np.zeros((0, stars.COLUMNS), np.int64)], [np.zeros((0, 3), np.int64)]
        if len(touched):
            block_of = self._block_of[nodes.part[touched]]
            for b, star in self.stars.items():
                block, chosen = self._model.blocks[b], touched[block_of == b]
                count = int(star.count[chosen].sum())
                table, place = np.empty((count, stars.COLUMNS), np.int64), np.full((count, 3), b)
                stars.describe(
                    table, place, chosen, star.first, star.count, star.pool, block.tets, block.id, nodes.id,
                    block.state.reshape(-1).view(np.int64), block.across, block.bond, block.state.shape[1],
                    self._comm.rank,
                )  # fmt: skip
                tables.append(table)
                where.append(place)
        mine = np.concatenate(tables)
        rows = self._with_others(mine)
        places = np.concatenate([*where, np.full((len(rows) - len(mine), 3), -1)])
        order = np.argsort(keys(rows[:, stars.NODE], rows[:, stars.TET]))
        return rows[order], places[order]

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
        self, touched: Ints, rows: Ints, places: Ints, label: Ints, leaving: Flags, mine: Ints, every: Ints
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
        node = first + piece
        became = np.full(len(rows), -1)
        became[leaving] = node
        for b, star in self.stars.items():
            here = np.where((places[:, 2] == b)[:, None], places[:, :2], -1)
            star.retie(model.blocks[b].tets, touched, rows, here, became, nodes.n)
        key = keys(gone[:, stars.NODE], gone[:, stars.TET])
        place, corner, block = places[leaving].T.astype(np.int32)
        return Split(copies, first, key, node.astype(np.int32), place, corner, block)

    def _share(self, copies: Copies, first: int) -> None:
        """Whoever holds a node holds its copies."""
        shared = np.zeros(self._model.nodes.n, bool)
        for other in self._neighbours:
            shared[other.nodes] = True
            new = first + np.flatnonzero(shared[copies.parents])
            shared[other.nodes] = False
            other.nodes = extended(other.nodes, new.astype(np.int32))
