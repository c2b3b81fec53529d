"""Registration: the search for the candidate pairs of changed nodes, faces and edges on one rank, without
communication. Registration finds each pair once.

The pairs of a changed node, face or edge are removed and searched again among everything in the broad phase. A node,
face or edge is changed if it has departed from its line (reference_motion.py) or is new on the surface. A complete
search is a registration in which everything is changed. No bit of the answer depends on candidates that do not become
active.
"""

from dataclasses import dataclass

import numpy as np

from ...model.ids import places
from ...model.state import Flags, Floats, Indices, Ints
from ..narrow_phase.tables import DEEP, DEEP_SELF
from ..scene.scene import Scene
from . import search, swept_filter
from .deviation import Deviation
from .search import Primitives

_PARTLY = 0.5
"""Share of half the skin. When a slot has departed from its line by half the skin, all slots that have departed by
more than this share of half the skin get new lines too."""


@dataclass
class _Flight:
    """Lines of a scene from the beginning of the step on."""

    x: Floats
    """(slots, 3) positions, m."""
    course: Floats
    """(slots, 3) velocities less the mean, m/s."""
    part: Indices
    """(slots,) part of each slot."""
    horizon: float
    """Time to the end of the candidate list, s."""

    def find(self, small: Primitives, large: Primitives, allowed: Flags, rank: Ints | None) -> Indices:
        """Calls search.find on the lines of the scene."""
        return search.find(small, large, self.x, self.course, self.part, allowed, self.horizon, rank)


def register_new(scene: Scene) -> None:
    """Registers all new nodes, faces and edges, before a step begins."""
    scene.reference.begin_anew(scene.settle_live(), scene.surface_nodes.x)
    _register(scene)


def renew(scene: Scene, x: Floats, v: Floats, strayed: bool, deviation: Deviation) -> None:
    """Registers all new nodes, faces and edges and, with ``strayed``, begins new lines for the slots that have departed
    from their lines.

    ``x``, ``v`` (slots, 3): at the beginning of the step, v before contact; ``deviation``: measures the distances.
    """
    off = scene.settle_live()
    if strayed:
        off |= scene.slots.tracked & (scene.reference.searched.left > 0.5 * _PARTLY * scene.rules.skin)
        scene.slots.new |= off
        scene.faces.new |= off[scene.faces.corners[:, :3]].any(axis=1)
        scene.edges.new |= off[scene.edges.corners[:, :2]].any(axis=1)
    scene.reference.begin_anew(off, x)
    measured = scene.reference, x, v, scene.faces.corners, scene.edges.corners, scene.slots.tracked
    deviation.measure(*measured)
    knocked = off & (scene.reference.searched.left > 0.5 * scene.rules.skin)
    if knocked.any():
        scene.reference.aim(knocked, x, v)
        deviation.measure(*measured)
    _register(scene)


def carry(now: Scene, old: Scene) -> None:
    """Copies the state of the scene ``old`` to ``now``, which is not connected yet: lines, broad-phase flags, and the
    pairs that still exist. The pairs of a copied node were on the rank of its parent, and are from now on on the rank
    that owns the copy.
    """
    slots, faces = _numbers(now.surface_nodes.id, old.surface_nodes.id), _numbers(now.faces.id, old.faces.id)
    edges = _numbers(now.edges.names, old.edges.names)
    now.reference.take_over(slots, old.reference)
    now.slots.tracked[slots[slots >= 0]] = old.slots.tracked[slots >= 0]
    now.reference.until = old.reference.until
    for mine, theirs, rows in (
        (now.slots, old.slots, slots),
        (now.faces, old.faces, faces),
        (now.edges, old.edges, edges),
    ):
        for name in ("live", "new", "fresh"):
            getattr(mine, name)[rows[rows >= 0]] = getattr(theirs, name)[rows >= 0]
    kept = edges[edges >= 0]
    now.edges.fresh[kept] |= now.edges.meets[kept] & ~old.edges.meets[edges >= 0]
    now.slots.live &= now.slots.owned
    here = np.flatnonzero(slots >= 0)
    slots[here[~now.slots.owned[slots[here]]]] = -1
    now.node_face = old.node_face.carried(slots, faces)
    now.edge_edge = old.edge_edge.carried(edges, edges)


