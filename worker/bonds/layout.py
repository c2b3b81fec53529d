"""Tied rows on one rank. A tied row is a tied node with its mortar nodes and weights. Each rank computes the rows of
the tied nodes that it owns, and has a table of the nodes to which these rows apply impulses.

The table contains the nodes of the rows, and all tied and mortar nodes on this rank, because rows of other ranks may
apply impulses to them. Positions and velocities of nodes of other ranks are copied from their owners. Sums of impulses
are sent to all ranks that have the node in their table. Every rank has the list of all rows (rows.py). The messages are
planned only when the rows change.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..model.state import Flags, Floats, Indices, Ints, Nodes
from ..parallel.comm import Comm, Exchange
from ..parallel.tags import Tag
from ..rigid.points import Points
from ..rigid.stage import Rigid
from .records import BREAKS, KEPT, NORMAL, STATE, TiedNodes, TiedRows
from .rows import Rows, chain

_SETTLED = 1e-7
"""Target of the sweeps of a step: residual of the sweeps divided by the change of the impulses in the step. Chosen
value: the energy dissipated by the bond is then below 1e-9 of the energy transmitted through the bond
(docs/theory/bonds.md)."""
_SLOWEST = 0.02
"""Smallest value that is used for the ratio of the smallest to the largest eigenvalue of the tied rows; with this ratio
a step has 60 sweeps. Chosen value: a smallest value is needed because the bound of the ratio is zero for tied nodes
with prescribed motion."""
_WORDS = 6
"""Number of words for one node in a message: its position and velocity."""


@dataclass
class Layout:
    """Arrays and messages of the sweeps of a rank."""

    rows: TiedRows
    nodes: TiedNodes
    number: Ints
    """(r,) number of each tied row of this rank among the tied rows of all ranks."""
    held: Indices
    """(h,) places in the table of the nodes that are on this rank."""
    local: Indices
    """(h,) local indices of the nodes that are in the table and on this rank."""
    sweeps: int
    """Number of sweeps in a step."""
    momentum: float
    """Nesterov's extrapolation factor of the impulses."""
    messages: "Messages"
    rigid: Rigid | None
    """Rigid bodies; None if no tied row on any rank has a rigid body on its mortar side."""


def momentum(least: float) -> tuple[float, int]:
    """Returns the extrapolation factor, and the number of sweeps that reduce the relative residual to _SETTLED.
    ``least``: bound of the ratio of the smallest to the largest eigenvalue of the tied rows. With q = sqrt(``least``)
    the factor is (1 - q) / (1 + q), and a sweep multiplies the residual by 1 - q (Nesterov 2004, 2.2.1).
    """
    root, sweeps, left = math.sqrt(max(least, _SLOWEST)), 1, 1.0
    while left > _SETTLED:
        left, sweeps = left * (1.0 - root), sweeps + 1
    return (1.0 - root) / (1.0 + root), sweeps


def laid_out(
    rows: Rows, states: Floats, laws: Floats, nodes: Nodes, mobility: Floats, planes: Flags, rigid: Rigid | None,
    scale: float, comm: Comm,
) -> Layout:  # fmt: skip
    """Returns the layout of the tied ``rows`` with their ``states`` (r, KEPT). ``mobility`` (nodes, 3): 1/kg;
    ``planes`` (nodes, 3): components that symmetry planes hold; ``scale``: quanta per N s. Collective.
    """
    points = rigid.points(rows.row, rows.master, rows.weight, nodes.id, comm) if rigid is not None else Points.none()
    rows = _at_points(rows, points)
    place = nodes.places(rows.node)
    mine = (place >= 0) & nodes.owned[place]
    entries, sides = mine[rows.row], mine[rows.side]
    every = np.unique(np.concatenate([rows.node, rows.master, rows.face.reshape(-1)]))
    own = [rows.node[mine], rows.master[entries]]
    ids = np.unique(np.concatenate([every[nodes.places(every) >= 0], *own, rows.face[sides].reshape(-1)]))
    local = nodes.places(ids)
    held = np.flatnonzero(local >= 0).astype(np.int32)
    table = np.zeros((len(ids), 3))
    table[held] = mobility[local[held]]
    pushed = np.isin(ids, np.concatenate(own))
    messages = Messages.of(ids, pushed, local, nodes, comm)
    messages.copy(table, np.zeros((len(ids), 3)))
    of_bodies = np.zeros(len(rows.node))
    if rigid is not None:
        of_bodies[points.row] = points.norms(rigid.bodies)
    slack = (1.0 + chain(rows)) ** 2  # the smallest singular value of I - N is at least 1 / (1 + |N|) if N^2 = 0
    least, inverse = _norms(rows, mine, ids, table, planes[place[mine]], of_bodies[mine], comm)
    tied = _rows(rows, mine, ids, inverse, states, laws)
    share, sweeps = momentum(least / slack)
    if rigid is not None and len(points):
        held_points = points.take(mine[points.row])
        rigid.bonds.take_up(held_points, np.searchsorted(ids, _name(held_points.row)).astype(np.int32), scale)
    place = local[held].astype(np.int32)
    return Layout(
        tied, _nodes(tied, ids, table), np.flatnonzero(mine), held, place, sweeps, share, messages,
        rigid if len(points) else None,
    )  # fmt: skip


