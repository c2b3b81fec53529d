"""What the mesh files of a case hold: ``python -m conoid.worker.survey``.

One question on standard input, one answer on standard output (conoid.cases.survey). Files are read by child processes
with limits, as for a run, and kept as for a run: one that follows does not read them again.
"""

import sys
from pathlib import Path

import numpy as np

from conoid.cases import survey
from conoid.cases.bodies import MeshFile
from conoid.cases.library import material
from conoid.cases.load import parse_case
from conoid.cases.placed import driven
from conoid.cases.schema import Case
from conoid.cases.survey import Survey, Surveyed

from . import counting
from .errors import ConoidError
from .mesh.build import build
from .mesh.child import Limits, limit
from .mesh.faces import FACES, areas, boundary_faces
from .mesh.model import Floats, TetMesh
from .mesh.sharing import Placed, shared_nodes
from .mesh.touching import Surface, touches
from .setting import turned, velocities
from .state import Indices


def surveyed(case: Case, folder: Path) -> Survey:
    """Reads the files of all parts; what is wrong with one of them hides nothing that is wrong with another."""
    parts, refused, placed = list[Surveyed](), list[str](), list[Placed]()
    surfaces, meshes = dict[int, Surface](), dict[int, tuple[Floats, Indices]]()
    for index, part in enumerate(case.parts):
        if not isinstance(part.mesh, MeshFile):
            continue
        try:
            mesh = build(part.mesh, folder, key=f"parts[{index}].mesh")
        except ConoidError as error:
            refused.append(str(error))
            continue
        points = turned(mesh.points, part.turn)
        surfaces[index], meshes[index] = (points, boundary_faces(mesh.tets)), (points, mesh.tets)
        parts.append(_facts(case, index, mesh, surfaces[index]))
        if mesh.origin is not None:
            placed.append((index, mesh.origin, points))
    loads = list(counting.loads(case, meshes))
    refused += [*shared_nodes(case, placed), *counting.empty(case, loads)]
    touching = [] if refused else list(touches(case, surfaces))
    return Survey(parts=parts, loads=loads, refused=refused, touching=touching)


def _facts(case: Case, index: int, mesh: TetMesh, surface: Surface) -> Surveyed:
    points, faces = surface
    part = driven(case, case.parts[index])
    volumes = mesh.volumes()
    quarters = np.repeat(volumes / 4.0, 4)
    masses = material(case, part.material).density * np.bincount(mesh.tets.reshape(-1), quarters, len(points))
    v = velocities(part, points)
    squares = (v * v).sum(axis=1)
    low, high, momentum = points.min(axis=0), points.max(axis=0), (masses[:, None] * v).sum(axis=0)
    return Surveyed(
        part=index, elements=len(mesh.tets), nodes=len(points), faces=len(faces),
        step_length=float(mesh.step_lengths().min()), altitude=_smallest_altitude(mesh, volumes),
        mass=float(masses.sum()), low=tuple(low.tolist()), high=tuple(high.tolist()),
        momentum=tuple(momentum.tolist()), energy=float(0.5 * (masses * squares).sum()),
        speed=float(np.sqrt(squares.max())), notes=list(mesh.origin.notes if mesh.origin is not None else ()),
    )  # fmt: skip


def _smallest_altitude(mesh: TetMesh, volumes: Floats) -> float:
    """m: three times the volume of a tet over its largest face."""
    largest = areas(mesh.points, mesh.tets[:, FACES].reshape(-1, 3)).reshape(-1, 4).max(axis=1)
    return float((3.0 * volumes / largest).min())


def main() -> int:
    """Answers the question on standard input; the exit code."""
    asked = survey.read_question(sys.stdin.buffer.read())
    limit(Limits().allowed())
    found = surveyed(parse_case(asked.case), Path(asked.folder))
    sys.stdout.buffer.write(survey.to_json(found) + b"\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
