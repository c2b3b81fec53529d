"""Which fields of frames a case has, of those that not every case has: ``damage``, ``fragment``, and those that
``run.fields`` asks for.
"""

from ..model.joined import cohesive
from ..model.schema import Case
from ..reading.library import material


def counting(case: Case) -> set[int]:
    """The parts of a case whose material's law counts damage."""
    laws = [material(case, part.material).strength for part in case.parts]
    return {i for i, law in enumerate(laws) if law is not None and law.counts_damage}


def damageable(case: Case) -> bool:
    """Whether anything is damaged: by its law, by cohesive facets that let go, or on the way to a strain of erosion."""
    strained = any(part.erosion is not None and part.erosion.plastic_strain is not None for part in case.parts)
    return bool(cohesive(case)) or strained or bool(counting(case))


def lacking(case: Case) -> set[str]:
    """Those of them that no frame of the case has."""
    asked = {name: name in case.run.fields for name in ("density", "strain_rate", "contact_pressure")}
    there = {"damage": damageable(case), "fragment": case.fractures, **asked}
    there["effective_strain"] = "strain" in case.run.fields
    return {name for name, has in there.items() if not has}
