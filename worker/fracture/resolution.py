"""Resolution of fracture by the mesh. Two ratios are checked: element size to length of the cohesive zone, and opening
in one time step to critical opening.
"""

import logging
import math

from conoid.cases.model.schema import Part

from ..materials.elementary import power
from .strength import Toughness

_RESOLVED = 1.0 / 3.0
"""Largest ratio of element size to length of the cohesive zone at which the dissipated energy still equals the fracture
energy of the law."""
_STEP = 1.0 / math.sqrt(6.0)
"""Stable time step of a regular tet, multiplied by the wave speed and divided by the length of an edge."""
_REGULAR = 6.0 * math.sqrt(2.0)
"""Cube of the edge length of a regular tet, divided by its volume."""
_ROUNDING = 1e-9
"""Relative tolerance of the ratio of element size to cohesive zone. If the strength was lowered to reach a given ratio,
the computed ratio has round-off."""
_NAMED = 5
"""Largest number of parts named in a warning. Chosen value."""

log = logging.getLogger("conoid.worker")


def edge(volume: float) -> float:
    """Returns the edge length, m, of a regular tet of this ``volume``, m^3."""
    return float(power(_REGULAR * volume, 1.0 / 3.0))


def warnings(part: Part, tough: Toughness, size: float, safety: float) -> list[str]:
    """Returns the warnings for a part with tets of edge ``size``, m; ``safety``: safety factor of the time step.

    The opening of a facet in one time step is estimated from the release of its stress and from the initial stretch
    rate of the part.
    """
    spec = part.fracture
    assert spec is not None
    step = safety * _STEP * size / tough.speed
    ratio, found = size / tough.zone, []
    log.info(
        "%s breaks at %.4g MPa with %.4g J/m^2: cohesive zone %.3g mm, elements %.3g mm, %.3g to 1",
        part.name, tough.strength * 1e-6, tough.energy, tough.zone * 1e3, size * 1e3, ratio,
    )  # fmt: skip
    if text := unresolved(tough, size):
        lower = "fracture.resolve = 'strength' keeps the energy and lowers the strength"
        more = f"fracture.resolution = {1.0 / _RESOLVED:.0f} keeps the energy and lowers the strength further"
        found.append(f"{text}; {more if spec.resolve == 'strength' else lower}")
    drawn = max(*part.stretch.rate, 0.0) if part.stretch is not None else 0.0
    opening = (tough.strength / tough.impedance + drawn * size) * step
    if spec.model == "cohesive" and opening > tough.critical:
        found.append(
            f"a facet that breaks would open by {opening * 1e6:.3g} um in a step of {step * 1e9:.3g} ns, and fails at "
            f"{tough.critical * 1e6:.3g} um: the time step does not resolve the law; use fracture.model = 'instant', "
            f"fracture.resolve = 'strength', or numerics.dt_safety below {safety * tough.critical / opening:.2g}"
        )
    return found


def unresolved(tough: Toughness, size: float) -> str:
    """Returns a warning if elements with the edge ``size``, m, do not resolve the cohesive zone, else an empty text."""
    ratio = size / tough.zone
    if ratio <= _RESOLVED * (1.0 + _ROUNDING):
        return ""
    return (
        f"elements of {size * 1e3:.3g} mm in a cohesive zone of {tough.zone * 1e3:.3g} mm, "
        f"{ratio:.3g} to 1, resolved below {_RESOLVED:.2g}: the dissipated energy depends on the mesh"
    )


def merged(found: dict[str, list[str]]) -> list[str]:
    """Merges equal warnings of several parts. Returns one line for each warning, with the names of the first few
    parts.
    """
    return [f"{_listed(names)}: {text}" for text, names in found.items()]


def _listed(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
