"""Redistribution of the state. All tets are divided again (a cut), parcels are sent from rank to rank, and the ranks
that have or own each node are found.

A box of the cut is assigned to the rank that already has most of its tets. The nodes of a tet are sent with the tet. A
distributed directory finds the ranks that share a node: the rank with the number id % ranks receives the list of ranks
that have the node, and sends this list to each of these ranks.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import ConoidError
from ..model.ids import among, located, unique
from ..model.state import Flags, Floats, Indices, Ints
from ..parallel.comm import Comm
from ..parallel.decompose import Cut, bisect, place
from ..parallel.ownership import Neighbour
from .parcel import Parcel, Table, joined, length, once, take

_NO_TET = np.iinfo(np.int64).max
"""Value that replaces the smallest tet id at a node, on a rank that has no tet at the node."""


@dataclass
class Directory:
    """Part of the distributed directory that is on this rank: the nodes for which id % ranks equals the number of this
    rank.
    """

    comm: Comm
    id: Ints
    """(n,) ids of the nodes of this part, ascending."""
    owner: Indices
    """(n,) owner of each node. The owner is the rank that has the tet of smallest id at the node."""

    def owners(self, ids: Ints) -> Indices:
        """Return (k,) the owners of the nodes ``ids``. Collective."""
        home = ids % self.comm.size
        asked = self.comm.swap({rank: ids[home == rank] for rank in range(self.comm.size)})
        answers = self.comm.swap({
            rank: self.owner[np.searchsorted(self.id, want)].astype(np.int64) for rank, want in asked.items()
        })  # fmt: skip
        found = np.zeros(len(ids), np.int32)
        for rank, answer in answers.items():
            found[home == rank] = answer
        return found


@dataclass
class Arrived:
    """A parcel after routing, with the holders and owners of its nodes."""

    parcel: Parcel
    owner: Indices
    """(nodes,) rank that owns each node of the parcel."""
    border: Flags
    """(nodes,) True if other ranks also have the node."""
    neighbours: list[Neighbour]
    moved: tuple[int, int]
    """Numbers of tets and nodes that this rank received from other ranks."""


def route(parcel: Parcel, scale: tuple[float, float, float], comm: Comm) -> Arrived:
    """Divide all tets among the ranks by their ``weight`` (n, 3) (Balance.weigh), and send all data to the new ranks.

    Collective. Before the cut, positions are multiplied by ``scale``.
    """
    places, cuts = _cut(parcel, np.array(scale), comm)
    home = _homes(places, comm)
    targets = {part: home[place] for part, place in places.items()}
    sends = {rank: _share(parcel, targets, (cuts, home), rank, np.array(scale)) for rank in range(comm.size)}
    mine = sends.pop(comm.rank)
    received = comm.swap({rank: share.packed() for rank, share in sends.items() if length(share.nodes)})
    others = [Parcel.unpacked(words) for words in received.values()]
    whole = Parcel.of([mine, *others])
    whole.known, whole.sums = parcel.known, parcel.sums
    whole.rows = {name: _one_of_each(name, rows) if "key" in rows else rows for name, rows in whole.rows.items()}
    moved = (sum(length(t) for p in others for t in p.tets.values()), length(whole.nodes) - length(mine.nodes))
    directory, neighbours, owner = _settle(whole, comm)
    _to_owners(parcel, whole, directory)
    border = np.zeros(length(whole.nodes), bool)
    for other in neighbours:
        border[other.nodes] = True
    return Arrived(whole, owner, border, neighbours, moved)


def _one_of_each(name: str, rows: Table) -> Table:
    """Return the rows by ascending key, each key once.

    Raises ConoidError if two rows with equal key differ, because the answer would depend on the choice of the row.
    """
    found = once(rows, rows["key"])
    at = np.searchsorted(found["key"], rows["key"])
    for column, values in rows.items():
        if column != "tet" and not np.array_equal(found[column][at], values, equal_nan=True):
            raise ConoidError(f"ranks disagree on {column} of {name}")
    return found


def _cut(parcel: Parcel, scale: Floats, comm: Comm) -> tuple[dict[int, Indices], list[Cut]]:
    """Return for each part the box of the cut in which each tet is. Also return the cuts. Collective."""
    nodes, points, ids, weights = parcel.nodes, [np.zeros((0, 3))], [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for table in parcel.tets.values():
        corners = located(nodes["id"], table["corners"])
        points.append(sum(nodes["x"][corner] for corner in corners.T) * (scale / 4.0))
        ids.append(table["id"])
        weights.append(table["weight"])
    owner, cuts = bisect(np.concatenate(points), np.concatenate(ids), np.concatenate(weights), comm.size, comm)
    ends = np.cumsum([len(i) for i in ids[1:]])[:-1]
    return dict(zip(parcel.tets, np.split(owner, ends), strict=True)) if parcel.tets else {}, cuts


def _homes(places: dict[int, Indices], comm: Comm) -> Indices:
    """Return (boxes,) the rank to which each box is assigned; it is the rank that has most of the tets of the box,
    among the ranks that have no box yet.

    Collective.
    """
    here = np.bincount(np.concatenate([np.zeros(0, np.int32), *places.values()]), minlength=comm.size)
    held = np.array(comm.share(here))
    home, free = np.full(comm.size, -1, np.int32), np.ones(comm.size, bool)
    some = np.argwhere(held)
    for rank, box in some[np.argsort(-held[tuple(some.T)], kind="stable")].tolist():
        if free[rank] and home[box] < 0:
            home[box], free[rank] = rank, False
    home[home < 0] = np.flatnonzero(free)
    return home


def _share(
    parcel: Parcel, targets: dict[int, Indices], boxes: tuple[list[Cut], Indices], rank: int, scale: Floats
) -> Parcel:  # fmt: skip
    """Return the data for ``rank``, without the tables that are sent to the owners of nodes. ``boxes``: the cuts, and
    the rank of each box.
    """
    cuts, home = boxes
    tets = {part: take(table, targets[part] == rank) for part, table in parcel.tets.items()}
    there = np.sort(np.concatenate([np.zeros(0, np.int64), *(table["id"] for table in tets.values())]))
    rows, needed = {}, [np.zeros(0, np.int64), *(table["corners"].reshape(-1) for table in tets.values())]
    corners = len(needed)
    for name, table in parcel.rows.items():
        if "tet" in table:
            rows[name] = take(table, among(there, table["tet"]))
        elif "at" in table:
            rows[name] = take(table, home[place(cuts, table["at"] * scale)] == rank)
        if name in rows and "with" in table:
            needed.append(rows[name]["with"].reshape(-1))
    wanted = unique(np.concatenate([*needed, _relatives(parcel.nodes, unique(np.concatenate(needed[:corners])))]))
    chosen = among(wanted, parcel.nodes["id"])
    for name, table in parcel.rows.items():
        if "of" in table:
            rows[name] = take(table, among(wanted, table["of"]))
    return Parcel(nodes=take(parcel.nodes, chosen), tets=tets, rows=rows)


def _relatives(nodes: Table, corners: Ints) -> Ints:
    """Return (k,) the nodes that belong to the families of the nodes ``corners``."""
    if "family" not in nodes or not len(corners):
        return corners[:0]
    families = unique(nodes["family"][among(corners, nodes["id"])])
    return np.asarray(nodes["id"][among(families, nodes["family"])])


def _settle(whole: Parcel, comm: Comm) -> tuple[Directory, list[Neighbour], Indices]:
    """Return the directory, the neighbours of this rank, and the owners of its nodes. Collective."""
    ids = whole.nodes["id"]
    smallest = np.full(len(ids), _NO_TET)
    for table in whole.tets.values():
        np.minimum.at(smallest, located(ids, table["corners"]), table["id"][:, None])
    home, words = ids % comm.size, np.column_stack([ids, smallest])
    answers = comm.swap({rank: words[home == rank] for rank in range(comm.size)})
    rows = [np.column_stack([w.reshape(-1, 2), np.full(len(w) // 2, rank)]) for rank, w in answers.items()]
    every = np.concatenate([np.zeros((0, 3), np.int64), *rows])
    every = every[np.lexsort((every[:, 2], every[:, 1], every[:, 0]))]
    first = np.r_[True, every[1:, 0] != every[:-1, 0]] if len(every) else np.zeros(0, bool)
    owners = every[first, 2]
    directory = Directory(comm, every[first, 0], owners.astype(np.int32))
    group = np.cumsum(first) - 1
    back = {rank: _sharing(every, group, owners, rank) for rank in answers}
    replies = comm.swap(back)
    shared = np.concatenate([np.zeros((0, 3), np.int64), *(w.reshape(-1, 3) for w in replies.values())])
    shared = shared[np.lexsort((shared[:, 0], shared[:, 1]))]
    owner = np.full(len(ids), comm.rank, np.int32)
    owner[np.searchsorted(ids, shared[:, 0])] = shared[:, 2]
    neighbours = [
        Neighbour(int(rank), np.searchsorted(ids, shared[shared[:, 1] == rank, 0]).astype(np.int32))
        for rank in np.unique(shared[:, 1])
    ]
    return directory, neighbours, owner


def _sharing(every: Ints, group: Ints, owners: Ints, rank: int) -> Ints:
    """Return (k, 3) node, other rank and owner, for each node that ``rank`` shares with another rank; ``group``: number
    of the node of each row.
    """
    held = np.zeros(len(owners), bool)
    held[group[every[:, 2] == rank]] = True
    rows = held[group] & (every[:, 2] != rank)
    return np.column_stack([every[rows, 0], every[rows, 2], owners[group[rows]]])


def _to_owners(parcel: Parcel, whole: Parcel, directory: Directory) -> None:
    """Send the tables that go to the owners of their nodes. Collective."""
    comm, names = directory.comm, sorted(name for name, table in parcel.rows.items() if "node" in table)
    owners = {name: directory.owners(parcel.rows[name]["node"]) for name in names}
    sends = {}
    for rank in range(comm.size):
        sends[rank] = Parcel(rows={name: take(parcel.rows[name], owners[name] == rank) for name in names})
    answers = [Parcel.unpacked(words) for words in comm.swap({r: p.packed() for r, p in sends.items()}).values()]
    for name in names:
        whole.rows[name] = joined([p.rows[name] for p in answers])
