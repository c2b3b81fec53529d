"""Construction of one mesh of all parts. Nodes and tets have the order of the parts. Parts joined by bonds have common
nodes.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from conoid.cases.checks.on import ons
from conoid.cases.model.schema import Case

from ..errors import MeshError
from ..fracture.connectivity import components
from ..mesh.faces import across
from ..mesh.joining import Placed, joined, require_faces
from ..mesh.model import TetMesh
from ..mesh.sharing import shared_nodes
from ..model.state import Flags, Floats, Indices, Ints
from .pieces import pieces
from .setting import turned


@dataclass
class Stacked:
    """Table of all nodes and tets of a case."""

    points: Floats
    """(n, 3) positions after the rotation of their part, m."""
    tets: Indices
    """(m, 4) indices of the nodes of each tet."""
    tet_part: Indices
    node_part: Indices
    """(n,) part of each node. For a node of several parts it is the first of these parts."""
    body: Indices
    """(n,) the body of each node. A body is a part, a piece of a part, or several parts and pieces joined by bonds."""
    part_of_body: Ints
    """(bodies,) the first part of each body. The array also has entries of bodies that were joined to another body."""
    stands: Ints
    """(bodies,) the body to which each body was joined; the body itself if it was not joined."""
    across: Indices
    """(m, 4) neighbours of the faces of each tet (state.Block.across); (0, 4) if no stage needs the neighbours."""
    warnings: list[str]
    read: dict[int, tuple[TetMesh, Ints]]
    """Dictionary from part numbers to pairs: a mesh from a file, and the global indices of its nodes. The dictionary is
    empty if the case refers to no set."""

    def any_of_body(self, allowed: Flags) -> Flags:
        """Return (bodies, bodies) True for each pair of bodies that can be in contact.

        ``allowed`` (bodies, bodies): True for each pair of bodies whose parts can be in contact. A joined body can be
        in contact with every body with which one of its parts can be in contact.
        """
        met, (one, other) = np.zeros_like(allowed), np.nonzero(allowed)
        met[self.stands[one], self.stands[other]] = True
        return met


def stacked(case: Case, meshes: Iterable[tuple[int, TetMesh]], overlaps: bool) -> Stacked:
    """Return one mesh made from all ``meshes``, in their order. Each mesh is given with its part number. Raises
    MeshError, InputError.

    ``overlaps``: True if the function searches for overlaps between pieces of a part.
    """
    points, tets, tet_part, node_part, warnings = [], [], [], [], list[str]()
    bodies, part_of_body, placed, n = [], list[int](), dict[int, Placed](), 0
    read, on_sets = dict[int, tuple[TetMesh, Ints]](), bool(ons(case))
    for index, mesh in meshes:
        piece, more = pieces(case, index, mesh, overlaps)
        warnings += more
        bodies.append(piece + len(part_of_body))
        part_of_body += [index] * (int(piece.max(initial=0)) + 1)
        points.append(turned(mesh.points, case.parts[index].turn))
        placed[index] = n, mesh.origin, points[-1]
        if on_sets and mesh.origin is not None:
            read[index] = mesh, n + np.arange(len(mesh.points))
        tets.append(mesh.tets.astype(np.int64) + n)
        node_part.append(np.full(len(mesh.points), index, np.int32))
        tet_part.append(np.full(len(mesh.tets), index, np.int32))
        n += len(mesh.points)
    for refusal in shared_nodes(case, [(i, o, x) for i, (_, o, x) in placed.items() if o is not None]):
        raise MeshError(refusal)
    made = Stacked(
        np.concatenate(points), np.concatenate(tets).astype(np.int32), np.concatenate(tet_part),
        np.concatenate(node_part), np.concatenate(bodies), np.array(part_of_body), np.arange(len(part_of_body)),
        np.zeros((0, 4), np.int32), warnings, read,
    )  # fmt: skip
    several = _join(made, joined(case, placed, n))
    if several or case.in_contact or case.fractures:
        made.across = across(made.tets)
    if several:
        require_faces(case, placed, made.across, made.tet_part)
    return made


def _join(made: Stacked, stands: Ints) -> bool:
    """Merge nodes. Return True if any nodes were merged. ``stands`` (n,): the node that replaces each node."""
    kept = np.flatnonzero(stands == np.arange(len(stands)))
    if len(kept) == len(stands):
        return False
    edges = np.column_stack([made.body, made.body[stands]])
    made.stands = components(len(made.part_of_body), np.unique(edges, axis=0))
    made.body = made.stands[made.body].astype(np.int32)
    places = np.searchsorted(kept, stands)
    made.tets = places[made.tets].astype(np.int32)
    made.read = {part: (mesh, places[nodes]) for part, (mesh, nodes) in made.read.items()}
    made.points, made.node_part, made.body = made.points[kept], made.node_part[kept], made.body[kept]
    return True
