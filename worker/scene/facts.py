"""Measurements of meshes from files at the start of a run: size, mass, momentum, energy, and contact between the
surfaces of the meshes.
"""

import numpy as np

from conoid.cases.model.schema import Case
from conoid.cases.reading.library import material
from conoid.cases.reading.survey import Survey, Surveyed
from conoid.cases.shapes.placed import driven, with_inertia

from ..mesh.faces import FACES, areas, boundary_faces
from ..mesh.model import Floats, TetMesh
from ..mesh.touching import Surface, touches
from .setting import turned, velocities


class Facts:
    """Measurements of the parts of a case. The meshes are added one by one."""

    def __init__(self, case: Case) -> None:
        """Create an object without measured parts."""
        self._case = case
        self.parts: list[Surveyed] = []
        self._surfaces: dict[int, Surface] = {}

    def take(self, index: int, mesh: TetMesh) -> None:
        """Measure the mesh of part ``index``."""
        points = turned(mesh.points, self._case.parts[index].turn)
        self._surfaces[index] = points, boundary_faces(mesh.tets)
        self.parts.append(_measured(self._case, index, mesh, self._surfaces[index]))

    def survey(self) -> Survey:
        """Return all measurements, and the pairs of parts that touch."""
        return Survey(parts=self.parts, touching=list(touches(self._case, self._surfaces)))


def _measured(case: Case, index: int, mesh: TetMesh, surface: Surface) -> Surveyed:
    points, faces = surface
    part = driven(case, case.parts[index])
    volumes = mesh.volumes()
    quarters = np.repeat(volumes / 4.0, 4)
    masses = material(case, part.material).density * np.bincount(mesh.tets.reshape(-1), quarters, len(points))
    if part.rigid is not None and part.rigid.mass is not None:
        masses *= part.rigid.mass / float(masses.sum())
    v = velocities(part, points)
    squares = (v * v).sum(axis=1)
    low, high, x = points.min(axis=0), points.max(axis=0), (masses[:, None] * points).sum(axis=0) / masses.sum()
    momentum, energy = with_inertia(part, float(masses.sum()), (float(x[0]), float(x[1]), float(x[2]))) or (
        tuple((masses[:, None] * v).sum(axis=0).tolist()), float(0.5 * (masses * squares).sum())
    )  # fmt: skip
    return Surveyed(
        part=index, elements=len(mesh.tets), nodes=len(points), faces=len(faces),
        step_length=float(mesh.step_lengths().min()), altitude=_smallest_altitude(mesh, volumes),
        mass=float(masses.sum()), low=tuple(low.tolist()), high=tuple(high.tolist()),
        momentum=momentum, energy=energy,
        speed=float(np.sqrt(squares.max())), notes=list(mesh.origin.notes if mesh.origin is not None else ()),
    )  # fmt: skip


def _smallest_altitude(mesh: TetMesh, volumes: Floats) -> float:
    """Return the smallest altitude of all tets, m. The smallest altitude of one tet is three times its volume divided
    by the area of its largest face.
    """
    largest = areas(mesh.points, mesh.tets[:, FACES].reshape(-1, 3)).reshape(-1, 4).max(axis=1)
    return float((3.0 * volumes / largest).min())
