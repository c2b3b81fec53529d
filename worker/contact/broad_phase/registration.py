"""Registration: the search for the candidate pairs of changed nodes, faces and edges on one rank, without
communication. Registration finds each pair once.

The pairs of a changed node, face or edge are removed; then its pairs are searched among all nodes, faces and edges in
the broad phase. A node, face or edge counts as changed if it has departed from its line (reference_motion.py) or is new
on the surface. A complete search is a registration in which all nodes, faces and edges are changed. Candidates that do
not become active have no effect on the answer.
"""

import numpy as np

from ...kernels.jit import njit
from ...model.ids import places
from ...model.state import Flags, Floats, Indices, Ints
from ...parallel.team import Team
from ..narrow_phase.tables import DEEP, DEEP_SELF
from ..scene.passes import ScenePasses
from ..scene.scene import Scene
from . import search
from .boxes import Lines, Primitives
from .deviation import Deviation
from .extrapolation import rigid_motions
from .swept_filter import SweptFilter

_PARTLY = 0.5
"""Fraction of half of the skin. When a slot has departed from its line by half of the skin, new lines begin for all
slots that have departed by more than this fraction of half of the skin."""


class Registration:
    """Passes of searches and registrations, run by the threads of a team."""

    def __init__(self, team: Team) -> None:
        self.deviation = Deviation(team)
        """Passes that measure the distances of slots from their lines."""
        self.rigid = rigid_motions(team)
        """Pass that adds the rigid motions of tets (extrapolation.py)."""
        self.scene = ScenePasses(team)
        """Passes of the scenes."""
        self._finder, self._filter = search.Finder(team), SweptFilter(team)

    def register_new(self, scene: Scene) -> None:
        """Registers all new nodes, faces and edges, before a step begins."""
        scene.reference.begin_anew(scene.settle_live(), scene.surface_nodes.x)
        self._register(scene)

    def renew(self, scene: Scene, x: Floats, v: Floats, strayed: bool) -> None:
        """Registers all new nodes, faces and edges. If ``strayed`` is True, first begins new lines for the slots that
        have departed from their lines.

        ``x``, ``v`` (slots, 3): positions at the beginning of the step, and velocities before contact.
        """
        off = scene.settle_live()
        if strayed:
            off |= scene.slots.tracked & (scene.reference.searched.left > 0.5 * _PARTLY * scene.rules.skin)
            scene.renew_at(off)
        scene.reference.begin_anew(off, x)
        measured = scene.reference, x, v, scene.faces.corners, scene.edges.corners, scene.slots.tracked
        self.deviation.measure(*measured)
        knocked = off & (scene.reference.searched.left > 0.5 * scene.rules.skin)
        if knocked.any():
            scene.reference.aim(knocked, x, v)
            self.deviation.measure(*measured)
        self._register(scene)

    def _register(self, scene: Scene) -> None:
        reference, pairs = scene.reference, scene.node_face
        nodes, faces, edges = (some.new & some.live for some in (scene.slots, scene.faces, scene.edges))
        course, horizon = reference.searched.course - reference.drift, reference.until - reference.t
        lines = Lines(reference.positions(), course, horizon, scene.surface_nodes.part)
        some = pairs.pushed
        old, kept = pairs.rows[some], pairs.kept[some]
        pairs.drop(nodes, faces)
        scene.edge_edge.drop(edges, edges)
        self._node_face(scene, nodes, faces, lines)
        self._edge_edge(scene, edges, lines)
        scene.chain()
        pairs.recall(scene.slots.first, old, kept)
        scene.slots.new[:], scene.faces.new[:], scene.edges.new[:] = False, False, False

    def _node_face(self, scene: Scene, nodes: Flags, faces: Flags, lines: Lines) -> None:
        """Adds pairs of a slot and a face. Changed nodes are paired with all faces; changed faces are paired with the
        nodes that have not changed.
        """
        half, size, n = 0.5 * scene.rules.skin, scene.faces.size, scene.surface_nodes.n
        every = np.arange(n, dtype=np.int32)[:, None], np.full(n, half)
        changed, others = (Primitives(*every, _rows(some)) for some in (nodes, scene.slots.live & ~nodes))
        live, new, own = _rows(scene.faces.live), _rows(faces), np.eye(len(scene.rules.allowed), dtype=bool)
        for deep, which in ((DEEP_SELF, own), (DEEP, ~own)):
            if (allowed := scene.rules.allowed & which).any():
                of = scene.faces.corners, half + deep * size
                self._add_faces(scene, self._find(changed, Primitives(*of, live, 3), lines, allowed), lines)
                found = self._find(Primitives(*of, new, 3), others, lines, allowed)
                self._add_faces(scene, np.ascontiguousarray(found[:, ::-1]), lines)

    def _add_faces(self, scene: Scene, pairs: Indices, lines: Lines) -> None:
        """Adds those pairs of a slot and a face that may be in contact. ``pairs`` (p, 2): all pairs."""
        faces = scene.faces
        scene.node_face.add(self._filter.faces(pairs, faces.corners, faces.size, lines, scene.rules.skin))

    def _edge_edge(self, scene: Scene, edges: Flags, lines: Lines) -> None:
        """Adds pairs of edges of which at least one has changed. The edge of lower rank is the first of a pair; the
        rank that has this edge computes the pair.
        """
        of = scene.edges.corners, 0.5 * (scene.rules.skin + scene.edges.deep)
        allowed, rank = scene.rules.allowed, scene.edges.rank
        changed, others = (Primitives(*of, _rows(some), 2) for some in (edges, scene.edges.live & ~edges))
        self._add_edges(scene, self._find(changed, changed, lines, allowed, rank), lines)
        found = self._find(changed, others, lines, allowed)
        turned = rank[found[:, 0]] > rank[found[:, 1]]
        found[turned] = found[turned, ::-1]
        self._add_edges(scene, found, lines)

    def _add_edges(self, scene: Scene, pairs: Indices, lines: Lines) -> None:
        """Adds those pairs of edges that this rank computes and that may be in contact. ``pairs`` (p, 2): all pairs."""
        edges = scene.edges
        if not edges.own.all():
            pairs = pairs[edges.own[pairs[:, 0]]]
        scene.edge_edge.add(self._filter.edges(pairs, edges.corners, edges.deep, lines, scene.rules.skin))

    def _find(
        self, small: Primitives, large: Primitives, lines: Lines, allowed: Flags, rank: Ints | None = None
    ) -> Indices:  # fmt: skip
        return search.find(small, large, lines.x, lines.v, lines.part, allowed, lines.horizon, rank, self._finder)


