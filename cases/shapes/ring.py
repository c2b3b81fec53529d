"""The angles around its axis that a ring sector covers, limited to its modelled part."""

import math

from ..model.bodies import RingSector

Angles = tuple[float, float]
"""Start and end of a range of angles, rad, measured from the first direction across the axis towards the second."""

_WINDOW: dict[str, Angles] = {"half": (-0.5 * math.pi, 0.5 * math.pi), "quarter": (0.0, 0.5 * math.pi)}
"""Ranges of the angles that ``half`` and ``quarter`` keep."""

_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Cosines and sines of the multiples of a quarter turn."""


def angles(mesh: RingSector) -> list[Angles]:
    """Returns the ranges of modelled angles: one range, or two if a plane of the sector cuts away the middle of the
    ring sector.
    """
    begin = math.remainder(mesh.start, 2.0 * math.pi)
    if mesh.sector == "full":
        return [(begin, begin + mesh.angle)]
    low, high = _WINDOW[mesh.sector]
    turns = (-2.0 * math.pi, 0.0, 2.0 * math.pi)
    found = [(max(low, begin + turn), min(high, begin + mesh.angle + turn)) for turn in turns]
    return [(a, b) for a, b in found if b - a > 1e-12]


def angle(mesh: RingSector) -> float:
    """Returns the total angle of these ranges, rad."""
    return math.fsum(b - a for a, b in angles(mesh))


def holds_angle(mesh: RingSector, x: float, y: float) -> bool:
    """Whether the direction (x, y) from the axis lies in a modelled range."""
    at = math.atan2(y, x)
    return any(a <= at + turn <= b for a, b in angles(mesh) for turn in (-2.0 * math.pi, 0.0, 2.0 * math.pi))


def extremes(mesh: RingSector, whole: bool = False) -> tuple[Angles, Angles]:
    """Lowest and highest value of each of the two coordinates across the axis, m, measured from the axis. ``whole``:
    whether the full body is used and not only its modelled part.
    """
    begin = math.remainder(mesh.start, 2.0 * math.pi)
    ranges = [(begin, begin + mesh.angle)] if whole else angles(mesh)
    x, y = list[float](), list[float]()
    for a, b in ranges:
        first, last = math.ceil(a / (0.5 * math.pi)), math.floor(b / (0.5 * math.pi))
        for c, s in [*(_way(at) for at in (a, b)), *(_QUARTERS[n % 4] for n in range(first, last + 1))]:
            x += [mesh.inner_radius * c, mesh.radius * c]
            y += [mesh.inner_radius * s, mesh.radius * s]
    return (min(x, default=0.0), max(x, default=0.0)), (min(y, default=0.0), max(y, default=0.0))


def _way(at: float) -> Angles:
    return math.cos(at), math.sin(at)
