"""Overlaps between bodies at the start. An overlap is an error, or is removed by moving nodes."""

import numpy as np

from conoid.cases.model import schema

from ..bonds import interface
from ..contact import part_pairs
from ..contact.checks import overlap
from ..errors import InputError
from ..mesh.faces import FACES
from ..model.state import Floats
from .stacking import Stacked


def apart(case: schema.Case, made: Stacked) -> Floats:
    """Return the points of the bodies. If ``contact.overlap`` requests it, overlaps are removed by moving points.
    Raises InputError if bodies overlap.
    """
    assert case.contact is not None
    x, tets, body, part, exposed = made.points, made.tets, made.body, made.part_of_body, made.across < 0
    tet, face = np.nonzero(exposed)
    faces = tets[tet[:, None], FACES[face]]
    meets = ~np.isnan(part_pairs.friction(case))
    for _, one, two in interface.tied_pairs(case):
        meets[one, two] = meets[two, one] = False
    allowed = made.any_of_body(meets[part[:, None], part])
    surface = overlap.Surface(faces, body[faces[:, 0]], exposed)
    before, out_of = x, np.full(len(x), -1, np.int32)
    if case.contact.overlap == "push":
        x, out_of = overlap.move_apart(x, tets, body, surface, allowed)
    for tet in overlap.crushed(before, x, tets):
        node = tets[tet, np.argmax(out_of[tets[tet]])]
        raise _too_deep(case, part[body[node]], part[out_of[node]], before[node])
    found = overlap.find(x, tets, body, surface, allowed)
    if len(found.nodes):
        worst = int(np.argmax(found.depth))
        node = found.nodes[worst]
        raise _overlapping(case, part[body[node]], part[found.part[worst]], found.depth[worst], x[node])
    for tet, other in overlap.nested(x, tets, body, surface, allowed):
        one, other = (part[body[tets[each, 0]]] for each in (tet, other))
        raise _too_deep(case, one, other, before[tets[tet]].mean(axis=0))
    for node, other in overlap.crossing(x, body, surface, allowed):
        raise _too_deep(case, part[body[node]], part[body[other]], before[node])
    return x


def _overlapping(case: schema.Case, one: int, other: int, depth: float, place: Floats) -> InputError:
    assert case.contact is not None
    way = "set contact.overlap = 'push'" if case.contact.overlap == "refuse" else "contact.overlap = 'push' could not"
    return InputError(
        f"parts: {_pair(case, one, other)} by {depth:.3g} m at ({_place(place)}) m; move them apart, or {way}"
    )


def _too_deep(case: schema.Case, one: int, other: int, place: Floats) -> InputError:
    return InputError(
        f"parts: {_pair(case, one, other)} at ({_place(place)}) m, deeper than contact.overlap = 'push' can undo; move "
        "them apart"
    )


def _pair(case: schema.Case, one: int, other: int) -> str:
    if one == other:
        return f"a piece of {case.parts[one].name!r} overlaps another of its pieces"
    return f"{case.parts[one].name!r} overlaps {case.parts[other].name!r}"


def _place(point: Floats) -> str:
    return ", ".join(f"{c:.6g}" for c in point)