def _name(row: Ints) -> Ints:
    """Returns the table id of a point of a rigid body for each tied row that is tied to such a point. Nodes have ids
    from 0 on.
    """
    return -1 - row


def _at_points(rows: Rows, points: Points) -> Rows:
    """Returns the tied rows after the replacement of mortar nodes: one point of a rigid body replaces all mortar nodes
    of a row.
    """
    others = ~np.isin(rows.row, points.row)
    row = np.concatenate([rows.row[others], points.row])
    order = np.argsort(row, kind="stable")
    master = np.concatenate([rows.master[others], _name(points.row)])[order]
    weight = np.concatenate([rows.weight[others], np.ones(len(points))])[order]
    return replace(rows, row=row[order], master=master, weight=weight)


def _norms(
    rows: Rows, mine: Flags, ids: Ints, table: Floats, planes: Flags, of_bodies: Floats, comm: Comm
) -> tuple[float, Floats]:  # fmt: skip
    """Returns a bound of the ratio of the smallest to the largest eigenvalue of all tied rows. Also returns (r, 3) 1 /
    bound of the l1 norm of each row of this rank, kg; the l1 norm is sum_k |w_k| S_k / m_k, where S_k is the sum of
    |w_k| over all rows.

    The bounds and norms of a tied row are 0 if none of its nodes can move. The norms are also 0 across ``planes`` (r,
    3) of symmetry that contain the tied node, because the mirror image of the mortar side keeps the node on the plane.
    ``of_bodies`` (r,): contribution of rigid bodies to the norms, 1/kg.
    """
    known = np.unique(np.concatenate([rows.node, rows.master]))
    sums = np.bincount(np.searchsorted(known, rows.master), np.abs(rows.weight), len(known))
    sums += np.bincount(np.searchsorted(known, rows.node), minlength=len(known))
    entries = mine[rows.row]
    at, row = np.searchsorted(ids, rows.master[entries]), (np.cumsum(mine) - 1)[rows.row[entries]]
    weight = np.abs(rows.weight[entries]) * sums[np.searchsorted(known, rows.master[entries])]
    node = np.searchsorted(ids, rows.node[mine])
    first, norm = table[node], np.empty((len(node), 3))
    for i in range(3):
        norm[:, i] = np.bincount(row, weight * table[at, i], len(node))
    norm += first * sums[np.searchsorted(known, rows.node[mine])][:, None] + of_bodies[:, None]
    norm[planes] = 0.0
    moves = (norm > 0.0) & (first > 0.0)
    worst = np.where(moves, norm / np.where(first > 0.0, first, 1.0), 1.0).max(initial=1.0)
    worst = float(comm.maximum(np.array([worst]))[0])
    return 1.0 / worst, np.where(norm > 0.0, 1.0 / np.where(norm > 0.0, norm, 1.0), 0.0)


def _rows(rows: Rows, mine: Flags, ids: Ints, inverse: Floats, states: Floats, laws: Floats) -> TiedRows:
    entries, sides = mine[rows.row], mine[rows.side]
    n, again = int(mine.sum()), np.cumsum(mine) - 1
    begin, side = (np.searchsorted(again[of], np.arange(n + 1)) for of in (rows.row[entries], rows.side[sides]))
    state = np.zeros((n, STATE))
    state[:, :KEPT], state[:, NORMAL] = states[mine], 1.0
    bond = rows.bond[mine].astype(np.int32)
    breaks = laws[bond, BREAKS] != 0.0
    least = np.where(inverse > 0.0, inverse, np.inf).min(axis=1, initial=np.inf)
    inverse[breaks] = np.where(inverse > 0.0, least[:, None], 0.0)[breaks]
    return TiedRows(
        np.searchsorted(ids, rows.node[mine]).astype(np.int32), begin.astype(np.int64),
        np.searchsorted(ids, rows.master[entries]).astype(np.int32), rows.weight[entries], rows.area[mine], inverse,
        bond, laws, side.astype(np.int64), np.searchsorted(ids, rows.face[sides]).astype(np.int32), state,
        np.zeros((n, 3)), np.zeros((n, 3), np.int64),
    )  # fmt: skip


