"""How far the worst tet of a mesh is from the others, by step lengths."""

from dataclasses import dataclass

from conoid.worker.mesh.model import TetMesh


@dataclass(frozen=True)
class Quality:
    """Step lengths, m: ``worst`` decides the time step, ``mean`` is what the mesh could do if all tets were alike."""

    worst: float
    mean: float
    worst_tet: int

    @property
    def ratio(self) -> float:
        """Worst over mean; 1 for a mesh of equal tets."""
        return self.worst / self.mean


def quality(mesh: TetMesh) -> Quality:
    """Worst and mean step length of a mesh with at least one tet."""
    steps = mesh.step_lengths()
    worst = int(steps.argmin())
    return Quality(float(steps[worst]), float(steps.mean()), worst)
