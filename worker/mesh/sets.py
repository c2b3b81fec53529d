"""Sets of nodes and surfaces in a mesh file, to which the key ``on`` of a case refers."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cutting import halves
from .faces import boundary_faces
from .model import Ids, Ints, NodeSet


@dataclass(frozen=True, eq=False)
class Named:
    """A set as its file defines it, with indices of nodes of the whole file."""

    names: tuple[str, ...]
    """Names of the set that a case may use."""
    nodes: Ids
    """(k,) nodes of the set, if it is a set of nodes."""
    faces: tuple[Ids, ...] | None = None
    """Triangles (n, 3) and quadrilaterals (n, 4) of a surface, given by their corners; None for a set of nodes."""
    free: bool = False
    """True if all faces of the surface must be outer faces of the mesh."""


def surface(names: tuple[str, ...], faces: Iterable[Ids], free: bool = False) -> Named:
    """Return a surface made of faces (n, 3) and (n, 4). A face of four corners may repeat a corner."""
    threes, fours = [np.zeros((0, 3), np.int64)], [np.zeros((0, 4), np.int64)]
    for each in faces:
        if each.shape[1] == 3:
            threes.append(each)
            continue
        again = each == np.roll(each, 1, axis=1)
        fours.append(each[~again.any(axis=1)])
        once = again.sum(axis=1) == 1
        threes += [np.delete(each[again[:, corner] & once], corner, axis=1) for corner in range(4)]
    return Named(names, np.zeros(0, np.int64), (np.concatenate(threes), np.concatenate(fours)), free)


def joined(names: tuple[str, ...], several: Sequence[Named]) -> Named:
    """Return the union of sets of one kind."""
    nodes = np.unique(np.concatenate([each.nodes for each in several]))
    if several[0].faces is None:
        return Named(names, nodes)
    faces = [each for one in several for each in one.faces or ()]
    return surface(names, faces, any(each.free for each in several))


class Members:
    """The members of the sets of a file that belong to a mesh."""

    def __init__(self, used: Ids, tets: Ints, edges: Ids) -> None:
        """``used``: (n,) the index in the file of each node of the mesh, ascending; ``tets``: (m, 4) nodes of the tets,
        as indices into ``used``. ``edges``: (k, 3) indices of two corners and of the node between them; it is given if
        tets of ten nodes were cut into eight.
        """
        self._used = used
        self._outer = np.unique(np.sort(boundary_faces(tets), axis=1), axis=0)
        self._edges = edges[np.lexsort((edges[:, 1], edges[:, 0]))]

    def of(self, named: Named) -> NodeSet:
        """Return the nodes of a set that are in the mesh. For a surface, also return its faces that are outer faces of
        the mesh.
        """
        if named.faces is None:
            nodes, there = self._indices(named.nodes)
            return NodeSet(named.names, np.unique(nodes[there]))
        whole = [self._whole(faces) for faces in named.faces]
        parted = [self._parted(faces) for faces in whole]
        meant = [each[good] if named.free else each for each, good in parted]
        nodes = np.concatenate([np.zeros(0, np.int32), *(each.ravel() for each in meant)])
        faces = [each[good] for each, good in parted]
        inner = 0 if named.free else sum(int((~good).sum()) for _, good in parted)
        return NodeSet(
            named.names,
            np.unique(nodes),
            np.concatenate([np.zeros((0, 3), np.int32), *(f.reshape(-1, 3) for f in faces)]),
            inner,
        )

    def _indices(self, places: Ids) -> tuple[Ints, NDArray[np.bool_]]:
        """Return the indices in the mesh of nodes of the file. Also return flags: True for each node that is in the
        mesh.
        """
        if not len(self._used):
            return np.zeros(places.shape, np.int32), np.zeros(places.shape, bool)
        found = np.minimum(np.searchsorted(self._used, places), len(self._used) - 1)
        return found.astype(np.int32), self._used[found] == places

    def _whole(self, faces: Ids) -> Ids:
        """Return the faces whose corners are all in the mesh. Each face is returned once."""
        there = self._indices(faces)[1].all(axis=1)
        _, first = np.unique(np.sort(faces[there], axis=1), axis=0, return_index=True)
        return faces[there][np.sort(first)]

    def _parted(self, faces: Ids) -> tuple[Ints, NDArray[np.bool_]]:
        """Return (n, k, 3) the triangles of each face. Also return flags: True if all triangles of the face are outer
        faces of the mesh.
        """
        if faces.shape[1] == 4:
            ways = [halves(faces).reshape(-1, 2, 3), _other_halves(faces)]
        else:
            ways = [self._quarters(faces)] if len(self._edges) else [faces.reshape(-1, 1, 3)]
        found = [self._indices(way)[0] for way in ways]
        good = [self._are_outer(way) for way in found]
        first = good[0][:, None, None] if len(ways) > 1 else np.True_
        return np.where(first, found[0], found[-1]), np.any(good, axis=0)

    def _are_outer(self, triangles: Ints) -> NDArray[np.bool_]:
        rows = np.sort(triangles.reshape(-1, 3), axis=1)
        both = np.concatenate([self._outer, rows])
        _, of = np.unique(both, axis=0, return_inverse=True)
        of = of.reshape(-1)
        known = np.zeros(int(of.max(initial=0)) + 1, bool)
        known[of[: len(self._outer)]] = True
        return np.asarray(known[of[len(self._outer) :]].reshape(triangles.shape[:2]).all(axis=1))

    def _quarters(self, faces: Ids) -> Ids:
        """Return (n, 4, 3) the triangles of faces that have midside nodes."""
        a, b, c = faces.T
        p, q, r = (self._middle(one, other) for one, other in ((a, b), (b, c), (c, a)))
        rows = [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
        return np.stack([np.stack(row, axis=1) for row in rows], axis=1)

    def _middle(self, one: Ids, other: Ids) -> Ids:
        """Return (n,) the midside nodes between pairs of nodes. If there is no midside node, the result is one node of
        the pair.
        """
        low, high = np.minimum(one, other), np.maximum(one, other)
        every = np.concatenate([self._edges[:, :2], np.column_stack([low, high])])
        _, of = np.unique(every, axis=0, return_inverse=True)
        of = of.reshape(-1)
        known = np.full(int(of.max()) + 1, -1, np.int64)
        known[of[: len(self._edges)]] = self._edges[:, 2]
        found = known[of[len(self._edges) :]]
        return np.where(found < 0, one, found)


def _other_halves(quads: Ids) -> Ids:
    """Return (n, 2, 3) the two triangles of each quadrilateral for its other diagonal. Tets may have the triangles of
    either diagonal as faces.
    """
    odd = (quads.argmin(axis=1) % 2 == 0)[:, None]
    rolled = np.where(odd, np.roll(quads, -1, axis=1), quads)
    return rolled[:, [[0, 1, 2], [0, 2, 3]]]


def members(named: Sequence[Named], used: Ids, tets: Ints, edges: Ids) -> tuple[NodeSet, ...]:
    """Return the sets of a file restricted to a mesh (see ``Members``)."""
    if not named:
        return ()
    here = Members(used, tets, edges)
    return tuple(here.of(each) for each in named)
