"""Ratio of the worst tet of a mesh to the mean tet, by step lengths; and number of tets at each face."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conoid.worker.mesh.faces import FACES
from conoid.worker.mesh.model import Ints, TetMesh


@dataclass(frozen=True)
class Quality:
    """Step lengths of a mesh, m: ``worst`` limits the time step, ``mean`` would limit the time step if all tets were
    equal.
    """

    worst: float
    mean: float
    worst_tet: int

    @property
    def ratio(self) -> float:
        """Returns the worst divided by the mean step length; 1 for a mesh of equal tets."""
        return self.worst / self.mean


def quality(mesh: TetMesh) -> Quality:
    """Returns worst and mean step length of a mesh with at least one tet."""
    steps = mesh.step_lengths()
    worst = int(steps.argmin())
    return Quality(float(steps[worst]), float(steps.mean()), worst)


def face_counts(tets: Ints) -> NDArray[np.int64]:
    """Returns (k,) the number of tets at each distinct face: 1 on the boundary, 2 inside, more than 2 only in a wrong
    mesh.
    """
    faces = np.sort(tets[:, FACES].reshape(-1, 3), axis=1)
    return np.asarray(np.unique(faces, axis=0, return_counts=True)[1])
