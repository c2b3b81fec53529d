"""Trial start of a run before its submission. The trial gives the errors and warnings that the start of the run would
give.
"""

from collections.abc import Mapping

from conoid.cases.model.schema import Case

from ..mesh.model import TetMesh
from ..parallel.comm import SerialComm
from . import conditions, domain, selection, starting
from .assembly import assembled


def begun(case: Case, meshes: Mapping[int, TetMesh], compiled: bool) -> list[str]:
    """Return the warnings that a run gives up to its first step. Raises the InputError or MeshError that the start of
    the run would raise.

    ``meshes``: dictionary from part numbers to meshes, of all parts or of the parts from files; ``compiled``: True if
    kernels are compiled. The function searches for overlaps only if kernels are compiled.
    """
    whole, comm = assembled(case, meshes.items(), compiled), SerialComm()
    model, piece = domain.alone(case, whole)
    scene = conditions.build(case, model, piece.loads, piece.neighbours, comm)
    known = selection.settled(case, meshes)
    return [*whole.warnings, *starting.start(case, model, scene, comm, known)]
