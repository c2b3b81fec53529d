"""Overlap, at the start, of two parts with a tied bond. Contact does not detect an overlap of parts with a tied
bond.
"""

from collections.abc import Iterator

import numpy as np

from conoid.cases.model.bonds import GAP, TiedBond
from conoid.cases.model.schema import Case

from ..contact.checks import overlap
from ..errors import InputError
from ..mesh.faces import FACES
from ..mesh.faces import areas as face_areas
from ..model.state import Flags, Floats, Indices
from .interface import corners, tied_pairs
from .pieces import Pieces


def sunk(case: Case, x: Floats, tets: Indices, tet_part: Indices, exposed: Flags, tied: Pieces) -> Iterator[str]:
    """Yields a warning for each bond whose parts have nodes inside of each other after the ``tied`` nodes have been
    moved onto the mortar side. ``exposed`` (tets, 4): True for each exposed face. Raises InputError if a node of one
    part is deeper in the other part than the gap of the bond.
    """
    for k, one, two in tied_pairs(case):
        spec = case.bond[k]
        assert isinstance(spec, TiedBond)
        chosen = np.isin(tet_part, (one, two))
        mine, of = tets[chosen], np.zeros(len(x), np.int32)
        of[mine] = tet_part[chosen][:, None]
        tet, face = np.nonzero(exposed[chosen])
        faces = mine[tet[:, None], FACES[face]]
        if not len(faces):
            continue
        found = overlap.find(
            x, mine, of, overlap.Surface(faces, of[faces[:, 0]], exposed[chosen]), _both(case, one, two)
        )
        deepest = float(found.depth.max(initial=0.0))
        limit = spec.gap if spec.gap is not None else GAP * float(np.sqrt(2.0 * face_areas(x, faces).max()))
        if deepest > limit:
            raise InputError(
                f"bond[{k}].gap = {limit:.3g} m: {spec.parts[0]!r} and {spec.parts[1]!r} overlap by {deepest:.3g} m; "
                "move them apart, or raise it"
            )
        slaves = np.unique(corners(tied.slave[tied.bond == k], tets))
        mate = one if (tet_part[tied.slave[tied.bond == k] // 4] == two).all() else two
        left = (found.part == mate) & ~np.isin(found.nodes, slaves)
        if left.any():
            name, other, most = case.parts[one + two - mate].name, case.parts[mate].name, float(found.depth[left].max())
            yield (
                f"bond[{k}]: {int(left.sum())} nodes of {name!r} are not tied: they lie up to {most:.3g} m inside "
                f"{other!r}, more than bond[{k}].gap"
            )


def _both(case: Case, one: int, two: int) -> Flags:
    """(parts, parts) True for the pair of the parts ``one`` and ``two`` only."""
    allowed = np.zeros((len(case.parts), len(case.parts)), bool)
    allowed[one, two] = allowed[two, one] = True
    return allowed
