"""The angles of a ring sector around its axis, as far as it is modelled."""

import math

from ..model.bodies import RingSector

Angles = tuple[float, float]
"""Start and end of the ring sector, rad, from the first direction across the axis to the second."""

_WINDOW: dict[str, Angles] = {"half": (-0.5 * math.pi, 0.5 * math.pi), "quarter": (0.0, 0.5 * math.pi)}
"""The ranges of angles that are modelled in a sector."""

_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Cosines and sines of the multiples of a quarter turn."""


def angles(mesh: RingSector) -> list[Angles]:
    """Returns the ranges of modelled angles: two ranges if a plane of the sector leaves both ends, otherwise one
    range.
    """
    begin = math.remainder(mesh.start, 2.0 * math.pi)
    if mesh.sector == "full":
        return [(begin, begin + mesh.angle)]
    low, high = _WINDOW[mesh.sector]
    turns = (-2.0 * math.pi, 0.0, 2.0 * math.pi)
    found = [(max(low, begin + turn), min(high, begin + mesh.angle + turn)) for turn in turns]
    return [(a, b) for a, b in found if b - a > 1e-12]


def angle(mesh: RingSector) -> float:
    """Returns the sum of the modelled angles, rad."""
    return math.fsum(b - a for a, b in angles(mesh))


def holds_angle(mesh: RingSector, x: float, y: float) -> bool:
    """Whether the direction of a point from the axis is modelled."""
    at = math.atan2(y, x)
    return any(a <= at + turn <= b for a, b in angles(mesh) for turn in (-2.0 * math.pi, 0.0, 2.0 * math.pi))


def extremes(mesh: RingSector, whole: bool = False) -> tuple[Angles, Angles]:
    """Lowest and highest value of both coordinates across the axis, m, measured from the axis. ``whole``: whether the
    values are those of the full body.
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
