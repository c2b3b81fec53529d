"""How a run would begin with the meshes that are there: what it would refuse, and what it would warn of."""

from collections.abc import Mapping

from conoid.cases.model.schema import Case

from ..mesh.model import TetMesh
from ..parallel.comm import SerialComm
from . import conditions, domain, selection, starting
from .assembly import assembled


def begun(case: Case, meshes: Mapping[int, TetMesh], compiled: bool) -> list[str]:
    """The warnings of a run up to its first step, by the ``meshes`` of parts by their numbers: all parts, or those that
    are from files. Raises InputError, MeshError where it would be refused. Overlaps are looked for by kernels, where
    these are ``compiled``.
    """
    whole, comm = assembled(case, meshes.items(), compiled), SerialComm()
    model, piece = domain.alone(case, whole)
    scene = conditions.build(case, model, piece.loads, piece.neighbours, comm)
    known = selection.settled(case, meshes)
    return [*whole.warnings, *starting.start(case, model, scene, comm, known)]