def _numbers(now: Ints, old: Ints) -> Indices:
    """Returns the row of each name of ``old`` in ``now``, -1 for a name that is missing."""
    order = np.argsort(now, kind="stable")
    at = places(now[order], old)
    return np.where(at >= 0, order[at], -1).astype(np.int32) if len(order) else at


def _register(scene: Scene) -> None:
    reference, pairs = scene.reference, scene.node_face
    nodes, faces, edges = (some.new & some.live for some in (scene.slots, scene.faces, scene.edges))
    flight = _Flight(
        reference.positions(),
        reference.searched.course - scene.reference.drift,
        scene.surface_nodes.part,
        scene.reference.until - reference.t,
    )
    some = pairs.pushed
    old, kept = pairs.rows[some], pairs.kept[some]
    pairs.drop(nodes, faces)
    scene.edge_edge.drop(edges, edges)
    pairs.add(_node_face(scene, nodes, faces, flight))
    scene.edge_edge.add(_edge_edge(scene, edges, flight))
    scene.chain()
    pairs.recall(scene.slots.first, old, kept)
    scene.slots.new[:], scene.faces.new[:], scene.edges.new[:] = False, False, False


def _node_face(scene: Scene, nodes: Flags, faces: Flags, flight: _Flight) -> Indices:
    """(p, 2) slot and face: changed nodes with all faces, changed faces with the other nodes."""
    half, size = 0.5 * scene.rules.skin, scene.faces.size
    every = np.arange(scene.surface_nodes.n, dtype=np.int32)[:, None], np.full(scene.surface_nodes.n, half)
    changed, others = (Primitives(*every, _rows(some)) for some in (nodes, scene.slots.live & ~nodes))
    corners, own = np.ascontiguousarray(scene.faces.corners[:, :3]), np.eye(len(scene.rules.allowed), dtype=bool)
    found = [np.zeros((0, 2), np.int32)]
    for deep, which in ((DEEP_SELF, own), (DEEP, ~own)):
        if (allowed := scene.rules.allowed & which).any():
            of = corners, half + deep * size
            found.append(flight.find(changed, Primitives(*of, _rows(scene.faces.live)), allowed, None))
            found.append(flight.find(Primitives(*of, _rows(faces)), others, allowed, None)[:, ::-1])
    pairs = np.concatenate(found)
    sifted = swept_filter.faces(
        pairs, scene.faces.corners, size, flight.x, flight.course, flight.part, scene.rules.skin, flight.horizon
    )  # fmt: skip
    return np.asarray(pairs[sifted])


def _edge_edge(scene: Scene, edges: Flags, flight: _Flight) -> Indices:
    """Returns pairs of edges (p, 2) of which at least one has changed. The edge of lower rank is first, and the pair is
    computed on the rank that has this edge.
    """
    of = np.ascontiguousarray(scene.edges.corners[:, :2]), 0.5 * (scene.rules.skin + scene.edges.deep)
    allowed, rank = scene.rules.allowed, scene.edges.rank
    changed, others = (Primitives(*of, _rows(some)) for some in (edges, scene.edges.live & ~edges))
    one, two = flight.find(changed, changed, allowed, rank), flight.find(changed, others, allowed, None)
    turned = rank[two[:, 0]] > rank[two[:, 1]]
    two[turned] = two[turned, ::-1]
    pairs = np.concatenate([one, two])
    if not scene.edges.own.all():
        pairs = pairs[scene.edges.own[pairs[:, 0]]]
    sifted = swept_filter.edges(
        pairs, scene.edges.corners, scene.edges.deep, flight.x, flight.course, scene.rules.skin, flight.horizon
    )  # fmt: skip
    return np.asarray(pairs[sifted])


def _rows(flags: Flags) -> Indices:
    return np.flatnonzero(flags).astype(np.int32)
