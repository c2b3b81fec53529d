"""Sums over the ranks that share a node with an impulse.

In a step, most nodes that two ranks share get no impulse from either rank. Therefore the ranks first exchange two bits
for each shared node: the first is 1 if the rank has an active contact of the node; the second is 1 if the rank needs
the sum, because it has such a contact or has the node. Later in the step, a sum is sent only if one rank has a
contribution and the other rank needs the sum. Sums are integers, and contributions that are not sent are zero.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.state import Indices, Ints
from ...parallel.comm import Comm, Exchange
from ...parallel.ownership import Neighbour
from ...parallel.tags import Tag
from ..narrow_phase.rows import ActiveRows

_WORD = 63
"""Number of bits that are used in a word of flags."""
_ROOM = 4
"""Number of words by which the messages of a rank are enlarged. Chosen value: about 250 separated nodes fit before new
messages are needed."""
_COLUMNS = 4
"""Largest number of columns summed at once (active.ActiveNodes.row_weights)."""


class SharedSums:
    """Flags of the shared slots for every other rank, and the messages that exchange these flags."""

    def __init__(self, neighbours: list[Neighbour], comm: Comm) -> None:
        """``neighbours``: shared slots for each other rank, in an order that is equal on both ranks."""
        self._comm = comm
        self._words = np.zeros(0, np.int64)
        self._exchange: Exchange | None = None
        none = np.zeros(0, np.int32)
        self._nothing = ActiveSum([], none, none, np.zeros((0, 2), np.int64), comm)
        self.take(neighbours)

    def take(self, neighbours: list[Neighbour]) -> None:
        """Replaces the shared slots. A message that is large enough is used again."""
        self.neighbours = neighbours
        self._every = np.concatenate([np.zeros(0, np.int32), *(some.nodes for some in neighbours)])
        self._ends = np.cumsum([0, *(len(some.nodes) for some in neighbours)])
        words = np.cumsum([0, *(2 * _ROOM * (1 + len(some.nodes) // (_ROOM * _WORD)) for some in neighbours)])
        if self._exchange is not None and np.array_equal(words, self._words):
            return
        self.free()
        self._words = words
        self._out, self._in = (np.zeros(words[-1], np.int64) for _ in range(2))
        self._exchange = self._comm.exchange(self._slices(self._out), self._slices(self._in), Tag.CONTACT_FLAGS)

    def _slices(self, words: Ints) -> list[tuple[int, Ints]]:
        begins, ends = self._words[:-1], self._words[1:]
        return [(o.rank, words[a:b]) for o, a, b in zip(self.neighbours, begins, ends, strict=True)]

    def agree(self, contacts: ActiveRows, local: Indices) -> "ActiveSum":
        """Returns the sums for a step with the active ``contacts``. ``local`` (surface_nodes,): local index of each
        node, -1 for nodes that this rank does not have."""
        if not self.neighbours:
            return self._nothing
        assert self._exchange is not None
        _flag(self._out, self._every, self._ends, self._words, contacts.nodes, local)
        self._exchange.begin()
        self._exchange.finish()
        sends, receives, counts = _agreed(self._out, self._in, self._every, self._ends, self._words)
        ranks = [some.rank for some in self.neighbours]
        return ActiveSum(ranks, sends, receives, counts, self._comm)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        if self._exchange is not None:
            self._exchange.free()


class ActiveSum:
    """Completion of sums over the ranks in one step, at the nodes with an impulse."""

    def __init__(self, ranks: list[int], sends: Indices, receives: Indices, counts: Ints, comm: Comm) -> None:
        """``sends`` and ``receives``: slots, ordered by rank; ``counts`` (ranks, 2): number of sent and of received
        slots of each rank.
        """
        self._sends, self._receives = sends, receives
        self.shared: Indices = np.concatenate([sends, receives])
        """Slots whose sums are sent or received; a slot may occur several times."""
        self._out, self._in = (np.zeros((len(some), _COLUMNS), np.int64) for some in (sends, receives))
        out, into = (_parts(words, ranks, many) for words, many in zip((self._out, self._in), counts.T, strict=True))
        self._exchange = comm.exchange(out, into, Tag.CONTACT)

    def number(self, slots: Indices) -> None:
        """Replaces slots by rows of the summed arrays; ``slots`` (surface_nodes,): row of each slot."""
        self._sends, self._receives = slots[self._sends], slots[self._receives]

    def begin(self, words: Ints, first: int, columns: int) -> None:
        """Sends the sums of this rank: ``columns`` columns of ``words`` (rows, k), from ``first`` on."""
        _pack(self._out, self._sends, words, first, columns)
        self._exchange.begin()

    def finish(self, words: Ints, first: int, columns: int) -> None:
        """Receives the sums of the other ranks and adds them to ``words``."""
        self._exchange.finish()
        _add(words, first, self._receives, self._in, columns)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self._exchange.free()


def _parts(words: Ints, ranks: list[int], counts: Ints) -> list[tuple[int, Ints]]:
    """Returns the range of rows of each rank. Ranks without rows are left out."""
    parts, end = [], 0
    for rank, many in zip(ranks, counts.tolist(), strict=True):
        end += many
        if many:
            parts.append((rank, words[end - many : end]))
    return parts


@njit("void(int64[::1], int32[::1], int64[::1], int64[::1], int32[:, ::1], int32[::1])", cache=True)
def _flag(out, nodes, ends, words, contacts, local):  # type: ignore[no-untyped-def]
    """Writes two bits for each shared node of each rank into ``out``: one that is set if this rank has an active
    contact of the node, and one that is set if this rank needs the sum."""
    pushed = np.zeros(len(local), np.bool_)
    for p in range(len(contacts)):
        for k in range(4):
            pushed[contacts[p, k]] = True
    out[:] = 0
    for r in range(len(ends) - 1):
        first, behind = words[r], (words[r + 1] - words[r]) // 2
        for at in range(ends[r], ends[r + 1]):
            a, place = nodes[at], at - ends[r]
            word, bit = first + place // _WORD, np.int64(1) << np.int64(place % _WORD)
            if pushed[a]:
                out[word] |= bit
            if pushed[a] or local[a] >= 0:
                out[word + behind] |= bit


@njit(
    "Tuple((int32[::1], int32[::1], int64[:, ::1]))(int64[::1], int64[::1], int32[::1], int64[::1], int64[::1])",
    cache=True,
)
def _agreed(mine, theirs, nodes, ends, words):  # type: ignore[no-untyped-def]
    """Returns two lists of nodes, ordered by rank: the nodes to send, and the nodes to receive. Also returns, for each
    rank, the number of nodes to send and the number of nodes to receive (ranks, 2).
    """
    sends, receives = np.empty(len(nodes), np.int32), np.empty(len(nodes), np.int32)
    counts = np.zeros((len(ends) - 1, 2), np.int64)
    n, m = 0, 0
    for r in range(len(ends) - 1):
        first, behind = words[r], (words[r + 1] - words[r]) // 2
        for word in range(first, first + behind):
            to, fro = mine[word] & theirs[word + behind], theirs[word] & mine[word + behind]
            if to | fro == 0:
                continue
            for place in range(_WORD):
                bit, at = np.int64(1) << np.int64(place), ends[r] + (word - first) * _WORD + place
                if to & bit:
                    sends[n] = nodes[at]
                    n += 1
                    counts[r, 0] += 1
                if fro & bit:
                    receives[m] = nodes[at]
                    m += 1
                    counts[r, 1] += 1
    return sends[:n].copy(), receives[:m].copy(), counts


@njit("void(int64[:, ::1], int32[::1], int64[:, ::1], int64, int64)", cache=True)
def _pack(out, rows, words, first, columns):  # type: ignore[no-untyped-def]
    for r in range(len(rows)):
        for i in range(columns):
            out[r, i] = words[rows[r], first + i]


@njit("void(int64[:, ::1], int64, int32[::1], int64[:, ::1], int64)", cache=True)
def _add(words, first, rows, received, columns):  # type: ignore[no-untyped-def]
    for r in range(len(rows)):
        for i in range(columns):
            words[rows[r], first + i] += received[r, i]
