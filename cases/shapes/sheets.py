"""Surfaces of bodies as sheets (pieces of surface): each sheet is a function of two parameters from 0 to 1."""

import math
from collections.abc import Callable, Iterator, Sequence

from ..model.bodies import Box, Cylinder, Plate, RingSector, Shards, Sphere, Tube, TwoTets
from . import ring
from .geometry import Generated, Vector, across, bounds, centre, index
from .profile import Revolved, Segment, profile

Point = Callable[[float, float], Vector]
"""Function that returns a point of a sheet, m, for two parameters from 0 to 1."""
Sheet = tuple[Point, float, float]
"""A sheet: its function, and its approximate lengths along both parameters, m."""


def sheets(mesh: Generated) -> Iterator[Sheet]:
    if isinstance(mesh, TwoTets | Shards):
        return
    if isinstance(mesh, Box | Plate):
        yield from _block(mesh)
        return
    if isinstance(mesh, RingSector):
        for low, top in ring.angles(mesh):
            yield from _barrel(mesh, low / math.pi, top / math.pi)
        return
    begin, end = {"full": (0.0, 2.0), "half": (-0.5, 0.5), "quarter": (0.0, 0.5)}[mesh.sector]
    if isinstance(mesh, Revolved):
        yield from _revolved(mesh, begin, end)
    else:
        yield from _ball(mesh, begin, end) if isinstance(mesh, Sphere) else _barrel(mesh, begin, end)


def _block(mesh: Box | Plate) -> Iterator[Sheet]:
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    for d in range(3):
        for at in (low[d], high[d]):
            yield _flat(d, at, low, high)
    if (slit := mesh.slit) is not None:
        a, b = list(low), list(high)
        for k, e in enumerate(across(slit.axis)):
            a[e], b[e] = max(low[e], slit.low[k]), min(high[e], slit.high[k])
        for _ in range(2):
            yield _flat(index(slit.axis), slit.at, a, b)


def _flat(d: int, at: float, low: Sequence[float], high: Sequence[float]) -> Sheet:
    """Rectangle normal to the direction ``d`` at the coordinate ``at``, m."""
    i, j = (d + 1) % 3, (d + 2) % 3

    def point(u: float, v: float) -> Vector:
        x = [at, at, at]
        x[i], x[j] = low[i] + u * (high[i] - low[i]), low[j] + v * (high[j] - low[j])
        return x[0], x[1], x[2]

    return point, high[i] - low[i], high[j] - low[j]


def _revolved(mesh: Revolved, begin: float, end: float) -> Iterator[Sheet]:
    """Surface of a body of revolution between the angles ``begin`` and ``end``, in multiples of pi."""
    outline, turn, arc = profile(mesh), _turning(mesh, begin, end), (end - begin) * math.pi

    def along(each: Segment) -> Point:
        return lambda u, v: turn(each.at(each.z0 + v * (each.z1 - each.z0)), u, each.z0 + v * (each.z1 - each.z0))

    def at_end(radius: float, height: float) -> Point:
        return lambda u, v: turn(radius * v, u, height)

    def cut(each: Segment, side: float) -> Point:
        def point(u: float, v: float) -> Vector:
            height = each.z0 + v * (each.z1 - each.z0)
            return turn(each.at(height) * u, side, height)

        return point

    for each in outline.segments:
        yield along(each), arc * each.widest(), each.length()
        for side in _cut(begin, end):
            yield cut(each, side), each.widest(), each.length()
    for radius, height in zip(outline.ends, (0.0, outline.height), strict=True):
        if radius > 0.0:
            yield at_end(radius, height), arc * radius, radius


def _barrel(mesh: Cylinder | Tube | RingSector, begin: float, end: float) -> Iterator[Sheet]:
    """Surface of a cylinder, a tube, or a sector of them between the angles ``begin`` and ``end``, in multiples of
    pi.
    """
    inner, outer, length = 0.0 if isinstance(mesh, Cylinder) else mesh.inner_radius, mesh.radius, mesh.length
    turn, arc, wall = _turning(mesh, begin, end), (end - begin) * math.pi, outer - inner

    def along(radius: float) -> Point:
        return lambda u, v: turn(radius, u, length * v)

    def at_end(height: float) -> Point:
        return lambda u, v: turn(inner + wall * v, u, height)

    def cut(side: float) -> Point:
        return lambda u, v: turn(inner + wall * u, side, length * v)

    for radius in (outer, inner)[: 1 + (inner > 0.0)]:
        yield along(radius), arc * radius, length
    for height in (0.0, length):
        yield at_end(height), arc * outer, wall
    for side in _cut(begin, end):
        yield cut(side), wall, length


def _ball(mesh: Sphere, begin: float, end: float) -> Iterator[Sheet]:
    radius, turn = mesh.radius, _turning(mesh, begin, end)

    def at(r: float, u: float, v: float) -> Vector:
        return turn(r * math.sin(math.pi * v), u, -r * math.cos(math.pi * v))

    def cut(side: float) -> Point:
        return lambda u, v: at(radius * u, side, v)

    yield (lambda u, v: at(radius, u, v)), (end - begin) * math.pi * radius, math.pi * radius
    for side in _cut(begin, end):
        yield cut(side), radius, math.pi * radius


def _cut(begin: float, end: float) -> tuple[float, ...]:
    """Angles around the axis, as fractions of the range from ``begin`` to ``end``, at which a sector is cut; empty for
    a whole body.
    """
    return () if end - begin == 2.0 else (0.0, 1.0)


def _turning(
    mesh: Cylinder | Tube | Sphere | Revolved | RingSector, begin: float, end: float
) -> Callable[[float, float, float], Vector]:
    """Function that returns the point for a radius, a fraction of the range of angles, and a height."""
    start, k, (i, j) = centre(mesh), index(mesh.axis), across(mesh.axis)

    def point(radius: float, u: float, height: float) -> Vector:
        angle, x = math.pi * (begin + u * (end - begin)), list(start)
        x[i], x[j], x[k] = x[i] + radius * math.cos(angle), x[j] + radius * math.sin(angle), x[k] + height
        return x[0], x[1], x[2]

    return point
