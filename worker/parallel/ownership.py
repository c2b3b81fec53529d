"""Shared nodes: the ranks that have each shared node, and the completion of the integer sums at shared nodes.

Each rank sums the contributions of its own tets. One exchange with the neighbouring ranks adds the contributions of the
tets of these ranks. Integer addition does not depend on the order. Therefore every rank that has a node gets a
bit-identical sum and computes the same motion.
"""

from dataclasses import dataclass

import numpy as np

from ..kernels.jit import njit
from ..model.state import Indices, Ints
from .comm import Comm
from .tags import Tag


@dataclass
class Neighbour:
    """Another rank, and the local nodes that this rank shares with it. The nodes are in the order of their global ids;
    copies of separated nodes are appended.
    """

    rank: int
    nodes: Indices


def same(some: list[Neighbour], others: list[Neighbour]) -> bool:
    """Return True if two lists contain the same array objects. If so, no shared node was added."""
    return len(some) == len(others) and all(a.nodes is b.nodes for a, b in zip(some, others, strict=True))


def ranks(owners: Indices | Ints) -> list[int]:
    """Return the distinct ranks that occur in ``owners``, ascending."""
    found: list[int] = np.flatnonzero(np.bincount(owners)).tolist()
    return found


@njit("void(int64[:, ::1], int32[::1], int64[:, ::1])", cache=True)
def _pack(buffer, nodes, sums):  # type: ignore[no-untyped-def]
    for i in range(len(nodes)):
        for k in range(buffer.shape[1] if nodes[i] >= 0 else 0):
            buffer[i, k] = sums[nodes[i], k]


@njit("void(int64[:, ::1], int32[::1], int64[:, ::1])", cache=True)
def _add(sums, nodes, buffer):  # type: ignore[no-untyped-def]
    for i in range(len(nodes)):
        for k in range(buffer.shape[1] if nodes[i] >= 0 else 0):
            sums[nodes[i], k] += buffer[i, k]


def complete(comm: Comm, neighbours: list[Neighbour], sums: Ints, tag: Tag) -> None:
    """Complete nodal sums (nodes, columns) once. Collective."""
    shared = SharedSum(comm, neighbours, sums.shape[1], tag)
    shared.begin(sums)
    shared.finish(sums)
    shared.free()


class SharedSum:
    """Completion of the first ``columns`` columns of nodal sums, int64, that can be repeated."""

    def __init__(
        self, comm: Comm, neighbours: list[Neighbour], columns: int, tag: Tag, *, headed: bool = False
    ) -> None:  # fmt: skip
        """``headed``: True if a word for each neighbour is sent together with the sums."""
        self._nodes = [n.nodes for n in neighbours]
        head = np.full(int(headed), -1, np.int32)
        self._every = np.concatenate([head[:0], *(part for nodes in self._nodes for part in (nodes, head))])
        self._out, self._in = (np.zeros((len(self._every), columns), np.int64) for _ in range(2))
        ranks = [n.rank for n in neighbours]
        ends = np.cumsum([len(nodes) + len(head) for nodes in self._nodes], dtype=np.int64)
        sends, receives = (np.split(buffer, ends[:-1]) if ranks else [] for buffer in (self._out, self._in))
        self._heads = ends - 1
        self._exchange = comm.exchange(
            list(zip(ranks, sends, strict=True)), list(zip(ranks, receives, strict=True)), tag
        )

    def serves(self, neighbours: list[Neighbour]) -> bool:
        """Return True if the neighbours share the same nodes as when this object was made."""
        return all(one.nodes is nodes for one, nodes in zip(neighbours, self._nodes, strict=True))

    @property
    def received(self) -> Ints:
        """(neighbours,) the word that each neighbour has sent together with its sums."""
        return np.asarray(self._in[self._heads, 0])

    def begin(self, sums: Ints, words: Ints | None = None) -> None:
        """Send the local sums of the shared nodes, and ``words`` (neighbours,).

        Before the call, all tets of this rank at shared nodes must have been added to the sums.
        """
        if not self._nodes:
            return
        if words is not None:
            self._out[self._heads, 0] = words
        _pack(self._out, self._every, sums)
        self._exchange.begin()

    def finish(self, sums: Ints) -> None:
        """Receive and add the sums of the neighbours. After the call the sums of the shared nodes are complete."""
        if not self._nodes:
            return
        self._exchange.finish()
        _add(sums, self._every, self._in)

    def free(self) -> None:
        """Free the MPI requests."""
        self._exchange.free()
