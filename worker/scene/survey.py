"""Measurements of the mesh files of a case: ``python -m conoid.worker.scene.survey``.

The process reads one question from standard input and writes one answer to standard output
(conoid.cases.reading.survey). Child processes read the mesh files, with the same limits as a run, and store the meshes
in the cache that runs use. Therefore a run does not read the files again.
"""

import sys
from pathlib import Path

from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.cases.model.solids import Measured
from conoid.cases.reading import survey
from conoid.cases.reading.survey import Survey

from ..errors import ConoidError
from ..kernels import compile as ahead
from ..kernels import store
from ..mesh.build import build
from ..mesh.child import Limits, limit
from ..mesh.model import TetMesh
from ..mesh.sharing import Placed, shared_nodes
from . import counting
from .facts import Facts
from .joint import built_together, grouped
from .setting import turned


def surveyed(case: Case, folder: Path, compiled: bool = True) -> Survey:
    """Read the mesh files of all parts and report the errors of each file.

    If all files can be used, start a trial run with the meshes, up to its first step. If kernels are not ``compiled``,
    the trial run does not search for overlaps of bodies.
    """
    facts, refused, placed, meshes = Facts(case), list[str](), list[Placed](), dict[int, TetMesh]()
    for index, part in enumerate(case.parts):
        if not isinstance(part.mesh, Measured):
            continue
        try:
            meshes |= _made(case, index, folder, meshes)
        except ConoidError as error:
            refused += [] if str(error) in refused else [str(error)]
            continue
        mesh = meshes[index]
        facts.take(index, mesh)
        if mesh.origin is not None:
            placed.append((index, mesh.origin, turned(mesh.points, part.turn)))
    try:
        loads = list(counting.loads(case, meshes))
    except ConoidError as error:
        return Survey(parts=facts.parts, refused=[*refused, str(error)])
    refused += [*shared_nodes(case, placed), *counting.empty(case, loads)]
    if refused:
        return Survey(parts=facts.parts, loads=loads, refused=refused)
    try:
        warnings = _begun(case, meshes, compiled)
    except ConoidError as error:
        return Survey(parts=facts.parts, loads=loads, refused=[str(error)])
    return Survey(parts=facts.parts, loads=loads, touching=facts.survey().touching, warnings=warnings)


def _made(case: Case, index: int, folder: Path, there: dict[int, TetMesh]) -> dict[int, TetMesh]:
    """Return a dictionary from part numbers to meshes: part ``index``, and the parts meshed together with it. The
    dictionary is empty if ``there`` already has the part.
    """
    if index in there:
        return {}
    group = grouped(case, index)
    if len(group) > 1:
        return built_together(case, group, folder)
    return {index: build(case.parts[index].mesh, folder, key=f"parts[{index}].mesh")}


def _begun(case: Case, meshes: dict[int, TetMesh], compiled: bool) -> list[str]:
    """Return the warnings of the trial start of a run.

    The module of the trial start is imported inside of the function, because the folder of numba's cache must be set
    first.
    """
    from .beginning import begun

    return begun(case, meshes, compiled) if meshes else []


def main() -> int:
    """Answer the question on standard input; return the exit code."""
    asked = survey.read_question(sys.stdin.buffer.read())
    limit(Limits().allowed())
    compiled = (store.use_cache() / ahead.COMPLETE).exists()
    found = surveyed(parse_case(asked.case), Path(asked.folder), compiled)
    sys.stdout.buffer.write(survey.to_json(found) + b"\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
