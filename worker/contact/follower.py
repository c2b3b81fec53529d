"""A scene that follows nodes as they separate, until the next search.

What the last search has found stays good while nodes separate: faces take up the copies of their corners, and a copy
has the candidates of the node that it was part of, with the rank that computes that one's.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..state import Flags, Indices, Ints, Nodes, among, extended
from ..topology import Split, keys
from . import ghosts
from .cracks import Cracks, touching
from .records import Crowd
from .scene import Scene


@dataclass
class News:
    """What a rank knows of a split: round every node that it holds or has a copy of."""

    key: Ints
    """(r,) ids of a node and of a tet as one number, ascending."""
    became: Ints
    """(r,) id of the copy that the node of that tet has become."""
    parent: Ints
    """(c,) ids of the parents of all copies, ascending."""
    copy: Ints
    """(c,) ids of the copies."""
    rows: Crowd
    """Parents and copies."""


def news(split: Split, scene: Scene, here: Crowd, comm: Comm) -> News | None:
    """None where there is none; all ranks take part. ``here``: every node of this rank, by local index. Of nodes that
    it does not hold, a rank hears from the one that sends it their state.
    """
    if not split.copies.n and not (heard := comm.swap({})):
        return None
    parents, copies = split.copies.parents, split.first + np.arange(split.copies.n)
    table = np.column_stack([split.key, here.id[split.node]])
    family = np.column_stack([here.id[parents], here.id[copies]])
    rows = here.take(np.unique(np.concatenate([parents, copies])))
    if split.copies.n:
        told, flags = {}, np.zeros(here.n, bool)
        for other in scene.copies.sends:
            flags[other.nodes] = True
            for_it = flags[parents]
            flags[other.nodes] = False
            if for_it.any():
                some = np.unique(np.concatenate([parents[for_it], copies[for_it]]))
                round_it = table[for_it[split.node - split.first]]
                packed = ghosts.pack_crowd(here.take(some))
                lengths = np.array([len(round_it), int(for_it.sum())])
                told[other.rank] = np.concatenate([
                    lengths, round_it.reshape(-1), family[for_it].reshape(-1), packed.reshape(-1)
                ])  # fmt: skip
        heard = comm.swap(told)
    if heard:
        for words in heard.values():
            ends = 2 + 2 * np.cumsum(words[:2])
            table = np.concatenate([table, words[2 : ends[0]].reshape(-1, 2)])
            family = np.concatenate([family, words[ends[0] : ends[1]].reshape(-1, 2)])
            rows = Crowd.joined([rows, ghosts.unpack_crowd(words[ends[1] :])])
        table, family = table[np.argsort(table[:, 0])], family[np.lexsort((family[:, 1], family[:, 0]))]
    return News(table[:, 0].copy(), table[:, 1].copy(), family[:, 0].copy(), family[:, 1].copy(), rows)


@dataclass
class Family:
    """Nodes that separate, and what comes out of them."""

    first: Indices
    """(crowd,) row of ``member`` where the copies of a node begin, -1 for one that has none."""
    member: Indices
    """(c, 2) place of each copy, and whether it is its parent's last."""
    most: int
    """Largest number of copies of a node."""


