"""Update of a scene after a split, without a search.

The result of the last search stays valid while nodes separate: faces get the copies of their corners, and a copy
inherits the candidate pairs of its parent, on the same rank.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.state import Block, Flags, Indices, Ints, Nodes, extended
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour
from ..narrow_phase.cracks import Cracks, computed
from ..surface.records import SurfaceNodes
from . import ghosts, split_pairs
from .scene import Scene
from .split_pairs import Family
from .topology_updates import TopologyUpdate, meets


class SplitUpdate:
    """Update of one scene by a split."""

    def __init__(self, scene: Scene, here: SurfaceNodes, nodes: Nodes) -> None:
        """``here``: all nodes of this rank, by local index."""
        self._scene, self._here = scene, here
        self._nodes = nodes
        scene.own.grow(nodes.n)

    def places(self, ids: Ints) -> Indices:
        """Returns the slots of global ids, in the shape of ``ids``; -1 for a node without slot."""
        own = self._scene.own
        found = _located(ids.ravel(), self._nodes.id, own.place, own.far_ids, own.far)
        return np.asarray(found.reshape(ids.shape))

    def follow(self, update: TopologyUpdate, cracks: Cracks, blocks: list[Block], neighbours: list[Neighbour]) -> None:
        """Updates faces, edges, candidate pairs, and the slots of the cracks."""
        rows = split_pairs.touching(cracks.nodes, _flagged(self._nodes.id, update.rows.id))
        near, apart = cracks.beside(rows, blocks)
        rows = computed(rows, cracks.nodes, cracks.sides)
        self._join(update, neighbours)
        self._hold(_lacking(near, rows, cracks.nodes, self._scene.own.place))
        family = Family(*split_pairs.families(self.places(update.family), self._scene.surface_nodes.n))
        became = self.places(update.became)
        self._candidates(family)
        self._faces(update, became, family)
        self._edges(update, became, family)
        self._across(cracks, rows, apart)

    def _join(self, update: TopologyUpdate, neighbours: list[Neighbour]) -> None:
        """Adds the families of the scene's nodes and of nodes that other ranks hold to the scene, and updates the
        mobilities of all separated nodes.
        """
        local, have = self._nodes.places(update.family[:, 0]), self.places(update.family[:, 0]) >= 0
        for other in neighbours:
            _mark(have, local, other.nodes)
        rows, at = update.rows, self.places(update.rows.id)
        self._add(rows.take(_joining(rows.id, at, update.family, have)))
        at = self.places(rows.id)
        self._scene.surface_nodes.mobility[at[at >= 0]] = rows.mobility[at >= 0]

    def cracks(self, cracks: Cracks, blocks: list[Block]) -> None:
        """Finds the slots of all cracks that this rank computes."""
        every = np.arange(len(cracks.nodes))
        rows, (near, apart) = computed(every, cracks.nodes, cracks.sides), cracks.beside(every, blocks)
        cracks.places[:] = -1
        self._hold(_lacking(near, rows, cracks.nodes, self._scene.own.place))
        self._across(cracks, rows, apart)
        cracks.arrange()

    def _across(self, cracks: Cracks, rows: Ints, apart: Flags) -> None:
        """Finds the slots of some cracks. The separated nodes of the cracks, and the nodes that are ``apart`` (nodes,)
        from the tets, may get impulses.
        """
        scene = self._scene
        _place(cracks.places, scene.slots.pushes, rows, cracks.nodes, scene.own.place)
        scene.slots.pushes[scene.own.place[apart]] = True
        scene.cracks = cracks.places

    def settle(self, neighbours: list[Neighbour], comm: Comm) -> None:
        """Exchanges the lists of shared nodes with all ranks. Collective."""
        scene, nodes = self._scene, self._nodes
        if comm.size == 1:
            scene.connect([], nodes, comm)
            return
        used = np.sort(scene.surface_nodes.id[scene.slots.pushes])
        owners = scene.surface_nodes.owner[self.places(used)]
        shared = ghosts.members(used, owners, neighbours, nodes, comm)
        local = nodes.places(np.unique(np.concatenate([used[:0], *shared.values()])))
        self._hold(local[(local >= 0) & (scene.own.place[local] < 0)])
        scene.connect([Neighbour(rank, self.places(ids)) for rank, ids in sorted(shared.items())], nodes, comm)

    def share(self, update: TopologyUpdate, neighbours: list[Neighbour]) -> None:
        """Updates the lists of shared nodes without a message. A copy is shared by the ranks that share its parent,
        because the same ranks hold, send and use the copy and its parent. A separated node is shared by all ranks that
        hold the node, because contacts across the crack may apply impulses to the node.
        """
        messages, surface_nodes, nodes = self._scene.messages, self._scene.surface_nodes, self._nodes
        family = update.family[np.argsort(update.family[:, 1])]
        local, at = nodes.places(family), self.places(family)
        held, there = np.zeros(nodes.n, bool), np.zeros(surface_nodes.n, bool)
        company, none = {some.rank: some for some in messages.company.neighbours}, np.zeros(0, np.int32)
        for other in neighbours:
            some = company.get(other.rank, Neighbour(other.rank, none))
            parents = _newly_shared(family[:, 0], local[:, 0], at[:, 0], other.nodes, some.nodes, there)
            if len(parents):
                company[other.rank] = Neighbour(other.rank, extended(some.nodes, parents))
        self._scene.extend(
            [_heirs(some, at, there) for _, some in sorted(company.items())],
            [_heirs(some, local, held) for some in messages.copies.sends],
            [_heirs(some, at, there) for some in messages.copies.receives],
        )

    def _hold(self, local: Indices) -> None:
        """Adds local nodes that the scene lacks."""
        if len(local):
            self._add(self._here.take(local))

    def _add(self, rows: SurfaceNodes) -> None:
        scene = self._scene
        if not rows.n:
            return
        first = scene.surface_nodes.n
        scene.surface_nodes.append(rows)
        scene.slots.add(rows)
        scene.reference.add(rows.x, rows.course)
        scene.own.add(first, rows)

    def _faces(self, update: TopologyUpdate, became: Indices, family: Family) -> None:
        """Replaces the corners of faces by their copies, and adds pairs of a face with nodes that were its corners
        before.
        """
        faces, slots, surface_nodes = self._scene.faces, self._scene.slots, self._scene.surface_nodes
        near = faces.incidence.at(slots.root[family.pairs[:, 0]])
        rows, old = split_pairs.follow_faces(
            near, faces.corners, faces.fresh, faces.id, family.first, surface_nodes.id, update.key, became
        )  # fmt: skip
        if not len(rows):
            return
        pairs = np.empty((3 * len(rows) * (1 + family.most), 2), np.int32)
        searched = faces.live[rows] & self._meets(old[:, 0])
        n = split_pairs.apart_from_faces(
            pairs, rows, old, faces.corners[rows], family.first, family.member, slots.live, searched
        )  # fmt: skip
        self._add_pairs(pairs[:n])

    def _edges(self, update: TopologyUpdate, became: Indices, family: Family) -> None:
        """Removes edges whose faces have separated, and adds pairs of edges that had a common end before."""
        edges, surface_nodes = self._scene.edges, self._scene.surface_nodes
        near = edges.incidence.at(self._scene.slots.root[family.pairs[:, 0]])
        rows, old, gone = split_pairs.follow_edges(
            near, edges.corners, edges.fresh, edges.sides, family.first, surface_nodes.id, update.key, became
        )  # fmt: skip
        some = edges.live[rows] & ~gone & self._meets(old[:, 0])
        if some.any():
            rows, old = rows[some], old[some]
            order = np.lexsort(edges.sides[rows].T[::-1])
            rows, old = rows[order], old[order]
            found = split_pairs.apart_from_edges(old, edges.corners[rows], family.first, edges.own[rows])
            self._scene.edge_edge.add(rows[found].astype(np.int32))

    def _meets(self, places: Indices) -> Flags:
        """(n,) whether the bodies of the nodes ``places`` may be in contact with themselves."""
        return np.asarray(self._scene.rules.self_contact[self._scene.surface_nodes.part[places]])

    def _candidates(self, family: Family) -> None:
        """Copies candidate pairs, normals and flags of parents to their copies."""
        scene, (parent, copy) = self._scene, family.pairs.T
        scene.slots.inherit(copy, parent)
        scene.reference.inherit(copy, parent)
        self._add_pairs(
            split_pairs.inherited(family.pairs, scene.slots.first, scene.node_face.next, scene.node_face.rows)
        )

    def _add_pairs(self, pairs: Indices) -> None:
        """Adds node-face pairs."""
        if len(pairs):
            scene, n = self._scene, len(self._scene.node_face)
            scene.node_face.add(pairs)
            scene.node_face.hang(scene.slots.first, n)


def _heirs(some: Neighbour, family: Indices, flags: Flags) -> Neighbour:
    """Appends the copies of the nodes shared with a rank to the list of these nodes; ``family`` (c, 2): parents and
    copies, -1 for a node that is not present; ``flags``: working array, all false.
    """
    heirs = family[meets(flags, some.nodes, family), 1]
    return Neighbour(some.rank, extended(some.nodes, heirs)) if len(heirs) else some


@njit("boolean[::1](int64[::1], int64[::1])", cache=True)
def _flagged(ids, wanted):  # type: ignore[no-untyped-def]
    """(n + 1,) which of the ascending ``ids`` are ``wanted``; the last entry, for the index -1, is false."""
    flags = np.zeros(len(ids) + 1, np.bool_)
    for i in range(len(wanted)):
        at = np.searchsorted(ids, wanted[i])
        if at < len(ids) and ids[at] == wanted[i]:
            flags[at] = True
    return flags


@njit("void(boolean[::1], int32[::1], int32[::1])", cache=True)
def _mark(flags, some, others):  # type: ignore[no-untyped-def]
    """Sets the flag of each of ``some`` that is among the ascending ``others``."""
    for i in range(len(some)):
        at = np.searchsorted(others, some[i])
        if at < len(others) and others[at] == some[i]:
            flags[i] = True


@njit("int64[::1](int64[::1], int32[::1], int64[:, ::1], boolean[::1])", cache=True)
def _joining(ids, places, family, have):  # type: ignore[no-untyped-def]
    """Returns the rows of ``ids`` without a slot that belong to a ``family`` (c, 2) which must be in the scene,
    ``have``.
    """
    wanted = np.sort(family[have].reshape(-1))
    rows, n = np.empty(len(ids), np.int64), 0
    for i in range(len(ids)):
        at = np.searchsorted(wanted, ids[i])
        if places[i] < 0 and at < len(wanted) and wanted[at] == ids[i]:
            rows[n] = i
            n += 1
    return rows[:n].copy()


@njit("int32[::1](boolean[::1], int64[::1], int32[:, ::1], int32[::1])", cache=True)
def _lacking(near, rows, nodes, place):  # type: ignore[no-untyped-def]
    """Nodes, ascending, of the ``rows`` of cracks and of ``near`` (nodes,) that have no slot yet."""
    flags, n = near.copy(), 0
    for c in rows:
        for k in range(6):
            flags[nodes[c, k]] = True
    some = np.empty(len(flags), np.int32)
    for a in range(len(flags)):
        if flags[a] and place[a] < 0:
            some[n] = a
            n += 1
    return some[:n].copy()


@njit("void(int32[:, ::1], boolean[::1], int64[::1], int32[:, ::1], int32[::1])", cache=True)
def _place(places, pushes, rows, nodes, place):  # type: ignore[no-untyped-def]
    """Finds the slots of the nodes of the cracks ``rows``, and flags separated ones in ``pushes``."""
    for c in rows:
        for k in range(6):
            places[c, k] = place[nodes[c, k]]
            if nodes[c, k] != nodes[c, (k + 3) % 6]:
                pushes[places[c, k]] = True


@njit("int32[::1](int64[:], int32[:], int32[:], int32[::1], int32[::1], boolean[::1])", cache=True)
def _newly_shared(ids, local, places, holds, shares, flags):  # type: ignore[no-untyped-def]
    """Returns the slots, by ascending id, without duplicates, of the parents that a rank ``holds`` but does not yet
    ``share``; ``flags``: working array, all false. ``ids``, ``local`` and ``places``: of the parents.
    """
    some, n = np.empty(len(ids), np.int64), 0
    for i in range(len(ids)):
        at = np.searchsorted(holds, local[i])
        if local[i] >= 0 and at < len(holds) and holds[at] == local[i]:
            some[n] = i
            n += 1
    if n == 0:
        return np.empty(0, np.int32)
    flags[shares] = True
    found, m = np.empty(n, np.int64), 0
    for i in some[:n]:
        if not flags[places[i]]:
            flags[places[i]] = True
            found[m] = i
            m += 1
    flags[shares] = False
    fresh = np.empty(m, np.int64)
    for k in range(m):
        flags[places[found[k]]] = False
        fresh[k] = ids[found[k]]
    out = np.empty(m, np.int32)
    order = np.argsort(fresh)
    for k in range(m):
        out[k] = places[found[order[k]]]
    return out


@njit("int32[::1](int64[::1], int64[::1], int32[::1], int64[::1], int32[::1])", cache=True)
def _located(wanted, ids, place, far_ids, far):  # type: ignore[no-untyped-def]
    """(n,) slot of each node: from ``place`` for nodes among the ``ids`` of this rank, from ``far`` for other nodes, -1
    for a node without slot.
    """
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
