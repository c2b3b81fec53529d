"""Pieces of a part from a mesh file. Two pieces of a part have no common node; the module detects overlaps between
pieces, and allows contact between them.
"""

from collections.abc import Iterator

import numpy as np

from conoid.cases.figures import counted
from conoid.cases.model.schema import Case
from conoid.cases.model.solids import Measured

from ..contact import part_pairs
from ..contact.checks import overlap
from ..errors import InputError
from ..fracture.connectivity import components
from ..mesh import unjoined
from ..mesh.faces import boundary_faces
from ..mesh.model import TetMesh
from ..model.state import Indices

_MANY = 1_000
"""Largest number of pieces of a part for which overlaps between the pieces are searched for. Chosen value: the size of
the table of pairs is proportional to the square of the number of pieces."""
UNSEEN = "overlaps of bodies are checked when the run starts, because kernels are not compiled yet"
"""Warning that the run does not search for overlaps."""


def pieces(case: Case, index: int, mesh: TetMesh, overlaps: bool) -> tuple[Indices, list[str]]:
    """Return (nodes,) the number of the piece of each node, and warnings. The numbers of all pieces are zero unless the
    mesh is from a file and the part has contact with itself.

    Unmerged coincident nodes, which are a common error of meshes, give a warning. ``overlaps``: True if the function
    searches for overlaps of pieces without contact. Raises InputError if pieces without contact have volume in common,
    because the mass of the common volume would be counted twice.
    """
    if not isinstance(case.parts[index].mesh, Measured):
        return np.zeros(len(mesh.points), np.int32), []
    doubled = [f"parts[{index}].mesh: {note}" for note in unjoined.notes(mesh.points, boundary_faces(mesh.tets))]
    piece, warnings = _numbered(case, index, mesh, overlaps)
    return piece, [*warnings, *doubled]


def _numbered(case: Case, index: int, mesh: TetMesh, overlaps: bool) -> tuple[Indices, list[str]]:
    """Return the result of ``pieces`` for a mesh from a file, without warnings about faces."""
    whole = np.zeros(len(mesh.points), np.int32)
    sides = np.concatenate([mesh.tets[:, [0, k]] for k in (1, 2, 3)])
    first, of = np.unique(components(len(mesh.points), sides), return_inverse=True)
    piece: Indices = np.asarray(of.reshape(-1), np.int32)
    many, found = len(first), f"parts[{index}].mesh: {len(first)} pieces that share no node"
    if many == 1:
        return whole, []
    if many > _MANY:
        return whole, [f"{found}: overlaps between them at the start are checked for {_MANY} pieces at most"]
    if case.contact is not None and not np.isnan(part_pairs.friction(case)[index, index]):
        return piece, []
    warnings = [
        f"{found}, without contact between them: merge coincident nodes, or give the part contact with itself "
        "(contact.self_contact)"
    ]
    return whole, [*warnings, *(_doubled(case, index, mesh, piece) if overlaps else [f"parts[{index}].mesh: {UNSEEN}"])]


def _doubled(case: Case, index: int, mesh: TetMesh, piece: Indices) -> Iterator[str]:
    """Yield a warning if nodes of a piece are inside of another piece. Raises InputError if the centre of a tet is
    inside of another piece.
    """
    inside, tets = overlap.within(mesh.points, mesh.tets, piece)
    if len(tets):
        volumes, at = mesh.volumes(), mesh.points[mesh.tets[tets[0]]].mean(axis=0)
        place = ", ".join(f"{c:.6g}" for c in at)
        raise InputError(
            f"parts[{index}].mesh: pieces of {case.parts[index].name!r} that share no node overlap: about "
            f"{0.5 * volumes[tets].sum():.3g} of {volumes.sum():.3g} m^3 are counted twice, for example at ({place}) "
            "m; check whether the file has an instance twice"
        )
    if len(inside):
        yield (
            f"parts[{index}].mesh: {counted(len(inside), 'node')} of pieces that share no node "
            f"{'lies' if len(inside) == 1 else 'lie'} inside of other pieces: a part of the volume is counted twice"
        )
