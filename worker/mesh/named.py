"""A mesh as its file has it: with the names of its nodes and tets there."""

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
