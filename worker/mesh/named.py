"""A mesh as its file has it: with the names of its nodes and tets there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import MeshError
from .model import Ids, Names, TetMesh


@dataclass(frozen=True)
class NamedMesh:
    """A mesh, not yet checked, and what its file calls the nodes and tets."""

    mesh: TetMesh
    names: Names
    places: Ids
    """(n,) a number of each node that no other node of the file has."""
    notes: tuple[str, ...] = ()
    """What of the file is not in the mesh, or is taken otherwise than one might think, a line each."""


def gathered(node_tags: Ids, points: Any, tet_tags: Ids, corners: Ids) -> NamedMesh:
    """Tets given by node tags, (m, 4), as indices into the nodes that they use, in the order of the tags."""
    order = np.argsort(node_tags, kind="stable")
    used, tets = np.unique(corners, return_inverse=True)
    place = np.searchsorted(node_tags, used, sorter=order)
    found = place < len(node_tags)
    found[found] = node_tags[order[place[found]]] == used[found]
    if not found.all():
        lost = used[~found][0]
        tet = tet_tags[(corners == lost).any(axis=1)][0]
        raise MeshError(f"tet {tet} uses node {lost}, which is not defined")
    mesh = TetMesh(np.asarray(points, np.float64)[order[place]], tets.reshape(-1, 4).astype(np.int32))
    return NamedMesh(mesh, Names(used, tet_tags), used)


def placed(tags: Ids, nodes: Ids, called: Callable[[int], str]) -> Ids:
    """Node numbers (m, k) of a file as places in ``tags``. MeshError for one that is not there, of element ``called``
    by its place.
    """
    order = np.argsort(tags, kind="stable")
    found = np.minimum(np.searchsorted(tags, nodes, sorter=order), max(len(tags) - 1, 0))
    good = tags[order[found]] == nodes if len(tags) else np.zeros(nodes.shape, bool)
    if not good.all():
        k = int(np.flatnonzero(~good.all(axis=1))[0])
        raise MeshError(f"{called(k)} uses node {nodes[k][~good[k]][0]}, which is not defined")
    return np.asarray(order[found], np.int64)


def refuse_repeated(what: str, numbers: Ids, where: str = "") -> None:
    """MeshError where two nodes, or two elements, have the same number."""
    found, times = np.unique(numbers, return_counts=True)
    if len(found) < len(numbers):
        raise MeshError(f"{what} {found[times > 1][0]} is defined twice{where}")
