"""Construction of the rigid bodies of a case, at the start of a run or when a run resumes."""

from typing import Any

import numpy as np

from conoid.cases.model.schema import Case, Symmetry

from ..boundaries.wall_shapes import Walls
from ..model.state import Model
from ..parallel.comm import Comm
from ..scene import conditions
from .bodies import measured
from .motion import Held
from .stage import Rigid


def rigid_of(
    case: Case, model: Model, walls: Walls, comm: Comm, known: dict[str, Any] | None = None
) -> Rigid | None:  # fmt: skip
    """Returns the rigid bodies of a case; None if no part is rigid. ``known``: state in a parcel (a checkpoint or
    migration message), if the run resumes. Collective. Raises the same InputError on every rank if a body starts behind
    a wall.
    """
    if not case.rigid:
        return None
    beside = conditions.bodies_beside(case, model, comm)
    planes = np.array([index for index, _ in case.boundaries_of(Symmetry)], np.int64)
    held = [Held.of(case, case.parts[index], planes[beside[:, index] != 0].tolist()) for index in case.rigid]
    if known is None:
        bodies = measured(case, model.nodes, held, comm)
        rigid = Rigid(case, model.nodes, bodies, walls, beside, comm)
        rigid.require_front(case, model.size)
    else:
        rigid = Rigid(case, model.nodes, Rigid.kept_bodies(known, held), walls, beside, comm)
        rigid.resume(known)
    rigid.begin(model.nodes)
    return rigid
