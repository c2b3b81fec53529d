"""Overlap of bodies before the first step. The module finds place and depth of an overlap, and can remove the overlap
by moving nodes. If an overlap remains, the module reports an error.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...mesh.faces import across
from ...mesh.faces import normals as face_normals
from ...model.state import Flags, Floats, Indices
from ..broad_phase import search
from ..broad_phase.boxes import Primitives
from ..narrow_phase.facing import FACING

_INSIDE = 1e-9
"""Tolerance of the volume coordinates, for the test whether a node is inside of a tet."""
_ROUNDING = 1e-6
"""Ratio of the depth of a node to the size of a face, below which the depth counts as 0."""
_TRIES = 30
"""Largest number of passes in which overlapping bodies are moved apart. Chosen value."""


_THROUGH = 0.1
"""Tolerance for the crossing of an edge and a face. An edge passes through a face under two conditions. First, the two
ends of the edge are on opposite sides of the face, and further from the plane of the face than the tolerance times the
size of the face. Second, the crossing point is further from each side of the face than the tolerance times the altitude
of the face on that side. Rims, and facets of two round bodies that fit, overlap by less. Chosen value."""
_CRUSHED = 0.1
"""Smallest allowed ratio of the volume of a tet after the move to its volume before the move. Chosen value."""


@dataclass(frozen=True)
class Surface:
    """Exposed faces of all parts."""

    faces: Indices
    """(f, 3) nodes of each face in the mesh."""
    part: Indices
    """(f,) part of each face."""
    exposed: Flags
    """(tets, 4) whether each face of a tet is exposed."""


@dataclass(frozen=True)
class Overlaps:
    """Nodes inside of another part: depth of each node below the surface of that part, m, and unit vector along which
    the node would leave that part.
    """

    nodes: Indices
    part: Indices
    """(n,) part that contains each node."""
    depth: Floats
    way: Floats


def find(points: Floats, tets: Indices, part: Indices, surface: Surface, allowed: Flags) -> Overlaps:
    """Finds surface nodes that are inside of the tets (k, 4) of another part. The two parts must be ``allowed`` to be
    in contact. ``points`` (n, 3): positions, m.
    """
    others = allowed & ~np.eye(len(allowed), dtype=bool)
    nodes = np.unique(surface.faces).astype(np.int32)
    small = Primitives(nodes[:, None].copy(), np.zeros(len(nodes)))
    large = Primitives(np.ascontiguousarray(tets, np.int32), np.zeros(len(tets)))
    pairs = search.find(small, large, points, np.zeros_like(points), part, others, 0.0, None)
    node, corners = nodes[pairs[:, 0]], tets[pairs[:, 1]]
    shares = _shares(points[node], points[corners])
    inside = np.asarray((shares >= -_INSIDE).all(axis=1))
    outward = _normals(points, surface.faces)
    at = (shares < _ROUNDING) & surface.exposed[pairs[:, 1]]
    inward = _inward(points[corners])
    resting = inside & (at & _faced(outward[node], inward)).any(axis=1)
    asked, face = np.nonzero((inside & ~resting)[:, None] & at)
    for pair, side, ways in zip(asked, face, _ways(points, tets, node[asked]), strict=True):
        resting[pair] |= _clear(-inward[pair, side][None], ways)[0]
    met, of = np.unique(np.column_stack([node[inside], part[corners[inside, 0]]]), axis=0, return_inverse=True)
    met = met[np.bincount(of.reshape(-1), resting[inside], len(met)) == 0]
    depth, way = np.zeros(len(met)), np.zeros((len(met), 3))
    for k, ((a, other), ways) in enumerate(zip(met, _ways(points, tets, met[:, 0]), strict=True)):
        depth[k], way[k] = _nearest(points[a], outward[a], ways, points[surface.faces[surface.part == other]])
    kept = depth > 0.0
    return Overlaps(met[kept, 0].astype(np.int32), met[kept, 1].astype(np.int32), depth[kept], way[kept])


def move_apart(
    points: Floats, tets: Indices, part: Indices, surface: Surface, allowed: Flags
) -> tuple[Floats, Indices]:
    """Moves overlapping nodes towards the surface of the other part, by half of the depth in each pass. Returns the new
    points. Returns also, for each node, the last part out of which the node was moved; -1 if it was not moved.
    """
    moved, out_of = points.copy(), np.full(len(points), -1, np.int32)
    for _ in range(_TRIES):
        found = find(moved, tets, part, surface, allowed)
        if not len(found.nodes):
            break
        moved[found.nodes] += 0.51 * found.depth[:, None] * found.way
        out_of[found.nodes] = found.part
    return moved, out_of


def crushed(before: Floats, after: Floats, tets: Indices) -> Indices:
    """Returns the tets that are inverted after the move or have less than a tenth of their volume."""
    had = _volumes(before[tets])
    return np.flatnonzero((had > 0.0) & (_volumes(after[tets]) < _CRUSHED * had)).astype(np.int32)


def nested(points: Floats, tets: Indices, part: Indices, surface: Surface, allowed: Flags) -> Indices:
    """(n, 2) pairs of a surface tet whose centre is inside of a tet of another part, and this other tet. Only parts
    that may be in contact are compared.

    If the surfaces of two bodies coincide, no node is inside of the other body, because the nodes lie on faces of the
    other body.
    """
    others = allowed & ~np.eye(len(allowed), dtype=bool)
    outer = np.flatnonzero(surface.exposed.any(axis=1)).astype(np.int32)
    centres = points[tets[outer]].mean(axis=1)
    every, of = np.concatenate([points, centres]), np.concatenate([part, part[tets[outer, 0]]])
    places = np.arange(len(points), len(every), dtype=np.int32)
    small, large = (Primitives(of_them, np.zeros(len(of_them))) for of_them in (places[:, None], tets))
    pairs = search.find(small, large, every, np.zeros_like(every), of, others, 0.0, None)
    inside = (_shares(centres[pairs[:, 0]], points[tets[pairs[:, 1]]]) >= -_INSIDE).all(axis=1)
    return np.column_stack([outer[pairs[inside, 0]], pairs[inside, 1]])


def within(points: Floats, tets: Indices, body: Indices) -> tuple[Indices, Indices]:
    """Returns the nodes that are inside of another body, and the tets whose centre is inside of another body. ``body``
    (n,): body of each node.

    A node on the surface of a body is not inside of the body. A node on a face between two tets of a body is inside of
    the body: if two meshes of one grid are shifted by half a cell, all nodes lie on such faces. A centre is inside of
    its own tet. Therefore a tet whose centre is on any face of another body has common volume with that body.
    """
    every = np.concatenate([points, points[tets].mean(axis=1)])
    of = np.concatenate([body, body[tets[:, 0]]])
    places = np.arange(len(every), dtype=np.int32)
    small, large = (
        Primitives(rows, np.zeros(len(rows))) for rows in (places[:, None], np.ascontiguousarray(tets, np.int32))
    )
    others = ~np.eye(int(body.max(initial=0)) + 1, dtype=bool)
    pairs = search.find(small, large, every, np.zeros_like(every), of, others, 0.0, None)
    shares = _shares(every[pairs[:, 0]], points[tets[pairs[:, 1]]])
    inside = np.asarray((shares >= -_INSIDE).all(axis=1))
    outer = across(tets)[pairs[:, 1]] < 0
    on_surface = (inside[:, None] & (shares < _ROUNDING) & outer).any(axis=1)
    resting = np.intersect1d(pairs[on_surface, 0], np.arange(len(points)))
    found = np.setdiff1d(pairs[inside, 0], resting)
    return found[found < len(points)], found[found >= len(points)] - len(points)


def crossing(points: Floats, part: Indices, surface: Surface, allowed: Flags) -> Indices:
    """(n, 2) a node at one end of each surface edge that passes through a face of another part, and a corner of this
    face. Only parts that may be in contact are compared. Bodies that cross each other may have no node inside of each
    other.
    """
    others, faces = allowed & ~np.eye(len(allowed), dtype=bool), np.ascontiguousarray(surface.faces, np.int32)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    small, large = Primitives(edges, np.zeros(len(edges))), Primitives(faces, np.zeros(len(faces)))
    pairs = search.find(small, large, points, np.zeros_like(points), part, others, 0.0, None)
    (p, q), (a, b, c) = (np.moveaxis(points[rows], 1, 0) for rows in (edges[pairs[:, 0]], faces[pairs[:, 1]]))
    normal = np.cross(b - a, c - a)
    above, below = ((each - a) * normal for each in (p, q))
    above, below = above.sum(axis=1), below.sum(axis=1)
    deep = _THROUGH * (normal * normal).sum(axis=1) ** 0.75
    through = (above * below < 0.0) & (np.minimum(np.abs(above), np.abs(below)) > deep)
    share = above / np.where(through, above - below, 1.0)
    at = p + share[:, None] * (q - p)
    sides = ((b - a, a), (c - b, b), (a - c, c))
    most = _THROUGH * (normal * normal).sum(axis=1)
    inner = [(np.cross(side, at - start) * normal).sum(axis=1) > most for side, start in sides]
    found = through & np.logical_and.reduce(inner)
    return np.column_stack([edges[pairs[found, 0], 0], faces[pairs[found, 1], 0]])


def _volumes(corners: Floats) -> Floats:
    """(n,) six times the volumes of tets (n, 4, 3)."""
    return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1]))


def _shares(nodes: Floats, corners: Floats) -> Floats:
    """(p, 4) volume coordinates of nodes (p, 3) in tets (p, 4, 3). Inside of the tet no coordinate is negative; on a
    face one coordinate is zero.
    """
    edges = corners[:, 1:] - corners[:, :1]
    tail = np.einsum("pi,pij->pj", nodes - corners[:, 0], np.linalg.inv(edges))
    return np.column_stack([1.0 - tail.sum(axis=1), tail])


def _faced(outward: Floats, inward: Floats) -> Flags:
    """(p, 4) True for each face if a node with the outward direction ``outward`` (p, 3) may lie on it. The faces are
    given by their normals into the tets (p, 4, 3).

    If sides of two bodies lie in one plane and one body penetrates the other, a rim node of the first body is on that
    side of the second body. The side does not support such a rim node.
    """
    return np.asarray((inward * outward[:, None]).sum(axis=2) >= -FACING)


def _inward(corners: Floats) -> Floats:
    """(p, 4, 3) unit normals, pointing into the tets (p, 4, 3), of the faces opposite to each corner."""
    tail = np.swapaxes(np.linalg.inv(corners[:, 1:] - corners[:, :1]), 1, 2)
    inward = np.concatenate([-tail.sum(axis=1, keepdims=True), tail], axis=1)
    return np.asarray(inward / np.linalg.norm(inward, axis=2)[:, :, None])


def _clear(normals: Floats, ways: Floats) -> Flags:
    """(f,) True for each plane if a node lies on it, because no tet of the node reaches behind the plane. The planes go
    through the node and have the unit ``normals`` (f, 3); ``ways`` (w, 3): vectors from the node to the corners of its
    tets. The test of the planes is valid for any mean normal of the node. The test is needed because a corner at the
    rim of two slanted sides may face neither side.
    """
    return np.asarray((normals @ ways.T).min(axis=1) >= -_ROUNDING * np.linalg.norm(ways, axis=1).max())


def _ways(points: Floats, tets: Indices, nodes: Indices) -> Iterator[Floats]:
    """Vectors (w, 3), m, from each of the ``nodes`` (p,) to the corners of its tets (k, 4)."""
    rows, corner = np.nonzero(np.isin(tets, nodes))
    owner = tets[rows, corner]
    order = np.argsort(owner, kind="stable")
    begin, end = np.searchsorted(owner[order], nodes), np.searchsorted(owner[order], nodes, side="right")
    for node, first, last in zip(nodes, begin, end, strict=True):
        yield (points[tets[rows[order[first:last]]]] - points[node]).reshape(-1, 3)


def _normals(points: Floats, faces: Indices) -> Floats:
    """(n, 3) unit outward normals of the nodes; zero for a node without faces. ``faces`` (f, 3)."""
    normals, areas = np.zeros_like(points), face_normals(points, faces)
    for k in range(3):
        np.add.at(normals, faces[:, k], areas)
    lengths = np.linalg.norm(normals, axis=1)
    return np.asarray(normals / np.where(lengths > 0.0, lengths, 1.0)[:, None])


def _nearest(node: Floats, outward: Floats, ways: Floats, triangles: Floats) -> tuple[float, Floats]:
    """Returns the depth of a node below the nearest triangle that the node faces, m, and the unit normal of this
    triangle. ``triangles`` (f, 3, 3): corners of the triangles. A node faces a triangle because of its mean normal, or
    because no tet of the node reaches behind the plane of the triangle; ``ways`` (w, 3): vectors to the corners of
    these tets.

    The depth is zero for a node on the surface, and if the foot of the node is on no faced triangle. In a dent of the
    surface the nearest triangle may be wrong: a ridge may be nearest, with the foot on its far side.
    """
    e, f, r = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], node - triangles[:, 0]
    normals = np.cross(e, f)
    area = np.linalg.norm(normals, axis=1)
    normals /= area[:, None]
    heights = (normals * r).sum(axis=1)
    ee, ff, ef = (e * e).sum(axis=1), (f * f).sum(axis=1), (e * f).sum(axis=1)
    er, fr = (e * r).sum(axis=1), (f * r).sum(axis=1)
    s, t = (ff * er - ef * fr) / area**2, (ee * fr - ef * er) / area**2
    faced = ((normals @ outward <= FACING) | _clear(normals, ways)) & (heights <= _ROUNDING * np.sqrt(area))
    over = (np.minimum(np.minimum(s, t), 1.0 - s - t) >= -_INSIDE) & faced
    if not over.any():
        return 0.0, np.zeros(3)
    away = np.where(over, -heights, to_borders(node, triangles))
    best = np.flatnonzero(faced)[np.argmin(away[faced])]
    depth = -float(heights[best])
    return (depth if depth > _ROUNDING * np.sqrt(area[best]) else 0.0), normals[best]


def to_borders(node: Floats, triangles: Floats) -> Floats:
    """(f,) distance, m, of a point from the nearest border of each triangle (f, 3, 3). ``node`` is one point, or one
    point for each triangle (f, 1, 3).
    """
    along = np.roll(triangles, -1, axis=1) - triangles
    square = (along * along).sum(axis=2)
    share = (along * (node - triangles)).sum(axis=2) / np.where(square > 0.0, square, 1.0)
    off = triangles + np.clip(share, 0.0, 1.0)[:, :, None] * along - node
    return np.asarray(np.linalg.norm(off, axis=2).min(axis=1))