class Follower:
    """Brings one scene up to date with a split."""

    def __init__(self, scene: Scene, here: Crowd, nodes: Nodes) -> None:
        """``here``: every node of this rank, by local index."""
        self._scene, self._here = scene, here
        self._nodes = nodes
        if len(scene.place) < nodes.n:
            scene.place = extended(scene.place, np.full(nodes.n - len(scene.place), -1, np.int32))
        self._sort()

    def places(self, ids: Ints) -> Indices:
        """Where ids stand in the crowd, in their shape, -1 where they do not."""
        far, far_ids = self._far
        found = _located(ids.ravel(), self._nodes.id, self._scene.place, far_ids, far)
        return np.asarray(found.reshape(ids.shape))

    def _sort(self) -> None:
        """Places and ids, ascending, of the nodes of the crowd that this rank does not hold."""
        crowd = self._scene.crowd
        far = np.flatnonzero(crowd.local < 0)
        far = far[np.argsort(crowd.id[far])]
        self._far = far, crowd.id[far]

    def follow(self, heard: News, cracks: Cracks, neighbours: list[Neighbour]) -> None:
        """Faces, edges and candidates after the split, and the places of the cracks."""
        scene = self._scene
        have = self.places(heard.parent) >= 0
        for other in neighbours:
            have |= _flagged(other.nodes, self._nodes.n)[self._nodes.places(heard.parent)]
        families = np.sort(np.concatenate([heard.parent[have], heard.copy[have]]))
        self._add(heard.rows.take(among(families, heard.rows.id)))
        at = self.places(heard.rows.id)
        scene.crowd.mobility[at[at >= 0]] = heard.rows.mobility[at >= 0]
        parents = np.zeros(scene.crowd.n, bool)
        at = self.places(heard.parent)
        parents[at[at >= 0]] = True
        self._candidates(heard, parents)
        family = self._family(heard)
        self._faces(heard, parents, family)
        self._edges(heard, parents, family)
        self.cracks(cracks)

    def _family(self, heard: News) -> "Family":
        """The copies of every node of the crowd."""
        parent, copy = self.places(heard.parent), self.places(heard.copy)
        both = (parent >= 0) & (copy >= 0)
        parent, copy = parent[both], copy[both]
        first = np.full(self._scene.crowd.n, -1, np.int32)
        begin = np.flatnonzero(np.r_[True, parent[1:] != parent[:-1]]) if len(parent) else np.zeros(0, np.int64)
        count = np.diff(np.r_[begin, len(parent)])
        first[parent[begin]] = begin
        last = np.zeros(len(parent), bool)
        last[begin + count - 1] = True
        return Family(first, np.column_stack([copy, last]).astype(np.int32), int(count.max(initial=0)))

    def cracks(self, cracks: Cracks) -> None:
        """The places of the cracks that this rank computes, and room for all that may meet."""
        scene = self._scene
        while True:
            places, absent = np.empty(cracks.nodes.shape, np.int32), np.empty(cracks.nodes.size, np.int32)
            rows = np.empty(len(cracks.nodes), np.int64)
            n, lacking = _places(places, rows, absent, scene.pushes, cracks.nodes, cracks.sides, scene.place)
            if not lacking:
                break
            self._add(self._here.take(np.unique(absent[:lacking])))
        scene.cracks, scene.crack_rows = places[:n], rows[:n]

    def settle(self, neighbours: list[Neighbour], comm: Comm) -> None:
        """Asks all ranks who shares which node; all take part."""
        scene, nodes = self._scene, self._nodes
        if comm.size == 1:
            scene.connect([], nodes, comm)
            return
        used = np.sort(scene.crowd.id[scene.pushes])
        owners = scene.crowd.owner[self.places(used)]
        shared = ghosts.members(used, owners, neighbours, nodes, comm)
        self._hold(np.unique(np.concatenate([used[:0], *shared.values()])))
        scene.connect([Neighbour(rank, self.places(ids)) for rank, ids in sorted(shared.items())], nodes, comm)

    def share(self, heard: News, neighbours: list[Neighbour], comm: Comm) -> None:
        """Follows who shares which node. Nobody has to be asked: who shares a node shares its copies, since they are
        held, pushed and sent by the same ranks as it; and a node that separates is shared by all that hold it, since it
        may be pushed across the crack.
        """
        scene = self._scene
        order = np.argsort(heard.copy)
        family = np.column_stack([heard.parent, heard.copy])[order]
        local, at = self._nodes.places(family), self.places(family)
        company, none = {some.rank: some for some in scene.company}, np.zeros(0, np.int32)
        for other in neighbours:
            shared = _flagged(other.nodes, self._nodes.n)[local[:, 0]]
            some = company.get(other.rank, Neighbour(other.rank, none))
            fresh = shared & ~_flagged(some.nodes, scene.crowd.n)[at[:, 0]]
            if fresh.any():
                parents = self.places(np.unique(family[fresh, 0]))
                company[other.rank] = Neighbour(other.rank, extended(some.nodes, parents))
        scene.extend(
            [_heirs(some, at, scene.crowd.n) for _, some in sorted(company.items())],
            [_heirs(some, local, self._nodes.n) for some in scene.copies.sends],
            [_heirs(some, at, scene.crowd.n) for some in scene.copies.receives], comm,
        )  # fmt: skip

    def _hold(self, ids: Ints) -> None:
        """Adds those of this rank's nodes that the crowd lacks."""
        local = self._nodes.places(ids)
        self._add(self._here.take(local[local >= 0]))

    def _add(self, rows: Crowd) -> None:
        scene = self._scene
        rows = rows.take(self.places(rows.id) < 0)
        if not rows.n:
            return
        first, n = scene.crowd.n, rows.n
        scene.crowd = Crowd(*(extended(a, b) for a, b in zip(scene.crowd.columns(), rows.columns(), strict=True)))
        held = np.flatnonzero(rows.local >= 0).astype(np.int32)
        scene.held = extended(scene.held, first + held)
        scene.local = extended(scene.local, rows.local[held])
        scene.place[rows.local[held]] = first + held
        for name, width in (("shares", 4), ("impulse", 3), ("total", 3)):
            setattr(scene, name, extended(getattr(scene, name), np.zeros((n, width), np.int64)))
        scene.normals = extended(scene.normals, np.zeros((n, 9)))
        scene.before = extended(scene.before, rows.v)
        for name in (
            "pushes", "shared", "slave", "on_surface", "moved", "node_live", "node_new", "node_fresh", "tracked",
        ):  # fmt: skip
            setattr(scene, name, extended(getattr(scene, name), np.zeros(n, bool)))
        scene.first = extended(scene.first, np.full(n, -1, np.int32))
        scene.tracks.add(rows.x, rows.course)
        if (rows.local < 0).any():
            self._sort()

    def _followed(self, heard: News, places: Indices, tets: Ints) -> Indices:
        """What nodes at ``places`` (n, k) of tets (n,) have become."""
        if not len(heard.key):
            return places
        wanted = keys(self._scene.crowd.id[places], tets[:, None])
        at = np.minimum(np.searchsorted(heard.key, wanted), len(heard.key) - 1)
        now = heard.key[at] == wanted
        out = places.copy()
        out[now] = self.places(heard.became[at[now]])
        return out

    def _faces(self, heard: News, parents: Flags, family: Family) -> None:
        """Faces take up the copies of their corners; a node meets those that have just left it, too."""
        scene = self._scene
        rows = touching(scene.faces, parents)
        old = scene.faces[rows]
        now = self._followed(heard, old, scene.face_id[rows] // 4)
        scene.faces[rows], scene.face_fresh[rows] = now, True
        pairs = np.empty((3 * len(rows) * (1 + family.most), 2), np.int32)
        searched = scene.face_live[rows] & self._meets(old[:, 0])
        n = _apart_from_faces(pairs, rows, old, now, family.first, family.member, scene.node_live, searched)
        self._add_pairs(pairs[:n])

    def _edges(self, heard: News, parents: Flags, family: Family) -> None:
        """An edge goes when its two faces have separated there; it meets those that have left its ends."""
        scene = self._scene
        rows = touching(scene.edges, parents)
        nodes, sides = scene.edges[rows], scene.edge_sides[rows]
        one = self._followed(heard, nodes[:, [0, 1, 2]], sides[:, 0] // 4)
        two = self._followed(heard, nodes[:, [0, 1, 3]], sides[:, 1] // 4)
        now = np.column_stack([one, two[:, 2]]).astype(np.int32)
        gone = (one[:, :2] != two[:, :2]).any(axis=1)
        now[gone] = now[gone][:, [0, 0, 0, 0]]
        scene.edges[rows], scene.edge_fresh[rows] = now, True
        order = np.lexsort((sides[:, 1], sides[:, 0]))
        order = order[(scene.edge_live[rows] & ~gone)[order] & self._meets(nodes[order, 0])]
        ends = nodes[order, :2]
        at = np.argsort(ends.reshape(-1), kind="stable")
        at = at[family.first[ends.reshape(-1)[at]] >= 0]
        found = _apart_from_edges(at, ends, now[order], scene.edge_own[rows[order]])
        scene.edge_edge.add(rows[order][found].astype(np.int32))

    def _meets(self, places: Indices) -> Flags:
        """(n,) whether the parts of nodes at ``places`` meet themselves."""
        return np.asarray(self._scene.rules.allowed.diagonal()[self._scene.crowd.part[places]])

    def _candidates(self, heard: News, parents: Flags) -> None:
        """A copy has the candidates and the normals of its parent, and is pushed by the ranks that push that one."""
        scene = self._scene
        family = np.column_stack([self.places(heard.parent), self.places(heard.copy)])
        parent, copies = family[(family >= 0).all(axis=1)].T
        for name in ("normals", "slave", "on_surface", "pushes", "node_live", "node_new", "tracked"):
            column = getattr(scene, name)
            column[copies] = column[parent]
        scene.tracks.inherit(copies, parent)
        pairs = scene.node_face.rows
        rows = np.flatnonzero(parents[pairs[:, 0]])
        ids = scene.crowd.id[pairs[rows, 0]]
        begin, end = np.searchsorted(heard.parent, ids), np.searchsorted(heard.parent, ids, side="right")
        many = end - begin
        which = np.repeat(np.arange(len(rows)), many)
        copy = heard.copy[np.repeat(begin - np.cumsum(many) + many, many) + np.arange(many.sum())]
        self._add_pairs(np.column_stack([self.places(copy), pairs[rows[which], 1]]))

    def _add_pairs(self, pairs: Indices) -> None:
        """More candidates of nodes and faces."""
        scene, n = self._scene, len(self._scene.node_face)
        scene.node_face.add(pairs.astype(np.int32))
        scene.node_face.hang(scene.first, n)


def _flagged(some: Indices, n: int) -> Flags:
    """(n + 1,) which of n are among ``some``; the last stands for what is not there, -1."""
    flags = np.zeros(n + 1, bool)
    flags[some] = True
    return flags


def _heirs(some: Neighbour, family: Indices, n: int) -> Neighbour:
    """Nodes shared with a rank, and behind them their copies: ``family`` (c, 2) parents and copies, out of ``n``."""
    return Neighbour(some.rank, extended(some.nodes, family[_flagged(some.nodes, n)[family[:, 0]], 1]))


@njit("int32[::1](int64[::1], int64[::1], int32[::1], int64[::1], int64[::1])", cache=True)
def _located(wanted, ids, place, far_ids, far):  # type: ignore[no-untyped-def]
    """(n,) the ``place`` of those that are among the ``ids`` of this rank, ``far`` of the others, -1 for no place."""
    found = np.empty(len(wanted), np.int32)
    for i in range(len(wanted)):
        found[i] = -1
        at = np.searchsorted(ids, wanted[i])
        if at < len(ids) and ids[at] == wanted[i]:
            found[i] = place[at]
        if found[i] >= 0:
            continue
        at = np.searchsorted(far_ids, wanted[i])
        if at < len(far_ids) and far_ids[at] == wanted[i]:
            found[i] = far[at]
    return found


@njit(
    "UniTuple(int64, 2)(int32[:, ::1], int64[::1], int32[::1], boolean[::1], int32[:, ::1], int32[:, :, ::1], "
    "int32[::1])",
    cache=True,
)
def _places(out, rows, absent, pushes, nodes, sides, place):  # type: ignore[no-untyped-def]
    """The places, in ``out`` (m, 6), of the ``nodes`` (m, 6) of the cracks, ``rows``, that have nodes that have
    separated, and the first side here: this rank computes them. Nodes that have separated may be pushed.

    Returns how many cracks and how many nodes that have no place; these are in ``absent``.
    """
    n, lacking = 0, 0
    for c in range(len(nodes)):
        if sides[c, 0, 1] < 0:
            continue
        if nodes[c, 0] == nodes[c, 3] and nodes[c, 1] == nodes[c, 4] and nodes[c, 2] == nodes[c, 5]:
            continue
        for k in range(6):
            at = place[nodes[c, k]]
            out[n, k] = at
            if at < 0:
                absent[lacking] = nodes[c, k]
                lacking += 1
            elif nodes[c, k] != nodes[c, (k + 3) % 6]:
                pushes[at] = True
        rows[n] = c
        n += 1
    return n, lacking


@njit(
    "int64(int32[:, ::1], int64[::1], int32[:, ::1], int32[:, ::1], int32[::1], int32[:, ::1], boolean[::1], "
    "boolean[::1])",
    cache=True,
)
def _apart_from_faces(pairs, rows, old, now, first, member, slave, meets):  # type: ignore[no-untyped-def]
    """Pairs of nodes and faces, of ``rows``, that had a corner in common before the split, and have none now.

    ``old`` and ``now`` (r, 4): their corners; ``first`` and ``member``: Family; returns how many there are.
    """
    n = 0
    for r in range(len(rows)):
        for k in range(3):
            node = old[r, k]
            if first[node] < 0 or not slave[node] or not meets[r]:
                continue
            at, end = first[node], False
            while True:
                if node != now[r, 0] and node != now[r, 1] and node != now[r, 2]:
                    pairs[n, 0], pairs[n, 1] = node, rows[r]
                    n += 1
                if end:
                    break
                node, end = member[at, 0], member[at, 1] != 0
                at += 1
    return n


@njit("int64[:, ::1](int64[::1], int32[:, ::1], int32[:, ::1], boolean[::1])", cache=True)
def _apart_from_edges(order, old, now, own):  # type: ignore[no-untyped-def]
    """(p, 2) pairs of edges that had an end in common before the split and have none now, where the one of smaller
    faces, the first, is this rank's own.

    ``old`` and ``now`` (e, 2 and 4): their nodes; ``order``: of the ends, flat, by node.
    """
    ends, many = old.reshape(-1), 0
    for write in range(2):
        if write:
            pairs = np.empty((many, 2), np.int64)
        many, i = 0, 0
        while i < len(order):
            j = i
            while j < len(order) and ends[order[j]] == ends[order[i]]:
                j += 1
            for a in range(i, j):
                for b in range(i, j):
                    one, two = order[a] // 2, order[b] // 2
                    if one >= two or not own[one]:
                        continue
                    common = False
                    for k in range(2):
                        common |= now[one, k] == now[two, 0] or now[one, k] == now[two, 1]
                    both = old[one, 0] == old[two, 0] and old[one, 1] == old[two, 1]
                    if common or (both and ends[order[i]] != old[one, 0]):
                        continue
                    if write:
                        pairs[many, 0], pairs[many, 1] = one, two
                    many += 1
            i = j
    return pairs
