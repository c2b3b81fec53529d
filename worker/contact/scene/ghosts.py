"""Ghosts: copies of surface nodes of other ranks. The module has the state of ghosts in every step, and the lists of
shared nodes with impulses."""

from itertools import pairwise

import numpy as np

from ...kernels.jit import njit
from ...model.state import Flags, Floats, Indices, Ints, Nodes
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, ranks
from ...parallel.tags import Tag
from ..surface.records import Edges, Faces, SurfaceNodes

_CROWD_WORDS = 15
"""Number of words for one node in a message (``pack``)."""
_ROOM = 32
"""Number of rows by which the message of a rank is enlarged, so that separated nodes rarely require a new message.
Chosen value: the additional rows take 2 kB."""


def pack(faces: Faces, edges: Edges, surface_nodes: SurfaceNodes) -> Ints:
    """Packs faces, edges and their nodes into one flat message; floats are packed as bit patterns."""
    return np.concatenate([
        np.array([faces.n, edges.n], np.int64),
        faces.id, faces.nodes.reshape(-1), faces.size.view(np.int64), faces.exposed,
        edges.nodes.reshape(-1), edges.sides.reshape(-1), edges.size.view(np.int64), edges.deep.view(np.int64),
        edges.opened.reshape(-1), edges.sharp,
        pack_nodes(surface_nodes).reshape(-1),
    ])  # fmt: skip


def unpack(words: Ints) -> tuple[Faces, Edges, SurfaceNodes]:
    """Unpacks a message that ``pack`` made."""
    f, e = int(words[0]), int(words[1])
    ends = np.cumsum([2, f, 4 * f, f, f, 6 * e, 2 * e, e, e, 2 * e, e])
    pieces = [words[a:b] for a, b in pairwise(ends)]
    faces = Faces(pieces[0], pieces[1].reshape(f, 4), pieces[2].view(np.float64), pieces[3] > 0)
    sides, size, deep = pieces[5].reshape(e, 2), pieces[6].view(np.float64), pieces[7].view(np.float64)
    edges = Edges(pieces[4].reshape(e, 6), sides, size, deep, pieces[8].reshape(e, 2).astype(np.uint8), pieces[9] > 0)
    return faces, edges, unpack_nodes(words[ends[-1] :])


def pack_nodes(surface_nodes: SurfaceNodes) -> Ints:
    """(n, 15) words of the nodes."""
    floats = np.concatenate([surface_nodes.mobility, surface_nodes.x, surface_nodes.v, surface_nodes.course], axis=1)
    return np.column_stack(
        [surface_nodes.id, surface_nodes.owner, surface_nodes.part, np.ascontiguousarray(floats).view(np.int64)]
    )


def unpack_nodes(words: Ints) -> SurfaceNodes:
    """Returns the nodes that ``pack_nodes`` packed, as ghosts."""
    rows = words.reshape(-1, _CROWD_WORDS)
    floats = np.ascontiguousarray(rows[:, 3:]).view(np.float64)
    return SurfaceNodes(
        rows[:, 0].copy(), np.full(len(rows), -1, np.int32), rows[:, 1].astype(np.int32), rows[:, 2].astype(np.int32),
        floats[:, :3].copy(), floats[:, 3:6].copy(), floats[:, 6:9].copy(), floats[:, 9:].copy(),
    )  # fmt: skip


def fetch(ids: Ints, owners: Indices, held: SurfaceNodes, comm: Comm) -> SurfaceNodes:
    """Receives the data of nodes that are not on this rank from the owners of these nodes. ``ids``, ``owners``: global
    ids and owner ranks of the nodes; ``held``: all local nodes. Collective.
    """
    asked = comm.swap({rank: ids[owners == rank] for rank in ranks(owners)})
    answers = comm.swap({rank: pack_nodes(held.take(held.places(want))) for rank, want in asked.items()})
    return unpack_nodes(np.concatenate([np.zeros(0, np.int64), *answers.values()]))


def members(used: Ints, owners: Indices, holders: list[Neighbour], nodes: Nodes, comm: Comm) -> dict[int, Ints]:
    """Returns, for every other rank, the ids, ascending, of the nodes for which the two ranks need the sum of impulses.

    ``used`` (k,): ids of the nodes to which contacts of this rank may apply impulses; ``owners`` (k,): owners of these
    nodes; ``holders``: shared nodes. The owner of a node collects the ranks with such contacts; it sends the list of
    these ranks to all ranks in the list, and to all ranks that have the node.
    """
    pushed, rows = np.zeros(nodes.n, bool), [used[:0]]
    pushed[nodes.places(used[owners == comm.rank])] = True
    asked = {rank: used[owners == rank] for rank in ranks(owners) if rank != comm.rank}
    for rank, ids in comm.swap(asked).items():
        pushed[nodes.places(ids)] = True
        rows.append(_rows(ids, rank, comm))
    for other in holders:
        some = other.nodes[pushed[other.nodes] & nodes.owned[other.nodes]]
        rows.append(_rows(nodes.id[some], other.rank, comm))
    table = np.sort(np.concatenate(rows))
    table = table[_begins(table)]
    every = table // comm.size
    table = np.sort(np.concatenate([table, _rows(every[_begins(every)], comm.rank, comm)]))
    node, holder = table // comm.size, table % comm.size
    group = np.cumsum(_begins(node)) - 1
    received = comm.swap({member: _company(node, holder, group, member) for member in ranks(holder)})
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *(words.reshape(-1, 2) for words in received.values())])
    pairs = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))]
    return {other: pairs[pairs[:, 1] == other, 0] for other in ranks(pairs[:, 1]) if other != comm.rank}


