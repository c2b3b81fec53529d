"""Pieces of a part from a mesh file: bodies that share no node. What of them is there twice, and who may meet whom."""

from collections.abc import Iterator

import numpy as np

from conoid.cases.figures import counted
from conoid.cases.model.schema import Case
from conoid.cases.model.solids import Measured

from ..contact import part_pairs
from ..contact.checks import overlap
from ..errors import InputError
from ..fracture.connectivity import components
from ..mesh.model import TetMesh
from ..model.state import Indices

_MANY = 1_000
"""Pieces of a part beyond which nothing finds out whether they overlap each other. Chosen: the table of who meets whom
grows with their square."""
UNSEEN = "whether bodies overlap is found out by the run: kernels are not compiled here yet"
"""What is told where overlaps are not looked for."""


def pieces(case: Case, index: int, mesh: TetMesh, overlaps: bool) -> tuple[Indices, list[str]]:
    """(nodes,) which piece of its part each node belongs to, where the mesh is from a file and the part meets itself;
    else all to the first. And warnings: nodes that coincide and are not merged are the commonest slip in a mesh.

    ``overlaps``: whether pieces that do not meet each other are looked at, too. Raises InputError where these have
    volume in common: it would be there twice.
    """
    whole = np.zeros(len(mesh.points), np.int32)
    if not isinstance(case.parts[index].mesh, Measured):
        return whole, []
    sides = np.concatenate([mesh.tets[:, [0, k]] for k in (1, 2, 3)])
    first, of = np.unique(components(len(mesh.points), sides), return_inverse=True)
    piece: Indices = np.asarray(of.reshape(-1), np.int32)
    many, said = len(first), f"parts[{index}].mesh: {len(first)} pieces that share no node"
    if many == 1:
        return whole, []
    if many > _MANY:
        return whole, [f"{said}: whether they overlap each other at the start is found out for {_MANY} at most"]
    if case.contact is not None and not np.isnan(part_pairs.friction(case)[index, index]):
        return piece, []
    told = [
        f"{said}, and they do not meet each other: merge the nodes where they coincide, or let the part meet itself "
        "(contact.self_contact)"
    ]
    return whole, [*told, *(_doubled(case, index, mesh, piece) if overlaps else [f"parts[{index}].mesh: {UNSEEN}"])]


def _doubled(case: Case, index: int, mesh: TetMesh, piece: Indices) -> Iterator[str]:
    """A warning where nodes of a piece lie in another one; InputError where tets do, by their centres."""
    inside, tets = overlap.within(mesh.points, mesh.tets, piece)
    if len(tets):
        volumes, at = mesh.volumes(), mesh.points[mesh.tets[tets[0]]].mean(axis=0)
        place = ", ".join(f"{c:.6g}" for c in at)
        raise InputError(
            f"parts[{index}].mesh: pieces of {case.parts[index].name!r} that share no node overlap: about "
            f"{0.5 * volumes[tets].sum():.3g} of {volumes.sum():.3g} m^3 is there twice, at ({place}) m for one; is an "
            "instance there twice?"
        )
    if len(inside):
        yield (
            f"parts[{index}].mesh: {counted(len(inside), 'node')} of pieces that share no node "
            f"{'lies' if len(inside) == 1 else 'lie'} inside of other pieces: some volume is there twice"
        )
