"""The runs of a convergence study, with the keys that each run changes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from conoid.cases.figures import number
from conoid.cases.load import material
from conoid.cases.model.bodies import Loose, MeshFile
from conoid.cases.model.schema import Case

from ..errors import UsageError
from .scatter import perturbations

FORMS = ("standard", "nodal", "split")
STEPS, SEEDS = "steps", "seeds"
"""Names of what differs between the members of an ensemble: time steps, or seeds of scattered strengths."""


@dataclass(frozen=True)
class Variant:
    """A numerical method: pressure form and factor of the time step."""

    form: str
    safety: float

    def __str__(self) -> str:
        """Name of the variant in tables."""
        return f"{self.form}, dt_safety {number(self.safety)}"


@dataclass(frozen=True)
class Point:
    """A run of the study: a variant on one mesh, and its number in the ensemble."""

    variant: Variant
    factor: float
    """Factor on the element sizes of the case."""
    member: int
    changes: Mapping[str, Any]
    """Changed keys of the case with their new values."""


@dataclass(frozen=True)
class Plan:
    """Parameters that a convergence study varies."""

    factors: Sequence[float]
    forms: Sequence[str] = ()
    """Pressure forms; if empty, the form of the case."""
    safeties: Sequence[float] = ()
    """Values of dt_safety; if empty, the value of the case."""
    members: int = 1
    vary: str = STEPS
    ranks: int = 1
    threads: int = 1

    def variants(self, case: Case) -> list[Variant]:
        """Returns all combinations of pressure forms and time steps."""
        forms, safeties = self.forms or (case.numerics.pressure,), self.safeties or (case.numerics.dt_safety,)
        return [Variant(form, safety) for form in forms for safety in safeties]

    def points(self, case: Case) -> list[Point]:
        """Returns all runs of the study, the most expensive run first. Raises UsageError if the case has no mesh
        whose element size can change.
        """
        shares = perturbations(self.members) if self.vary == STEPS else [0.0] * self.members
        return [
            Point(variant, factor, member, {
                **sizes(case, factor), **(seeds(case, member) if self.vary == SEEDS else {}),
                "numerics.pressure": variant.form, "numerics.dt_safety": variant.safety * (1.0 - shares[member]),
                "run.ranks": self.ranks, "run.threads": self.threads, "run.frames": 0, "run.snapshots": 0,
                "run.checkpoint_every": "none",
            })
            for factor in sorted(self.factors) for variant in self.variants(case) for member in range(self.members)
        ]  # fmt: skip


def sizes(case: Case, factor: float) -> dict[str, float]:
    """Returns the keys of all element sizes with values multiplied by ``factor``. Sizes of mesh files and of loose
    tets do not change. Raises UsageError if no part has a generated mesh.
    """
    found: dict[str, float] = {}
    for index, part in enumerate(case.parts):
        mesh = part.mesh
        if isinstance(mesh, MeshFile | Loose):
            continue
        key = f"parts[{index}].mesh"
        found[f"{key}.element_size"] = factor * mesh.element_size
        if mesh.grading is not None:
            found[f"{key}.grading.far_size"] = factor * mesh.grading.far_size
    if not found:
        raise UsageError(f"{case.name}: no part has a generated mesh, so there is no element size to change")
    return found


def seeds(case: Case, member: int) -> dict[str, int]:
    """Returns the keys of the seeds of scattered strengths with their values for a member. Raises UsageError if no
    material has a scatter.
    """
    found = {}
    for name in {part.material for part in case.parts if part.fracture is not None}:
        scatter = getattr(material(case, name).brittle, "scatter", None)
        if scatter is not None and name in case.materials:
            found[f"materials.{name}.brittle.scatter.seed"] = scatter.seed + member
    if not found:
        raise UsageError(
            f"{case.name}: no material that the case defines has a scattered strength; use --vary steps instead"
        )
    return found


def chaotic(case: Case) -> bool:
    """Returns True if the answer of the case is sensitive to small changes, because parts break or erode."""
    return case.fractures or case.erodes
