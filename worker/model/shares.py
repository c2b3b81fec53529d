"""Nodes with tets of several parts, and the mass of each part in such a node. Bonds by shared nodes create nodes with
tets of several parts.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from conoid.cases.model.joined import shared_bonds
from conoid.cases.model.schema import MOST_PARTS, Case

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Flags = npt.NDArray[np.bool_]


@dataclass
class Shares:
    """Table with one row for each part of a node with several parts, ordered by node and part.

    If no node has several parts, the table is empty.
    """

    node: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(k,) local index of the node."""
    part: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(k,) index of the part."""
    mass: Floats = field(default_factory=lambda: np.zeros(0))
    """(k,) mass that the node has from the tets of the part, kg."""
    rank: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(parts,) precedence of the parts as numbers, the smallest first; (0,) if no bond makes nodes of several parts.
    Contact and other stages assign a node to one part only, its representative part, which is the part of the node with
    the smallest precedence number."""

    @property
    def fraction(self) -> Floats:
        """Return (k,) the mass of each row divided by the mass of its node."""
        whole = np.bincount(self.node, self.mass, minlength=1)
        return np.asarray(self.mass / whole[self.node])

    @property
    def key(self) -> Ints:
        """Return (k,) node and part of each row, combined into one integer; ascending."""
        return self.node.astype(np.int64) * MOST_PARTS + self.part

    def take(self, chosen: "np.ndarray") -> "Shares":
        """Return the rows chosen by ``chosen``."""
        return Shares(self.node[chosen], self.part[chosen], self.mass[chosen], self.rank)

    def members(self, part: Indices) -> tuple[Ints, Indices]:
        """Return (m,) nodes and (m,) their parts.

        The entries begin with all nodes and their representative ``part`` (n,). One entry follows for each other part
        of a node with several parts.
        """
        more = self.part != part[self.node]
        return np.concatenate([np.arange(len(part)), self.node[more]]), np.concatenate([part, self.part[more]])

    def joined(self, part: Indices, parts: int) -> Ints:
        """Return (parts, parts) 1 for pairs of parts with a common node on this rank, of which one represents the node,
        else 0. Chains of such pairs connect all parts of a body. ``part`` (n,): representative part of each node.
        """
        found = np.zeros((parts, parts), np.int64)
        found[part[self.node], self.part] = 1
        return found | found.T

    def of_nodes(self, local: Indices) -> "Shares":
        """Return the rows of the nodes that have a new index in ``local`` (nodes,), with the new index. ``local`` is -1
        for omitted nodes.
        """
        some = local[self.node] >= 0
        return Shares(local[self.node[some]], self.part[some], self.mass[some], self.rank)

    def standing(self) -> tuple[Indices, Indices]:
        """Return the distinct nodes of the rows, and the representative part of each node."""
        order = np.lexsort((self.rank[self.part], self.node)) if len(self.node) else np.zeros(0, np.int64)
        nodes, first = np.unique(self.node[order], return_index=True)
        return nodes, self.part[order][first]

    def follow(self, node: Indices, part: Indices, mass: Floats) -> "tuple[Shares, Indices, Indices]":
        """Return the shares after a separation of nodes; also return the changed nodes with their representative parts.

        Each argument has one entry for each tet at each changed node: the new ``node`` (r,), the ``part`` of the tet,
        and the mass that the node has from the tet, kg. The order of the entries does not depend on the division of the
        tets among the ranks.
        """
        found, at = np.unique(node.astype(np.int64) * MOST_PARTS + part, return_inverse=True)
        nodes, parts = np.divmod(found, MOST_PARTS)
        masses = np.bincount(at.reshape(-1), mass, len(found)).astype(np.float64)
        rows = Shares(nodes.astype(np.int32), parts.astype(np.int32), masses, self.rank)
        some = rows.take(np.bincount(nodes)[nodes] > 1) if len(nodes) else rows
        left = self.take(~np.isin(self.node, nodes))
        both = Shares(
            np.concatenate([left.node, some.node]), np.concatenate([left.part, some.part]),
            np.concatenate([left.mass, some.mass]), self.rank,
        )  # fmt: skip
        return both.take(np.argsort(both.key, kind="stable")), *rows.standing()


def shared(node: "np.ndarray", part: "np.ndarray", mass: Floats, rank: Ints) -> Shares:
    """Return the shares of the nodes that belong to several parts. Each argument has one entry for each corner of each
    tet: the ``node``, the ``part``, and the mass that the node has from the tet, kg.
    """
    empty = Shares(rank=rank)
    return empty.follow(np.asarray(node, np.int32), np.asarray(part, np.int32), mass)[0]


def ranks(case: Case) -> Ints:
    """Return (parts,) the precedence numbers for ``Shares.rank``; (0,) in a case without nodes shared between parts.
    Parts that are in contact have the smallest numbers.
    """
    if not shared_bonds(case):
        return np.zeros(0, np.int64)
    touching = case.contact.parts if case.contact is not None else ()
    last = [bool(touching) and part.name not in touching for part in case.parts]
    order = sorted(range(len(last)), key=lambda i: (last[i], i))
    return np.argsort(order).astype(np.int64)