def carry(now: Scene, old: Scene) -> None:
    """Copies the state of the scene ``old`` to ``now``, which is not connected yet: lines, broad-phase flags, and the
    pairs that still exist. Before the copy the pairs of a copied node were on the rank of its parent; now they are on
    the rank that owns the copy.
    """
    slots = now.passes.located(now.surface_nodes.id, old.surface_nodes.id)
    faces, edges = _numbers(now.faces.id, old.faces.id), _numbers(now.edges.names, old.edges.names)
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
    """Returns for each element of ``old`` (names) its row in ``now``; -1 for a name that is missing in ``now``."""
    if (now[1:] > now[:-1]).all() and (old[1:] > old[:-1]).all():
        return np.asarray(_merged(now, old))
    order = np.argsort(now, kind="stable")
    at = places(now[order], old)
    return np.where(at >= 0, order[at], -1).astype(np.int32) if len(order) else at


@njit("int32[::1](int64[::1], int64[::1])", cache=True)
def _merged(now, old):  # type: ignore[no-untyped-def]
    """Does the same as ``_numbers``, for names in ascending order."""
    rows, at = np.empty(len(old), np.int32), 0
    for k in range(len(old)):
        while at < len(now) and now[at] < old[k]:
            at += 1
        rows[k] = at if at < len(now) and now[at] == old[k] else -1
    return rows


def _rows(flags: Flags) -> Indices:
    return np.flatnonzero(flags).astype(np.int32)
