"""Shared nodes: which ranks hold them, and how their integer sums are completed.

Each rank sums the contributions of its own tets; one exchange with the neighbours adds the others'. Integer addition
does not care for the order, so every holder of a node ends with the same bits and integrates the same motion.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from ..state import Indices, Ints
from .comm import Comm


@dataclass
class Neighbour:
    """Another rank, and the local nodes shared with it in the order of their global ids; they grow with copies."""

    rank: int
    nodes: Indices


@njit("void(int64[:, ::1], int32[::1], int64[:, ::1])", cache=True)
def _pack(buffer, nodes, sums):  # type: ignore[no-untyped-def]
    for i in range(len(nodes)):
        for k in range(sums.shape[1]):
            buffer[i, k] = sums[nodes[i], k]


@njit("void(int64[:, ::1], int32[::1], int64[:, ::1])", cache=True)
def _add(sums, nodes, buffer):  # type: ignore[no-untyped-def]
    for i in range(len(nodes)):
        for k in range(sums.shape[1]):
            sums[nodes[i], k] += buffer[i, k]


def complete(comm: Comm, neighbours: list[Neighbour], sums: Ints, tag: int) -> None:
    """Completes nodal sums (nodes, columns) once; all ranks take part."""
    shared = SharedSum(comm, neighbours, sums.shape[1], tag)
    shared.begin(sums)
    shared.finish(sums)
    shared.free()


class SharedSum:
    """Completes nodal sums, (nodes, ``columns``) int64, again and again."""

    def __init__(self, comm: Comm, neighbours: list[Neighbour], columns: int, tag: int) -> None:
        self._nodes = [n.nodes for n in neighbours]
        self._out = [np.zeros((len(n.nodes), columns), np.int64) for n in neighbours]
        self._in = [np.zeros_like(buffer) for buffer in self._out]
        ranks = [n.rank for n in neighbours]
        self._exchange = comm.exchange(
            list(zip(ranks, self._out, strict=True)), list(zip(ranks, self._in, strict=True)), tag
        )

    @property
    def bytes_sent(self) -> int:
        """Bytes this rank sends in one exchange."""
        return sum(buffer.nbytes for buffer in self._out)

    def begin(self, sums: Ints) -> None:
        """Sends the local sums of the shared nodes; the tets of shared nodes must all have been summed."""
        for buffer, nodes in zip(self._out, self._nodes, strict=True):
            _pack(buffer, nodes, sums)
        self._exchange.begin()

    def finish(self, sums: Ints) -> None:
        """Adds what the neighbours sent: the sums of the shared nodes are complete."""
        self._exchange.finish()
        for buffer, nodes in zip(self._in, self._nodes, strict=True):
            _add(sums, nodes, buffer)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        self._exchange.free()
