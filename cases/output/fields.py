"""The fields of frames that only some cases have: ``damage``, ``fragment``, and the fields of ``run.fields``."""

from ..model.joined import cohesive
from ..model.schema import Case
from ..reading.library import material


def counting(case: Case) -> set[int]:
    """Indices of the parts of a case whose material has a law with damage."""
    laws = [material(case, part.material).strength for part in case.parts]
    return {i for i, law in enumerate(laws) if law is not None and law.counts_damage}


def damageable(case: Case) -> bool:
    """Whether the frames of the case have the field ``damage``: damage of a law, damage of cohesive facets, or plastic
    strain divided by the erosion limit.
    """
    strained = any(part.erosion is not None and part.erosion.plastic_strain is not None for part in case.parts)
    return bool(cohesive(case)) or strained or bool(counting(case))


def lacking(case: Case) -> set[str]:
    """The optional fields that no frame of the case has."""
    asked = {name: name in case.run.fields for name in ("density", "strain_rate", "contact_pressure")}
    there = {"damage": damageable(case), "fragment": case.fractures, **asked}
    there["effective_strain"] = "strain" in case.run.fields
    return {name for name, has in there.items() if not has}
