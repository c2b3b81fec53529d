"""Nodes that tets of several parts have, as bonds by shared nodes make them: what of each belongs to which part."""

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
    """A row for each part of each node that has several, by node and part. No row in a scene without such nodes."""

    node: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(k,) local index."""
    part: Indices = field(default_factory=lambda: np.zeros(0, np.int32))
    """(k,)."""
    mass: Floats = field(default_factory=lambda: np.zeros(0))
    """(k,) of the node, by the tets of the part, kg."""
    rank: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """(parts,) a node of several stands for that of the lowest where it can stand for one alone, as in contact; (0,)
    where no bond makes such nodes."""

    @property
    def fraction(self) -> Floats:
        """(k,) share of the mass of the node."""
        whole = np.bincount(self.node, self.mass, minlength=1)
        return np.asarray(self.mass / whole[self.node])

    @property
    def key(self) -> Ints:
        """(k,) node and part as one number, ascending."""
        return self.node.astype(np.int64) * MOST_PARTS + self.part

    def take(self, chosen: "np.ndarray") -> "Shares":
        """Some of the rows."""
        return Shares(self.node[chosen], self.part[chosen], self.mass[chosen], self.rank)

    def members(self, part: Indices) -> tuple[Ints, Indices]:
        """(m,) nodes and (m,) their parts: all nodes with the ``part`` (n,) that each stands for, and behind them those
        of several once more for each of the others.
        """
        more = self.part != part[self.node]
        return np.concatenate([np.arange(len(part)), self.node[more]]), np.concatenate([part, self.part[more]])

    def of_nodes(self, local: Indices) -> "Shares":
        """The rows of the nodes that ``local`` (nodes,) has a new index for, -1 for the others, with this index."""
        some = local[self.node] >= 0
        return Shares(local[self.node[some]], self.part[some], self.mass[some], self.rank)

    def standing(self) -> tuple[Indices, Indices]:
        """The nodes of the rows, each once, and the part that each stands for."""
        order = np.lexsort((self.rank[self.part], self.node)) if len(self.node) else np.zeros(0, np.int64)
        nodes, first = np.unique(self.node[order], return_index=True)
        return nodes, self.part[order][first]

    def follow(self, node: Indices, part: Indices, mass: Floats) -> "tuple[Shares, Indices, Indices]":
        """The shares after nodes have separated, by a row for each tet at each node that was touched: the ``node``
        (r,) that it has now, its ``part`` and what of its mass the node has, kg, in an order that no cut changes.
        Besides the nodes touched, each once, and the part that each stands for now.
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
    """The shares of the nodes of several parts, by a row for each corner of each tet: its ``node``, its ``part``, and
    what of the mass of the tet the node has, kg.
    """
    empty = Shares(rank=rank)
    return empty.follow(np.asarray(node, np.int32), np.asarray(part, np.int32), mass)[0]


def ranks(case: Case) -> Ints:
    """(parts,) of ``Shares.rank``: parts that meet others in contact come first; (0,) in a case without shared nodes
    between parts."""
    if not shared_bonds(case):
        return np.zeros(0, np.int64)
    meets = case.contact.parts if case.contact is not None else ()
    last = [bool(meets) and part.name not in meets for part in case.parts]
    order = sorted(range(len(last)), key=lambda i: (last[i], i))
    return np.argsort(order).astype(np.int64)
