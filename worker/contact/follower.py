"""A scene that follows nodes as they separate, until the next search.

What the last search has found stays good while nodes separate: faces take up the copies of their corners, and a copy
has the candidates of the node that it was part of, with the rank that computes that one's.
"""

import numpy as np

from ..ids import among
from ..jit import njit
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..state import Block, Flags, Indices, Ints, Nodes, extended
from ..topology import keys
from . import ghosts
from .cracks import Cracks, computed, touching
from .kin import Family, apart_from_edges, apart_from_faces, inherited
from .news import News
from .records import Crowd, merged
from .scene import Scene


class Follower:
    """Brings one scene up to date with a split."""

    def __init__(self, scene: Scene, here: Crowd, nodes: Nodes) -> None:
        """``here``: every node of this rank, by local index."""
        self._scene, self._here = scene, here
        self._nodes = nodes
        if len(scene.own.place) < nodes.n:
            scene.own.place = extended(scene.own.place, np.full(nodes.n - len(scene.own.place), -1, np.int32))
        self._sort()

    def places(self, ids: Ints) -> Indices:
        """Where ids stand in the crowd, in their shape, -1 where they do not."""
        far, far_ids = self._far
        found = _located(ids.ravel(), self._nodes.id, self._scene.own.place, far_ids, far)
        return np.asarray(found.reshape(ids.shape))

    def _sort(self) -> None:
        """Places and ids, ascending, of the nodes of the crowd that this rank does not hold."""
        crowd = self._scene.crowd
        far = np.flatnonzero(crowd.local < 0)
        far = far[np.argsort(crowd.id[far])]
        self._far = far, crowd.id[far]

    def follow(self, heard: News, cracks: Cracks, blocks: list[Block], neighbours: list[Neighbour]) -> None:
        """Faces, edges and candidates after the split, and the places of the cracks."""
        rows = touching(cracks.nodes, _flagged(self._nodes.places(heard.rows.id), self._nodes.n))
        near, apart = cracks.beside(rows, blocks)
        rows = computed(rows, cracks.nodes, cracks.sides)
        self._join(heard, self._lacking(cracks, rows, near), neighbours)
        n, pairs = self._scene.crowd.n, np.column_stack([self.places(heard.parent), self.places(heard.copy)])
        parents, family = _flagged(pairs[:, 0], n), Family.of(pairs[(pairs >= 0).all(axis=1)], n)
        self._candidates(family)
        self._faces(heard, parents, family)
        self._edges(heard, parents, family)
        self._across(cracks, rows, apart)

    def _join(self, heard: News, lacking: Indices, neighbours: list[Neighbour]) -> None:
        """Takes the families of the crowd's nodes and of those that other ranks hold into the crowd, and the nodes of
        this rank that are ``lacking``; and the masses of all that have separated.
        """
        have, local = self.places(heard.parent) >= 0, self._nodes.places(heard.parent)
        for other in neighbours:
            have |= _flagged(other.nodes, self._nodes.n)[local]
        families = np.sort(np.concatenate([heard.parent[have], heard.copy[have]]))
        self._add(merged([heard.rows.take(among(families, heard.rows.id)), self._here.take(lacking)]))
        at = self.places(heard.rows.id)
        self._scene.crowd.mobility[at[at >= 0]] = heard.rows.mobility[at >= 0]

    def cracks(self, cracks: Cracks, blocks: list[Block]) -> None:
        """The places of all cracks that this rank computes."""
        every = np.arange(len(cracks.nodes))
        rows, (near, apart) = computed(every, cracks.nodes, cracks.sides), cracks.beside(every, blocks)
        cracks.places[:] = -1
        self._add(self._here.take(self._lacking(cracks, rows, near)))
        self._across(cracks, rows, apart)
        cracks.arrange()

    def _lacking(self, cracks: Cracks, rows: Ints, near: Flags) -> Indices:
        """Which nodes of some of the cracks, and of those ``near`` (nodes,), ascending, are not in the crowd yet."""
        lacking = near.copy()
        lacking[cracks.nodes[rows]] = True
        return np.flatnonzero(lacking & (self._scene.own.place < 0)).astype(np.int32)

    def _across(self, cracks: Cracks, rows: Ints, apart: Flags) -> None:
        """Places some of the cracks. Their nodes that have separated, and those that are ``apart`` (nodes,) of the
        tets, may be pushed.
        """
        scene, nodes = self._scene, cracks.nodes[rows]
        places = cracks.places[rows] = scene.own.place[nodes]
        scene.slots.pushes[places[nodes != nodes[:, [3, 4, 5, 0, 1, 2]]]] = True
        scene.slots.pushes[scene.own.place[apart]] = True
        scene.cracks = cracks.places

    def settle(self, neighbours: list[Neighbour], comm: Comm) -> None:
        """Asks all ranks who shares which node; all take part."""
        scene, nodes = self._scene, self._nodes
        if comm.size == 1:
            scene.connect([], nodes, comm)
            return
        used = np.sort(scene.crowd.id[scene.slots.pushes])
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
        company, none = {some.rank: some for some in scene.messages.company.neighbours}, np.zeros(0, np.int32)
        for other in neighbours:
            shared = _flagged(other.nodes, self._nodes.n)[local[:, 0]]
            some = company.get(other.rank, Neighbour(other.rank, none))
            fresh = shared & ~_flagged(some.nodes, scene.crowd.n)[at[:, 0]]
            if fresh.any():
                parents = self.places(np.unique(family[fresh, 0]))
                company[other.rank] = Neighbour(other.rank, extended(some.nodes, parents))
        scene.extend(
            [_heirs(some, at, scene.crowd.n) for _, some in sorted(company.items())],
            [_heirs(some, local, self._nodes.n) for some in scene.messages.copies.sends],
            [_heirs(some, at, scene.crowd.n) for some in scene.messages.copies.receives], comm,
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
        first = scene.crowd.n
        scene.crowd = Crowd(*(extended(a, b) for a, b in zip(scene.crowd.columns(), rows.columns(), strict=True)))
        held = np.flatnonzero(rows.local >= 0).astype(np.int32)
        scene.own.slots = extended(scene.own.slots, first + held)
        scene.own.local = extended(scene.own.local, rows.local[held])
        scene.own.place[rows.local[held]] = first + held
        scene.slots.add(rows)
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
        rows = touching(scene.faces.corners, parents)
        old = scene.faces.corners[rows]
        now = self._followed(heard, old, scene.faces.id[rows] // 4)
        scene.faces.corners[rows], scene.faces.fresh[rows] = now, True
        pairs = np.empty((3 * len(rows) * (1 + family.most), 2), np.int32)
        searched = scene.faces.live[rows] & self._meets(old[:, 0])
        n = apart_from_faces(pairs, rows, old, now, family.first, family.member, scene.slots.live, searched)
        self._add_pairs(pairs[:n])

    def _edges(self, heard: News, parents: Flags, family: Family) -> None:
        """An edge goes when its two faces have separated there; it meets those that have left its ends."""
        scene = self._scene
        rows = touching(scene.edges.corners, parents)
        nodes, sides = scene.edges.corners[rows], scene.edges.sides[rows]
        one = self._followed(heard, nodes[:, [0, 1, 2]], sides[:, 0] // 4)
        two = self._followed(heard, nodes[:, [0, 1, 3]], sides[:, 1] // 4)
        now = np.column_stack([one, two[:, 2]]).astype(np.int32)
        gone = (one[:, :2] != two[:, :2]).any(axis=1)
        now[gone] = now[gone][:, [0, 0, 0, 0]]
        scene.edges.corners[rows], scene.edges.fresh[rows] = now, True
        order = np.lexsort((sides[:, 1], sides[:, 0]))
        order = order[(scene.edges.live[rows] & ~gone)[order] & self._meets(nodes[order, 0])]
        ends = nodes[order, :2]
        at = np.argsort(ends.reshape(-1), kind="stable")
        at = at[family.first[ends.reshape(-1)[at]] >= 0]
        found = apart_from_edges(at, ends, now[order], scene.edges.own[rows[order]])
        scene.edge_edge.add(rows[order][found].astype(np.int32))

    def _meets(self, places: Indices) -> Flags:
        """(n,) whether the parts of nodes at ``places`` meet themselves."""
        return np.asarray(self._scene.rules.allowed.diagonal()[self._scene.crowd.part[places]])

    def _candidates(self, family: Family) -> None:
        """A copy has the candidates and the normals of its parent, and is pushed by the ranks that push that one."""
        scene, (parent, copy) = self._scene, family.pairs.T
        scene.slots.inherit(copy, parent)
        scene.tracks.inherit(copy, parent)
        self._add_pairs(inherited(family.pairs, scene.slots.first, scene.node_face.next, scene.node_face.rows))

    def _add_pairs(self, pairs: Indices) -> None:
        """More candidates of nodes and faces."""
        scene, n = self._scene, len(self._scene.node_face)
        scene.node_face.add(pairs.astype(np.int32))
        scene.node_face.hang(scene.slots.first, n)


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