def _nodes(rows: TiedRows, ids: Ints, mobility: Floats) -> TiedNodes:
    """Returns the table of nodes, and the weights of each node in the tied rows. The weight is NaN for a tied node."""
    n = len(ids)
    of = np.repeat(np.arange(len(rows.node)), np.diff(rows.begin))
    at = np.concatenate([rows.master, rows.node])
    row = np.concatenate([of, np.arange(len(rows.node))]).astype(np.int32)
    share = np.concatenate([rows.weight, np.full(len(rows.node), np.nan)])
    order = np.argsort(at, kind="stable")
    first = np.searchsorted(at[order], np.arange(n + 1)).astype(np.int64)
    x, v = np.zeros((2, n, 3))
    words, total = np.zeros((2, n, 3), np.int64)
    return TiedNodes(x, v, mobility, words, total, first, row[order], share[order])


@dataclass
class Messages:
    """Messages between ranks for tied bonds; they are sent in every step."""

    sums: Exchange
    copies: Exchange
    sends: Indices
    """``sends``: table places of the sums that this rank sends, ordered by rank; ``receives``: table places of the sums
    that it receives."""
    receives: Indices
    gives: Indices
    """``gives``: table places of the nodes whose copies this rank sends; ``takes``: table places of the nodes whose
    copies it receives."""
    takes: Indices
    buffers: tuple[Ints, Ints, Ints, Ints]
    """Buffers of four kinds: sent sums, received sums, sent copies, received copies."""

    @classmethod
    def of(cls, ids: Ints, pushed: Flags, local: Indices, nodes: Nodes, comm: Comm) -> "Messages":
        """Plans the messages for the table ``ids`` of nodes; ``local``: local indices of the nodes. ``pushed``: True
        for each node to which a row of this rank applies an impulse. Collective.
        """
        owned = (local >= 0) & nodes.owned[local]
        tables = comm.share((ids, pushed, local >= 0, owned))
        kinds: list[list[tuple[int, Ints]]] = [[], [], [], []]
        for rank, (theirs, their_pushed, their_held, their_owned) in enumerate(tables):
            if rank == comm.rank:
                continue
            _, here, there = np.intersect1d(ids, theirs, assume_unique=True, return_indices=True)
            for kind, some in zip(
                kinds,
                (pushed[here], their_pushed[there], owned[here] & ~their_held[there],
                 their_owned[there] & (local[here] < 0)),
                strict=True,
            ):  # fmt: skip
                if some.any():
                    kind.append((rank, here[some]))
        places = [np.concatenate([np.zeros(0, np.int64), *(at for _, at in kind)]).astype(np.int32) for kind in kinds]
        out, into = (np.zeros((len(at), 3), np.int64) for at in places[:2])
        sent, got = (np.zeros((len(at), _WORDS), np.int64) for at in places[2:])
        sums = comm.exchange(_parts(kinds[0], out), _parts(kinds[1], into), Tag.BOND)
        copies = comm.exchange(_parts(kinds[2], sent), _parts(kinds[3], got), Tag.BONDED)
        return cls(sums, copies, places[0], places[1], places[2], places[3], (out, into, sent, got))

    @property
    def alone(self) -> bool:
        """True if this rank needs no message."""
        return not (len(self.sends) or len(self.receives) or len(self.gives) or len(self.takes))

    def copy(self, x: Floats, v: Floats) -> None:
        """Copies ``x`` and ``v`` (n, 3) of the nodes that this rank does not have from the owners of these nodes."""
        out, into = self.buffers[2], self.buffers[3]
        out[:, :3], out[:, 3:] = x[self.gives].view(np.int64), v[self.gives].view(np.int64)
        self.copies.begin()
        self.copies.finish()
        x[self.takes], v[self.takes] = into[:, :3].copy().view(np.float64), into[:, 3:].copy().view(np.float64)

    def complete(self, words: Ints) -> None:
        """Adds the impulses of the rows of other ranks to the sums ``words`` (n, 3)."""
        self.buffers[0][:] = words[self.sends]
        self.sums.begin()
        self.sums.finish()
        np.add.at(words, self.receives, self.buffers[1])

    def free(self) -> None:
        """Frees the persistent MPI messages."""
        self.sums.free()
        self.copies.free()


def _parts(kind: list[tuple[int, Ints]], words: Ints) -> list[tuple[int, Ints]]:
    ends = np.cumsum([0, *(len(at) for _, at in kind)])
    return [(rank, words[a:b]) for (rank, _), a, b in zip(kind, ends[:-1], ends[1:], strict=True)]
