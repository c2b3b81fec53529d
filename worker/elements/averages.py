"""Table of the nodal means of the averaged pressure forms, for nodes with tets of several materials. The table has one
row for each material of a node.

At an interface of two materials the stress is continuous, so the volume strains of the two materials differ. A single
mean over the tets of both materials around a node would mix the two strains, and the pressure of each material would be
wrong. Therefore a node has one mean for each material of its tets, and a tet contributes only to the means of its own
material. If no node has several materials, the rows of the means are the nodes.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from conoid.cases.model.joined import shared_bonds
from conoid.cases.model.schema import MOST_PARTS, Case

from ..migration.parcel import Table
from ..model.growing import extended
from ..model.ids import places
from ..model.state import Block, Floats, Indices, Ints, Model, Nodes, Tets
from ..model.topology import Split
from ..parallel.ownership import Neighbour


def kinds(case: Case) -> Indices:
    """Returns (parts,) a part that represents the material of each part: the first part with this material."""
    names = [part.material for part in case.parts]
    return np.array([names.index(name) for name in names], np.int32)


class Averages:
    """Rows of the nodal means on one rank. If a rank has a node, it has all rows of the node."""

    def __init__(self, model: Model, neighbours: list[Neighbour], kinds: Indices) -> None:
        """``kinds`` (parts,): for each part, the part that represents its material."""
        self._model, self._of, self._kinds = model, neighbours, kinds
        nodes = model.nodes
        more = _more(nodes, kinds)
        self.node: Ints = np.concatenate([np.arange(nodes.n), more[:, 0]])
        """(rows,) local node of each row."""
        self.kind: Indices = np.concatenate([kinds[nodes.part], more[:, 1].astype(np.int32)])
        """(rows,) part that represents the material of each row."""
        self._index()
        for block in model.blocks:
            block.own_averages = self._rows(block)
        self.neighbours = [Neighbour(other.rank, self._shared(other.nodes)) for other in neighbours]
        """Neighbour ranks, with the rows that this rank shares with each of them."""

    @classmethod
    def of(cls, case: Case, model: Model, neighbours: list[Neighbour]) -> "Averages | None":
        """Returns the table of rows of a case. Returns None if no bond joins two materials, because each node then has
        exactly one row.
        """
        found = kinds(case)
        mixed = any(found[i] != found[j] for _, _, i, j in shared_bonds(case))
        return cls(model, neighbours, found) if mixed else None

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.node)

    @property
    def further(self) -> Ints:
        """Number of rows at the start that are not the first row of a node."""
        return np.arange(self._model.nodes.n, self.n)

    def at(self, node: "np.ndarray", part: "np.ndarray | int") -> Ints:
        """Returns the rows of local nodes for the materials of parts; -1 if a node has no row for a material."""
        wanted = np.asarray(node, np.int64) * MOST_PARTS + self._kinds[part]
        at = places(self._keys, wanted)
        return np.where(at >= 0, self._order[at], -1)

    def grow(self, split: Split) -> Ints:
        """Adds rows for the copies of separated nodes. The tets must already have their new nodes. Returns the parent
        row of each new row.
        """
        nodes, first = self._model.nodes, split.first
        copies, (node, part) = split.copies, nodes.of_parts()
        pairs = np.unique(np.column_stack([node, self._kinds[part]])[node >= first], axis=0)
        parents = self.at(copies.parents[pairs[:, 0] - first], pairs[:, 1])
        begin = self.n
        self.node = np.concatenate([self.node, pairs[:, 0]])
        self.kind = np.concatenate([self.kind, pairs[:, 1].astype(np.int32)])
        self._index()
        for b, block in enumerate(self._model.blocks):
            mine = split.block == b
            places, corners = split.place[mine], split.corner[mine]
            block.averages[places, corners] = self.at(split.node[mine], block.part)
        for other, of in zip(self.neighbours, self._of, strict=True):
            held = np.isin(pairs[:, 0], of.nodes)
            other.nodes = extended(other.nodes, (begin + np.flatnonzero(held)).astype(np.int32))
        return parents

    def layers(self) -> Iterator[Ints]:
        """Yields groups of rows; a node occurs at most once in each group."""
        left = np.arange(self.n)
        while len(left):
            _, first = np.unique(self.node[left], return_index=True)
            yield left[first]
            left = np.delete(left, first)

    def of_nodes(self, columns: dict[str, "np.ndarray"]) -> dict[str, "np.ndarray"]:
        """Returns (nodes, ...) values of ``columns`` (rows, ...), one for each node. If a node has several materials,
        the value is that of the material of the part that represents the node.
        """
        nodes = self._model.nodes
        rows = self.at(np.arange(nodes.n), nodes.part)
        return {name: column[rows] for name, column in columns.items()}

    def keep(self, columns: dict[str, "np.ndarray"]) -> Table:
        """Returns the parcel table (for a checkpoint or migration message) of the means at nodes of several materials;
        ``columns`` (rows, ...).
        """
        nodes = self._model.nodes
        node, part = nodes.of_parts()
        several = np.isin(node, nodes.shares.node)
        pairs = np.unique(np.column_stack([node, self._kinds[part]])[several], axis=0)
        rows, of = self.at(pairs[:, 0], pairs[:, 1]), nodes.id[pairs[:, 0]]
        table = {name: column[rows] for name, column in columns.items()}
        return {"of": of, "key": of * MOST_PARTS + pairs[:, 1], "kind": pairs[:, 1], **table}

    def resume(self, table: Table, columns: dict[str, "np.ndarray"]) -> dict[str, "np.ndarray"]:
        """Returns ``columns`` (nodes, ...) of a parcel (a checkpoint or migration message), extended by the rows of
        ``table``, which has the means at nodes of several materials.
        """
        rows, found = self.at(self._model.nodes.places(table["of"]), table["kind"]), {}
        for name, values in columns.items():
            found[name] = np.concatenate([values, np.zeros((self.n - len(values), *values.shape[1:]), values.dtype)])
            found[name][rows] = table[name]
        return found

    def _index(self) -> None:
        key = self.node * MOST_PARTS + self.kind
        self._order = np.argsort(key)
        self._keys = key[self._order]

    def _rows(self, block: Block) -> Tets:
        return np.ascontiguousarray(self.at(block.tets, block.part), np.uint32)

    def _shared(self, nodes: Indices) -> Indices:
        """Returns the rows of ``nodes``, ordered by node id and then by material. Two ranks that share the nodes get
        the same order.
        """
        mine = np.isin(self.node, nodes)
        rows = np.flatnonzero(mine)
        ids = self._model.nodes.id[self.node[rows]]
        return rows[np.lexsort((self.kind[rows], ids))].astype(np.int32)


def _more(nodes: Nodes, kinds: Indices) -> Ints:
    """(k, 2) nodes and their further materials. The material of the part that represents the node is omitted."""
    shares = nodes.shares
    pairs = np.column_stack([shares.node, kinds[shares.part]]).astype(np.int64)
    return np.unique(pairs[pairs[:, 1] != kinds[nodes.part[shares.node]]], axis=0)


def volumes(averages: "Averages | None", nodes: Nodes, node_volume: Floats, density: Sequence[float]) -> Floats:
    """(rows,) reference volumes at the start, m^3. The value of a node with one material is its volume, ``node_volume``
    (nodes,). For a node of several materials the value is the volume of each material, computed with the ``density`` of
    the parts, kg/m^3.
    """
    if averages is None:
        return node_volume
    shares = nodes.shares
    found = np.concatenate([node_volume, np.zeros(averages.n - nodes.n)])
    several = np.unique(averages.node[averages.further])
    mine = np.isin(shares.node, several)
    rows = averages.at(shares.node[mine], shares.part[mine])
    found[several] = 0.0
    np.add.at(found, rows, shares.mass[mine] / np.array(density)[shares.part[mine]])
    return found
