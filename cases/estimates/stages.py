"""The stages of a case: operations of a time step that only some scenes need. Operations that the scene does not need
are not computed.
"""

from ..model.boundaries import Wall
from ..model.joined import cohesive
from ..model.schema import Case
from ..reading.library import material

TETS, STEPS, AVERAGED, STRENGTH, STATE, CONTACT = (
    "tets", "start and steps", "averaged pressure", "strength", "equation of state", "contact",
)  # fmt: skip
"""Names of the stages whose cost is estimated before a run (cases/estimates/estimate.py). Every case has the first two
stages."""


def stages(case: Case) -> dict[str, bool]:
    """Returns whether the case has each optional stage, by the name of the stage. Raises CaseError if a material is
    unknown.
    """
    made = [material(case, part.material) for part in case.parts if part.rigid is None]
    contact = case.contact if case.in_contact else None
    rubbing = [wall.friction for _, wall in case.boundaries_of(Wall)]
    if contact is not None:
        rubbing += [contact.friction, *(pair.friction for pair in contact.pairs)]
    return {
        AVERAGED: case.numerics.pressure != "standard",
        STRENGTH: any(one.strength is not None for one in made),
        STATE: any(one.eos is not None for one in made),
        "viscosity": case.numerics.viscosity is not None,
        CONTACT: contact is not None,
        "sharp edges": contact is not None and contact.edges,
        "friction": any(friction > 0.0 for friction in rubbing),
        "restitution": contact is not None and contact.restitution > 0.0,
        "fracture": case.fractures,
        "cohesive facets": bool(cohesive(case)),
        "erosion": case.erodes,
        "rigid parts": bool(case.rigid),
    }


def without(case: Case) -> list[str]:
    """Names of the optional stages that the case does not have."""
    return [name for name, there in stages(case).items() if not there]