def _begins(values: Ints) -> Flags:
    """(n,) True for each element that is the first one among equal elements; ``values`` is ascending."""
    return np.concatenate([np.ones(min(len(values), 1), bool), values[1:] != values[:-1]])


def _rows(ids: Ints, rank: int, comm: Comm) -> Ints:
    """Returns node and rank of each row, combined into one number."""
    return ids * comm.size + rank


def _company(node: Ints, holder: Ints, group: Ints, member: int) -> Ints:
    """Returns rows (node, rank that has the node) for the nodes of the rank ``member``, without the rows of that rank
    itself. ``group`` (n,): number of the node of each row.
    """
    held = np.zeros(group[-1] + 1, bool)
    held[group[holder == member]] = True
    some = held[group] & (holder != member)
    return np.column_stack([node[some], holder[some]])


class Copies:
    """Persistent MPI messages that transfer the state of ghosts in every step: positions, and velocities before and
    after the kick.
    """

    def __init__(self, sends: list[Neighbour], receives: list[Neighbour], comm: Comm, tag: Tag) -> None:
        """``sends``: local nodes that are sent to each rank; ``receives``: slots of the ghosts that each rank sends."""
        self._comm, self._tag = comm, tag
        self._rows: tuple[list[int], list[int]] | None = None
        self.take(sends, receives)

    def take(self, sends: list[Neighbour], receives: list[Neighbour]) -> None:
        """Replaces the nodes of the messages. A message that is large enough is used again."""
        self.sends, self.receives = sends, receives
        rows = _rooms(sends), _rooms(receives)
        self._from, self._to = _padded(sends, rows[0]), _padded(receives, rows[1])
        if rows == self._rows:
            return
        if self._rows is not None:
            self.free()
        self._rows = rows
        self._out, self._in = np.zeros((len(self._from), 9)), np.empty((len(self._to), 9))
        into = _slices(self._in, receives, rows[1])
        self._exchange = self._comm.exchange(_slices(self._out, sends, rows[0]), into, self._tag)

    def note(self, nodes: Nodes) -> None:
        """Stores the velocities v(n-1/2), which the next message contains."""
        _pack(self._out, 6, nodes.v, self._from)

    def begin(self, nodes: Nodes) -> None:
        """Sends positions and velocities of the nodes."""
        _pack(self._out, 0, nodes.x, self._from)
        _pack(self._out, 3, nodes.v, self._from)
        self._exchange.begin()

    def finish(self, x: Floats, v: Floats, before: Floats) -> None:
        """Receives the state of the ghosts. Writes it to the rows of ``x``, ``v`` and v(n-1/2), (surface_nodes, 3)
        each.
        """
        self._exchange.finish()
        _unpack(x, v, before, self._to, self._in)

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self._exchange.free()


@njit("void(float64[:, ::1], int64, float64[:, ::1], int32[::1])", cache=True)
def _pack(out, first, values, rows):  # type: ignore[no-untyped-def]
    for r in range(len(rows)):
        if rows[r] >= 0:
            for i in range(3):
                out[r, first + i] = values[rows[r], i]


@njit("void(float64[:, ::1], float64[:, ::1], float64[:, ::1], int32[::1], float64[:, ::1])", cache=True)
def _unpack(x, v, before, rows, got):  # type: ignore[no-untyped-def]
    for r in range(len(rows)):
        if rows[r] >= 0:
            for i in range(3):
                x[rows[r], i], v[rows[r], i], before[rows[r], i] = got[r, i], got[r, 3 + i], got[r, 6 + i]


def _rooms(others: list[Neighbour]) -> list[int]:
    """Returns the number of rows of the message of each rank."""
    return [_ROOM * (1 + len(other.nodes) // _ROOM) for other in others]


def _padded(others: list[Neighbour], rooms: list[int]) -> Indices:
    """Returns the nodes of all ranks, rank after rank. The nodes of a rank are filled with -1 up to the number of rows
    of its message, ``rooms``.
    """
    rows, begin = np.full(sum(rooms), -1, np.int32), 0
    for other, room in zip(others, rooms, strict=True):
        rows[begin : begin + len(other.nodes)] = other.nodes
        begin += room
    return rows


def _slices(buffer: Floats, others: list[Neighbour], rooms: list[int]) -> list[tuple[int, Ints]]:
    """Returns the range of each rank in the ``buffer``."""
    words, ends = buffer.view(np.int64), np.cumsum(rooms).tolist()
    return [(other.rank, words[end - room : end]) for other, room, end in zip(others, rooms, ends, strict=True)]


def copies(surface_nodes: SurfaceNodes, nodes: Nodes, comm: Comm, tag: Tag) -> Copies:
    """Makes the persistent messages with the ghosts among the ``surface_nodes``. The messages are exchanged with the
    owners of the ghosts. Collective.
    """
    far = np.flatnonzero(surface_nodes.local < 0)
    owners = surface_nodes.owner[far]
    asked = comm.swap({rank: surface_nodes.id[far[owners == rank]] for rank in ranks(owners)})
    receives = [Neighbour(rank, far[owners == rank].astype(np.int32)) for rank in ranks(owners)]
    sends = [Neighbour(rank, np.searchsorted(nodes.id, ids).astype(np.int32)) for rank, ids in asked.items()]
    return Copies(sends, receives, comm, tag)
