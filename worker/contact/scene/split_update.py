"""Update of a scene after a node separation (split), without a search.

The result of the last search stays valid while nodes separate: faces get the copies of their corners, and a copy gets
the candidate pairs of its parent, on the same rank.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.growing import extended
from ...model.state import Block, Flags, Indices, Ints, Nodes
from ...model.topology import Split
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour
from ..narrow_phase.cracks import Cracks
from ..surface.records import SurfaceNodes
from . import ghosts, split_pairs
from .scene import Scene
from .split_pairs import Family
from .topology_updates import SplitOfGhosts, meets


class SplitUpdate:
    """Update of one scene by a node separation."""

    def __init__(self, scene: Scene, here: SurfaceNodes, nodes: Nodes) -> None:
        """``here``: all nodes of this rank, by local index."""
        self._scene, self._here = scene, here
        self._nodes = nodes

    def places(self, ids: Ints) -> Indices:
        """Returns the slots of global ``ids``, in the shape of ``ids``; -1 for a node without slot."""
        own = self._scene.own
        found = _located(ids.ravel(), self._nodes.id, own.place, own.far_ids, own.far)
        return np.asarray(found.reshape(ids.shape))

    def follow(
        self, split: Split, received: SplitOfGhosts | None, cracks: Cracks, rows: Ints, blocks: list[Block],
        neighbours: list[Neighbour],
    ) -> None:  # fmt: skip
        """Updates slots, faces, edges, candidate pairs, and the slots of the cracks. ``rows``: rows of the cracks at
        separated nodes.
        """
        near, family = cracks.beside(rows, blocks), split.family
        self._join(near, family, neighbours)
        place = self._scene.own.place
        pairs, key, became = place[family], split.key, place[split.node]
        if received is not None:
            self._join_ghosts(received)
            pairs = np.concatenate([pairs, self.places(received.family)])
            key, became = np.append(key, received.key), np.append(became, self.places(received.became))
            order = np.argsort(key)
            key, became = key[order], became[order]
        self._tear(Family(*split_pairs.families(pairs, self._scene.surface_nodes.n)), key, became)
        self._across(cracks, rows, near)

    def _join(self, near: Indices, family: Indices, neighbours: list[Neighbour]) -> None:
        """Adds nodes to the scene: the local nodes ``near``, and all nodes of a family if one of them is in the scene
        or on another rank that uses it. Updates the mobilities and parts of all separated nodes.
        """
        scene, here = self._scene, self._here
        have = np.zeros(len(family), bool)
        for other in neighbours:
            _mark(have, np.ascontiguousarray(family[:, 0]), other.nodes)
        lacking = _lacking(near, family, have, scene.own.place)
        if len(lacking):
            scene.add_slots(here.take(lacking))
        held = family[scene.own.place[family] >= 0]
        scene.surface_nodes.renew(scene.own.place[held], here, held)

    def _join_ghosts(self, received: SplitOfGhosts) -> None:
        """Adds the families of ghosts to the scene; updates the mobilities of separated ghosts."""
        have, rows = self.places(received.family[:, 0]) >= 0, received.rows
        new = rows.take(_joining(rows.id, self.places(rows.id), received.family, have))
        if new.n:
            self._scene.add_slots(new)
        at = self.places(rows.id)
        self._scene.surface_nodes.renew(at[at >= 0], rows, np.flatnonzero(at >= 0))

    def cracks(self, cracks: Cracks, blocks: list[Block]) -> None:
        """Finds the slots of the nodes of all cracks that this rank computes."""
        every = np.arange(len(cracks.nodes))
        near = cracks.beside(every, blocks)
        cracks.places[:] = -1
        self._join(near, np.zeros((0, 2), np.int32), [])
        self._across(cracks, every, near)
        cracks.arrange()

    def _across(self, cracks: Cracks, rows: Ints, near: Indices) -> None:
        """Finds the slots of the nodes of those cracks ``rows`` that this rank computes; marks the separated nodes of
        these cracks, and the separated nodes among ``near``, as nodes that may get impulses.
        """
        scene = self._scene
        _place(cracks.places, scene.slots.pushes, rows, cracks.nodes, cracks.sides, scene.own.place)
        _push(scene.slots.pushes, near, cracks.families.ring, scene.own.place)
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
        self._join(local[local >= 0], np.zeros((0, 2), np.int32), [])
        scene.connect([Neighbour(rank, self.places(ids)) for rank, ids in sorted(shared.items())], nodes, comm)

    def share(self, split: Split, received: SplitOfGhosts | None, neighbours: list[Neighbour]) -> None:
        """Updates the lists of shared nodes without a message. A copy is shared by the ranks that share its parent,
        because the same ranks have, send and use the copy and its parent. A separated node is shared by all ranks that
        have the node, because contacts across the crack may apply impulses to it.
        """
        messages, surface_nodes, nodes = self._scene.messages, self._scene.surface_nodes, self._nodes
        family = nodes.id[split.family]
        if received is not None:
            family = np.concatenate([family, received.family])
        family = family[np.argsort(family[:, 1])]
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

    def _tear(self, family: Family, key: Ints, became: Indices) -> None:
        """Replaces the corners of faces and edges by their copies, and removes edges whose faces have separated. Adds
        pairs: a copy gets the pairs of its parent; a face is paired with its former corners; an edge is paired with the
        edges with which it had a common end. ``key``: column of Split; ``became``: slots of the copies.
        """
        scene, parents = self._scene, family.pairs[:, 0]
        faces, edges, slots, of = scene.faces, scene.edges, scene.slots, scene.surface_nodes
        slots.columns.copy(*np.ascontiguousarray(family.pairs.T, np.int64))
        torn, bodies = slots.root[parents], (of.part, scene.rules.self_contact)
        names, pairs = (of.id, key, became), scene.node_face
        more = split_pairs.inherited(family.pairs, slots.first, pairs.next, pairs.rows)
        apart = split_pairs.tear_faces(
            faces.incidence.at(torn), faces.corners, faces.fresh, faces.live, faces.id, *bodies, family.first,
            family.member, family.most, slots.live, names,
        )  # fmt: skip
        self._add_pairs(np.concatenate([more, apart]))
        scene.edge_edge.add(split_pairs.tear_edges(
            edges.incidence.at(torn), edges.corners, edges.fresh, edges.live, edges.own, edges.sides, *bodies,
            family.first, names,
        ))  # fmt: skip

    def _add_pairs(self, pairs: Indices) -> None:
        """Adds pairs of a node and a face."""
        if len(pairs):
            scene, n = self._scene, len(self._scene.node_face)
            scene.node_face.add(pairs)
            scene.node_face.hang(scene.slots.first, n)


def _heirs(some: Neighbour, family: Indices, flags: Flags) -> Neighbour:
    """Appends copies of nodes to ``some``, the list of the nodes shared with one rank. ``family`` (c, 2): parents and
    copies, -1 for a node that is not present; ``flags``: working array, in which all values are False.
    """
    heirs = family[meets(flags, some.nodes, family), 1]
    return Neighbour(some.rank, extended(some.nodes, heirs)) if len(heirs) else some


@njit("void(boolean[::1], int32[::1], int32[::1])", cache=True)
def _mark(flags, some, others):  # type: ignore[no-untyped-def]
    """Sets the flag of each element of ``some`` that is in the ascending array ``others``."""
    for i in range(len(some)):
        at = np.searchsorted(others, some[i])
        if at < len(others) and others[at] == some[i]:
            flags[i] = True


@njit("int64[::1](int64[::1], int32[::1], int64[:, ::1], boolean[::1])", cache=True)
def _joining(ids, places, family, have):  # type: ignore[no-untyped-def]
    """Returns the rows of ``ids`` without a slot that need one, because their ``family`` (c, 2) must be in the scene
    (``have``).
    """
    wanted = np.sort(family[have].reshape(-1))
    rows, n = np.empty(len(ids), np.int64), 0
    for i in range(len(ids)):
        at = np.searchsorted(wanted, ids[i])
        if places[i] < 0 and at < len(wanted) and wanted[at] == ids[i]:
            rows[n] = i
            n += 1
    return rows[:n].copy()


@njit("int32[::1](int32[::1], int32[:, ::1], boolean[::1], int32[::1])", cache=True)
def _lacking(near, family, have, place):  # type: ignore[no-untyped-def]
    """Nodes without a slot, ascending, that must get one: nodes among ``near``, and nodes of families (c, 2), parents
    and copies, whose parent has a slot or for which ``have`` (c,) is True.
    """
    some, n = np.empty(len(near) + 2 * len(family), np.int32), 0
    for a in near:
        if place[a] < 0:
            some[n], n = a, n + 1
    for c in range(len(family)):
        if have[c] or place[family[c, 0]] >= 0:
            for k in range(2):
                if place[family[c, k]] < 0:
                    some[n], n = family[c, k], n + 1
    some = np.sort(some[:n])
    n = 0
    for i in range(len(some)):
        if n == 0 or some[i] != some[n - 1]:
            some[n], n = some[i], n + 1
    return some[:n].copy()


@njit("void(int32[:, ::1], boolean[::1], int64[::1], int32[:, ::1], int32[:, :, ::1], int32[::1])", cache=True)
def _place(places, pushes, rows, nodes, sides, place):  # type: ignore[no-untyped-def]
    """Finds the slots of the nodes of those cracks ``rows`` that this rank computes; these cracks have separated nodes,
    and their first side is on this rank. Flags the separated nodes in ``pushes``.
    """
    for c in rows:
        apart = nodes[c, 0] != nodes[c, 3] or nodes[c, 1] != nodes[c, 4] or nodes[c, 2] != nodes[c, 5]
        if sides[c, 0, 1] < 0 or not apart:
            continue
        for k in range(6):
            places[c, k] = place[nodes[c, k]]
            if nodes[c, k] != nodes[c, (k + 3) % 6]:
                pushes[places[c, k]] = True


@njit("void(boolean[::1], int32[::1], int32[::1], int32[::1])", cache=True)
def _push(pushes, near, ring, place):  # type: ignore[no-untyped-def]
    """Flags the slots of the separated nodes among ``near``."""
    for a in near:
        if ring[a] != a:
            pushes[place[a]] = True


@njit("int32[::1](int64[:], int32[:], int32[:], int32[::1], int32[::1], boolean[::1])", cache=True)
def _newly_shared(ids, local, places, holds, shares, flags):  # type: ignore[no-untyped-def]
    """Returns the slots of the parents that a rank ``holds`` but does not yet ``share``. Each slot is returned once, in
    the order of ids. ``ids``, ``local`` and ``places`` belong to the parents; ``flags``: working array, in which all
    values are False.
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
    """(n,) slot of each node; -1 for a node without slot. Nodes among the ``ids`` of this rank have their slot in
    ``place``; other nodes have their slot in ``far``.
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
