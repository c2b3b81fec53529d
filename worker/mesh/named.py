"""A mesh with the numbers that its nodes and tets have in the mesh file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import MeshError
from .model import Ids, Names, TetMesh


@dataclass(frozen=True)
class NamedMesh:
    """An unchecked mesh, and the numbers that its nodes and tets have in the mesh file."""

    mesh: TetMesh
    names: Names
    places: Ids
    """(n,) number of each node in the file, unique in the file."""
    notes: tuple[str, ...] = ()
    """Contents of the file that are not in the mesh or are interpreted in an unexpected way; one text for each."""


def gathered(node_tags: Ids, points: Any, tet_tags: Ids, corners: Ids) -> NamedMesh:
    """Return tets (m, 4) as indices of the nodes that they use. ``corners``: tags of the corners of the tets. The used
    nodes are ordered by tag.
    """
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
    """Return node numbers (m, k) of a file as indices into ``tags``.

    Raises MeshError for an unknown node number. ``called(k)`` returns the name of element ``k`` for the message.
    """
    order = np.argsort(tags, kind="stable")
    found = np.minimum(np.searchsorted(tags, nodes, sorter=order), max(len(tags) - 1, 0))
    good = tags[order[found]] == nodes if len(tags) else np.zeros(nodes.shape, bool)
    if not good.all():
        k = int(np.flatnonzero(~good.all(axis=1))[0])
        raise MeshError(f"{called(k)} uses node {nodes[k][~good[k]][0]}, which is not defined")
    return np.asarray(order[found], np.int64)


def refuse_repeated(what: str, numbers: Ids, where: str = "") -> None:
    """Raise MeshError if two nodes, or two elements, have equal numbers."""
    found, times = np.unique(numbers, return_counts=True)
    if len(found) < len(numbers):
        raise MeshError(f"{what} {found[times > 1][0]} is defined twice{where}")
