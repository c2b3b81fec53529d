"""How fast bodies meet, and what that asks of contact."""

import math

from .library import material
from .materials import Material
from .schema import Case, Part, Wall

FEW, MANY = 5, 10
"""Sweeps of contact in a step; what more are good for: docs/numerics.md, "Contact"."""
FAST = 0.2
"""Of the wave speed of what is met: above it there are MANY sweeps. Chosen: below half of where few were too few for
columns of metal (docs/numerics.md, "Plates under 100 GPa")."""
PRESSING = 0.1
"""Of the same: above it flat surfaces buckle. Chosen: half of where irregular plates of copper lost their pressure
(docs/numerics.md, "Ridges under pressure")."""


def wave_speed(made: Material) -> float:
    """Speed of plane waves at rest, m/s: sqrt((K + 4 G / 3) / density), K from the equation of state where given."""
    return math.sqrt((made.bulk + 4.0 / 3.0 * made.elastic.shear) / made.density)


def impact_speed(case: Case, part: Part, walls: bool = True) -> float:
    """The largest speed, m/s, at which a part may meet another part, or a wall where ``walls`` count."""
    met = [other.velocity for other in case.parts if other is not part]
    met += [(0.0, 0.0, 0.0) for boundary in case.boundaries if walls and isinstance(boundary, Wall)]
    return max((math.dist(part.velocity, velocity) for velocity in met), default=0.0)


def _fast(case: Case, share: float) -> bool:
    """Whether two parts meet at more than a ``share`` of the wave speed of one of them."""
    return any(
        impact_speed(case, part, walls=False) > share * wave_speed(material(case, part.material)) for part in case.parts
    )


def pressed(case: Case) -> bool:
    """Whether parts meet so fast that they are pressed together beyond their strength: flat surfaces buckle there."""
    return _fast(case, PRESSING)


def sweeps(case: Case) -> int:
    """Sweeps over the active contacts of a step: what ``contact.sweeps`` says, or what the scene needs."""
    assert case.contact is not None
    if case.contact.sweeps is not None:
        return case.contact.sweeps
    fast = _fast(case, FAST) and not case.fractures
    return MANY if fast or case.contact.restitution > 0.0 else FEW
