"""Penetrated nodes: nodes inside of another body or fragment, and nodes without tets that are inside of their own part.
Nodes inside of their own part are counted even if the part has no contact with itself.

A node in a tet of another fragment has passed through the surface of that fragment. The depth of the node is computed
from the tet alone; it is the depth below the nearest exposed face of the tet. If the tet has no exposed face but a
corner on the surface, the depth is that below the nearest of all its faces. The depth is at most the distance of the
node from a corner on the surface. In a tet without a corner on the surface the node is deeper than the outermost layer
of tets. If that layer was compressed to nearly zero thickness, the nearest exposed faces of the body determine the
depth. A node on an edge between two corners on the surface counts as touching, because a tet with an edge on the
surface may have no exposed face there; such edges may run through a plate that is one tet thick. Nodes of the surface
and separated nodes are tested against the tets of all ranks, so that the result does not depend on the partition.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...mesh.faces import FACES
from ...model.state import INTACT, Block, Flags, Floats, Indices, Ints, Model
from ...parallel.comm import Comm
from ..broad_phase import search
from ..broad_phase.boxes import Primitives
from ..stage import Contact
from .overlap import to_borders

SLIGHT = 0.05
"""Ratio of the depth of a node to the typical size of a face. A depth counts as 0 if its ratio to the size is smaller.
Chosen value: it is above the residual of the contact sweeps."""
_WORDS = 5
"""Number of words of a node in a message."""
_AT_ONCE = 1 << 14
"""Number of pairs of a node and a tet that are tested together; the number limits the size of temporary arrays."""
_ROUNDING = 1e-9
"""Tolerance of the volume coordinates; within this tolerance a node on the face between two tets counts as being in
each of them."""
DEEP = 0.25
"""Ratio of the depth of a node to the typical size of a face, above which the run gives a warning. Chosen value: about
half of the altitude of a regular tet."""


@dataclass(frozen=True)
class Inside:
    """Result of the check. All ranks have equal values."""

    tested: int
    """Number of tested nodes."""
    nodes: int
    """Number of nodes that are deeper than SLIGHT inside of another body or fragment; nodes without tets are also
    counted if they are inside of their own part."""
    own: int
    """Number of penetrated nodes that have no tets and are inside of their own part, but not of another part."""
    buried: int
    """Number of penetrated nodes that lie in a tet without a corner on the surface, and are further than SLIGHT from
    any exposed face of the body of that tet."""
    deepest: float
    """Largest depth of the penetrated nodes that lie in a tet with a corner on the surface, divided by the typical size
    of a face; 0 if no node is deeper than SLIGHT."""

    @property
    def warnings(self) -> list[str]:
        """Returns a warning if a node is deeper than DEEP."""
        if not self.buried and self.deepest <= DEEP:
            return []
        how = [f"{self.own} of them, which have no tets, in the part that they come from"] if self.own else []
        how += [f"{self.buried} of them deeper than the outermost tets"] if self.buried else []
        if self.nodes > self.buried:
            how.append(f"{'the others ' if self.buried else ''}up to {self.deepest:.2g} of the size of a face deep")
        return [
            f"{self.nodes} of {self.tested} nodes are inside of other bodies or fragments, {', '.join(how)}: "
            "compare with a finer mesh there"
        ]


def look(contact: Contact, model: Model, labels: list[Ints] | None, comm: Comm) -> Inside:
    """Finds the nodes that are inside of other bodies at the present positions. Collective.

    ``labels``: fragment of each tet, one array (n,) for each block; None if every part is one fragment.
    """
    fragments = labels or [np.full(block.n, block.part, np.int64) for block in model.blocks]
    outer, may = outermost(contact), _may(contact)
    seen = _seen(outer, model, fragments, comm)
    x, parts = seen.x, seen.part
    points, part = np.concatenate([model.nodes.x, x]), np.concatenate([model.nodes.part, parts])
    found, size = [np.zeros((0, 4))], contact.exterior.size
    for block, fragment in zip(model.blocks, fragments, strict=True):
        one = Primitives(np.arange(model.nodes.n, len(points), dtype=np.int32)[:, None], np.zeros(len(x)))
        other = Primitives(np.ascontiguousarray(block.tets, np.int32), np.zeros(block.n))
        pairs = search.find(one, other, points, np.zeros_like(points), part, may, 0.0, None)
        pairs = pairs[seen.fragment[pairs[:, 0]] != fragment[pairs[:, 1]]]
        opened = _open(block, contact, outer)
        for first in range(0, len(pairs), _AT_ONCE):
            node, tet = pairs[first : first + _AT_ONCE].T
            tets, places = block.tets[tet], x[node]
            corners = model.nodes.x[tets]
            depth = _depths(places, corners, opened[tet], outer[tets])
            some = (depth > SLIGHT * size) & (_from_edges(places, corners, outer[tets]) > SLIGHT * size)
            which = np.column_stack([node[some], depth[some] / size, fragment[tet[some]]])
            found.append(np.column_stack([which, np.full(len(which), float(block.part))]))
    everywhere = np.concatenate(comm.share(np.concatenate(found)))
    buried = np.isinf(everywhere[:, 1])
    row, of = everywhere[buried][:, [0, 2]].astype(np.int64).T
    at_surface = comm.sum(_at_surface(x[row], parts[row], of, contact, model, fragments)) > 0
    everywhere = np.concatenate([everywhere[~buried], everywhere[buried][~at_surface]])
    buried = np.isinf(everywhere[:, 1])
    rows = everywhere[:, 0].astype(np.int64)
    others = rows[(seen.fragment[rows] >= 0) | (parts[rows] != everywhere[:, 3])]
    every = len(np.unique(rows))
    return Inside(
        len(x), every, every - len(np.unique(others)), len(np.unique(rows[buried])),
        float(everywhere[~buried, 1].max(initial=0.0)),
    )  # fmt: skip


def _may(contact: Contact) -> Flags:
    """(parts, parts) True for each pair of parts that is tested: the pairs that may be in contact, and each part of
    such a pair with its own nodes without tets.
    """
    meet = ~np.isnan(contact.searches.mu)
    return np.asarray(meet | (np.eye(len(meet), dtype=bool) & meet.any(axis=1)))


class _Seen(NamedTuple):
    """Nodes that are tested. All ranks have equal values."""

    part: Indices
    """(k,) part of each node."""
    fragment: Ints
    """(k,) fragment of each node; -1 for a node without tets."""
    x: Floats
    """(k, 3) position of each node, m."""


def _seen(outer: Flags, model: Model, fragments: list[Ints], comm: Comm) -> _Seen:
    """Collects the ``outer`` nodes (nodes,) of all ranks. Collective."""
    nodes = model.nodes
    some = nodes.owned & outer
    received = comm.join(np.column_stack([nodes.id, nodes.part, nodes.x.view(np.int64)])[some]).reshape(-1, _WORDS)
    here = np.full(nodes.n + 1, -1, np.int64)  # the last element is for nodes that are not on this rank
    for block, fragment in zip(model.blocks, fragments, strict=True):
        here[block.tets] = fragment[:, None]
    known = here[nodes.places(received[:, 0])].astype(np.float64)
    x = np.ascontiguousarray(received[:, 2:]).view(np.float64)
    return _Seen(received[:, 1].astype(np.int32), comm.maximum(known).astype(np.int64), x)


def outermost(contact: Contact) -> Flags:
    """(nodes,) True for each node that is on the surface or has separated."""
    ring = contact.exterior.cracks.families.ring
    return np.asarray(contact.exterior.surface.flags | (ring != np.arange(len(ring))))


def _at_surface(
    x: Floats, parts: Indices, of: Ints, contact: Contact, model: Model, fragments: list[Ints]
) -> Ints:  # fmt: skip
    """(p,) number of open faces of this rank near each point. Faces are counted if they belong to the fragment ``of``
    (p,) of the point and are within SLIGHT of the point ``x`` (p, 3).
    """
    if not len(x):
        return np.zeros(0, np.int64)
    points, part = np.concatenate([model.nodes.x, x]), np.concatenate([model.nodes.part, parts])
    reach, allowed = SLIGHT * contact.exterior.size, _may(contact)
    one = Primitives(np.arange(model.nodes.n, len(points), dtype=np.int32)[:, None], np.full(len(x), reach))
    near = np.zeros(len(x), np.int64)
    for block, fragment in zip(model.blocks, fragments, strict=True):
        tet, side = np.nonzero(_exposed(block, contact))
        faces = np.ascontiguousarray(block.tets[tet[:, None], FACES[side]], np.int32)
        other = Primitives(faces, np.zeros(len(faces)))
        pairs = search.find(one, other, points, np.zeros_like(points), part, allowed, 0.0, None)
        pairs = pairs[of[pairs[:, 0]] == fragment[tet[pairs[:, 1]]]]
        away = _from_faces(x[pairs[:, 0]], points[faces[pairs[:, 1]]])
        near += np.bincount(pairs[away <= reach, 0], minlength=len(x))
    return near


def _exposed(block: Block, contact: Contact) -> Flags:
    """(n, 4) True for each face of a tet that is exposed or broken. Faces in symmetry planes are not exposed."""
    faces = contact.exterior.surface.faces
    opened = np.isin(4 * block.id[:, None] + np.arange(4), faces.id[faces.exposed])
    if len(block.bond):
        opened |= block.bond != INTACT
    return np.asarray(opened)


def _open(block: Block, contact: Contact, outer: Flags) -> Flags:
    """(n, 4) True for each face of a tet that is used for depths: faces that are ``_exposed``. In a tet that has no
    such face but a corner on the surface, all faces are used."""
    opened = _exposed(block, contact)
    touching = np.asarray(outer[block.tets].any(axis=1))
    return np.asarray(opened | (touching & ~opened.any(axis=1))[:, None])


def _depths(points: Floats, corners: Floats, opened: Flags, outer: Flags) -> Floats:
    """(p,) depth of points (p, 3) in tets (p, 4, 3), m. The depth is the distance from the nearest ``opened`` face (p,
    4) or from the nearest corner on the surface, ``outer`` (p, 4). If the tet has neither, the depth is infinite. The
    depth is negative outside of the tet and in a tet without volume.
    """
    edges = corners[:, 1:] - corners[:, :1]
    solid = np.linalg.det(edges) > 0.0
    edges = np.linalg.inv(np.where(solid[:, None, None], edges, np.eye(3)))
    tail = np.einsum("pi,pij->pj", points - corners[:, 0], edges)
    shares = np.column_stack([1.0 - tail.sum(axis=1), tail])
    steepness = np.linalg.norm(np.concatenate([edges.sum(axis=2)[:, None], np.swapaxes(edges, 1, 2)], axis=1), axis=2)
    heights = np.where(opened, shares / steepness, np.inf).min(axis=1)
    away = np.where(outer, np.linalg.norm(points[:, None] - corners, axis=2), np.inf).min(axis=1)
    return np.where(solid & (shares >= -_ROUNDING).all(axis=1), np.minimum(heights, away), -1.0)


def _from_faces(points: Floats, corners: Floats) -> Floats:
    """(p,) distance of each point (p, 3) from its triangle (p, 3, 3), m."""
    sides, arms = np.roll(corners, -1, axis=1) - corners, points[:, None] - corners
    normal = np.cross(sides[:, 0], sides[:, 1])
    length = np.linalg.norm(normal, axis=1)
    over = (length > 0.0) & ((np.cross(normal[:, None], sides) * arms).sum(axis=2) >= 0.0).all(axis=1)
    height = np.abs((arms[:, 0] * normal).sum(axis=1)) / np.where(length > 0.0, length, 1.0)
    return np.asarray(np.where(over, height, to_borders(points[:, None], corners)))


def _from_edges(points: Floats, corners: Floats, outer: Flags) -> Floats:
    """(p,) distance, m, of each point (p, 3) from the nearest edge of its tet (p, 4, 3) between two corners on the
    surface, ``outer`` (p, 4); infinite if the tet has no such edge.
    """
    nearest = np.full(len(points), np.inf)
    for a, b in combinations(range(4), 2):
        along, arm = corners[:, b] - corners[:, a], points - corners[:, a]
        square = (along * along).sum(axis=1)
        share = np.clip((arm * along).sum(axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        away = np.linalg.norm(arm - share[:, None] * along, axis=1)
        nearest = np.minimum(nearest, np.where(outer[:, a] & outer[:, b], away, np.inf))
    return nearest
