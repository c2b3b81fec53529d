"""Errors and warnings about boundaries without effect, found before there is a mesh."""

from collections.abc import Iterator

from ..model.boundaries import Prescribed, Traction
from ..model.schema import Case, Part
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.loaded import block_faces, loads, parts_of, planes_of
from ..shapes.placed import Placed
from ..shapes.region import Region


def idle(case: Case, number: int) -> Iterator[Problem]:
    """Yields an error for a boundary whose box contains no node (or no face, for a traction) of structured blocks that
    are not turned.
    """
    spec = case.boundaries[number]
    assert isinstance(spec, Prescribed | Traction)
    if all(_empty(part, spec) for part in parts_of(case, spec)):
        what = "node" if isinstance(spec, Prescribed) else "face"
        message = f"no {what} of the bodies lies in the box; enlarge the box beyond the intended nodes"
        yield problem(("boundaries", number), ..., message)


def _empty(part: Part, spec: Traction | Prescribed) -> bool:
    """Whether it is certain that the box of a boundary contains no node or face of a part."""
    if isinstance(part.mesh, Measured):
        return False
    body, region = Placed(part.mesh, part.turn), Region.of(spec)
    planes = planes_of(body, region)
    if planes is None:
        return False
    return 0 in planes if isinstance(spec, Prescribed) else block_faces(body, region) is None


def unloaded(case: Case) -> Iterator[Problem]:
    """Yields a warning for each boundary whose region probably contains no face or node."""
    for load in loads(case):
        if load.faces == 0 or load.nodes == 0:
            what = "face" if load.faces == 0 else "node"
            message = f"probably no {what} of the bodies lies in the region; if none does, the run ends with an error"
            yield problem(("boundaries", load.boundary), ..., message)
