"""Dimensions of the mesh primitives by formulas: bounds, volume, surface, smallest extent, extent along a direction."""

import math
from collections.abc import Callable

from ..model.bodies import Box, Cylinder, Mesh, Plate, Primitive, RingSector, Shards, Sphere, Tube, TwoTets
from ..model.solids import Measured
from ..model.tables import Axis
from . import ring
from .profile import Revolved, profile

Vector = tuple[float, float, float]
Generated = Box | Plate | Cylinder | Tube | Sphere | Revolved | RingSector | TwoTets | Shards

AXES: tuple[Axis, Axis, Axis] = ("x", "y", "z")


def index(axis: Axis) -> int:
    """Returns the index of an axis: 0 for x, 1 for y, 2 for z."""
    return AXES.index(axis)


def across(axis: Axis) -> tuple[int, int]:
    """Returns the two directions across ``axis``, in cyclic order: x, y for z; y, z for x; z, x for y."""
    return (index(axis) + 1) % 3, (index(axis) + 2) % 3


def cut_directions(mesh: Primitive, axis: Axis) -> tuple[int, ...]:
    """Returns the directions across ``axis`` in which only the positive side of the body is modelled."""
    return across(axis)[: {"full": 0, "half": 1, "quarter": 2}[mesh.sector]]


def centre(mesh: Generated) -> Vector:
    """Returns the point through which a sector cuts a body: the origin of the coordinates for a box, the centre or the
    base for other bodies.
    """
    if isinstance(mesh, Box):
        return (0.0, 0.0, 0.0)
    return mesh.centre if isinstance(mesh, Sphere | TwoTets) else mesh.base


def whole_bounds(mesh: Generated) -> tuple[Vector, Vector]:
    """Lowest and highest coordinates of the whole body, m, also if only a sector is modelled."""
    if isinstance(mesh, Box):
        return mesh.low, mesh.high
    if isinstance(mesh, Sphere):
        return _shift(mesh.centre, (-mesh.radius,) * 3), _shift(mesh.centre, (mesh.radius,) * 3)
    if isinstance(mesh, Shards):
        return mesh.base, _shift(mesh.base, tuple(n * pitch(mesh) for n in mesh.count))
    i, j = across(mesh.axis)
    if isinstance(mesh, TwoTets):
        return _two_tets(mesh, i, j)
    low, high = list(mesh.base), list(mesh.base)
    for direction, (least, most) in zip((i, j), _reach(mesh), strict=True):
        low[direction], high[direction] = low[direction] + least, high[direction] + most
    high[index(mesh.axis)] += height(mesh)
    return _vector(low), _vector(high)


def height(mesh: Plate | Cylinder | Tube | Revolved | RingSector) -> float:
    """Extent of a body along its axis, m."""
    if isinstance(mesh, Revolved):
        return profile(mesh).height
    return mesh.thickness if isinstance(mesh, Plate) else mesh.length


def _reach(mesh: Plate | Cylinder | Tube | Revolved | RingSector) -> tuple[tuple[float, float], tuple[float, float]]:
    """Extent of the whole body from its base in the two directions across its axis: lowest and highest values, m."""
    if isinstance(mesh, RingSector):
        return ring.extremes(mesh, whole=True)
    if isinstance(mesh, Plate):
        return (-mesh.width / 2, mesh.width / 2), (-mesh.height / 2, mesh.height / 2)
    radius = profile(mesh).widest() if isinstance(mesh, Revolved) else mesh.radius
    return (-radius, radius), (-radius, radius)


def _two_tets(mesh: TwoTets, i: int, j: int) -> tuple[Vector, Vector]:
    """Returns the lowest and highest coordinates of the shape ``two_tets``, m. The common face of the two tets has a
    corner in the direction ``i`` and an edge normal to this direction.
    """
    edge, low, high = mesh.element_size, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    off = altitude(mesh) * math.tan(mesh.lean)
    low[i], high[i] = min(-edge / math.sqrt(12.0), -off), max(edge / math.sqrt(3.0), off)
    low[j], high[j] = -edge / 2.0, edge / 2.0
    high[index(mesh.axis)] = altitude(mesh)
    low[index(mesh.axis)] = -high[index(mesh.axis)]
    return _shift(mesh.centre, tuple(low)), _shift(mesh.centre, tuple(high))


def altitude(mesh: TwoTets) -> float:
    """Distance of the free corners of two tets from their common face, m."""
    return mesh.element_size * math.sqrt(2.0 / 3.0)


def side_areas(mesh: TwoTets) -> tuple[float, ...]:
    """Areas of the six exposed faces of the shape ``two_tets``, m^2. The outward normals of the edges of the common
    face are at 60, 180 and 300 deg.
    """
    edge, off = mesh.element_size, altitude(mesh) * math.tan(mesh.lean)
    feet = [edge / math.sqrt(12.0) + sign * off * share for sign in (-1.0, 1.0) for share in (0.5, -1.0, 0.5)]
    return tuple(0.5 * edge * math.hypot(altitude(mesh), foot) for foot in feet)


def pitch(mesh: Shards) -> float:
    """Edge length of the cube that contains one separate tet, m: the diameter of the sphere around the tet, plus twice
    the displacement of its nodes, plus the gap.
    """
    return 2.0 * mesh.element_size * (math.sqrt(3.0 / 8.0) + math.sqrt(3.0) * mesh.perturbation) + mesh.gap


def tets(mesh: TwoTets | Shards) -> int:
    """Number of tets of the shapes that consist of single tets."""
    return 2 if isinstance(mesh, TwoTets) else math.prod(mesh.count)


def bounds(mesh: Mesh) -> tuple[Vector, Vector] | None:
    """Lowest and highest coordinates of the modelled part of a body, m; None for bodies whose sizes are measured on
    their mesh.
    """
    if isinstance(mesh, Measured):
        return None
    low, high = map(list, whole_bounds(mesh))
    if isinstance(mesh, RingSector):
        for direction, (least, most) in zip(across(mesh.axis), ring.extremes(mesh), strict=True):
            low[direction], high[direction] = mesh.base[direction] + least, mesh.base[direction] + most
    for direction in cut_directions(mesh, mesh.axis):
        low[direction] = max(low[direction], centre(mesh)[direction])
    return _vector(low), _vector(high)


def volume(mesh: Generated) -> float:
    """Volume of the modelled part of a body, m^3; for separate tets, before their nodes are moved at random."""
    if isinstance(mesh, Box):
        low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
        return math.prod(max(0.0, b - a) for a, b in zip(low, high, strict=True))
    if isinstance(mesh, TwoTets | Shards):
        return tets(mesh) * mesh.element_size**3 / math.sqrt(72.0)
    share = {"full": 1.0, "half": 0.5, "quarter": 0.25}[mesh.sector]
    if isinstance(mesh, Plate):
        return share * mesh.width * mesh.height * mesh.thickness
    if isinstance(mesh, Sphere):
        return share * 4.0 / 3.0 * math.pi * mesh.radius**3
    if isinstance(mesh, Revolved):
        return share * profile(mesh).volume()
    if isinstance(mesh, RingSector):
        return 0.5 * ring.angle(mesh) * (mesh.radius**2 - mesh.inner_radius**2) * mesh.length
    inner = mesh.inner_radius if isinstance(mesh, Tube) else 0.0
    return share * math.pi * (mesh.radius**2 - inner**2) * mesh.length


def surface(mesh: Generated) -> float:
    """Surface of the modelled part of a body, m^2, including the cut faces of a sector and both sides of a slit."""
    if isinstance(mesh, Box | Plate):
        low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
        a, b, c = (y - x for x, y in zip(low, high, strict=True))
        slit = 2.0 * math.prod(slit_extents(mesh)) if mesh.slit is not None else 0.0
        return 2.0 * (a * b + b * c + c * a) + slit
    if isinstance(mesh, TwoTets):
        return sum(side_areas(mesh))
    if isinstance(mesh, Shards):
        return tets(mesh) * math.sqrt(3.0) * mesh.element_size**2
    share = {"full": 1.0, "half": 0.5, "quarter": 0.25}[mesh.sector]
    cut = 0.0 if mesh.sector == "full" else 1.0
    if isinstance(mesh, Sphere):
        return share * 4.0 * math.pi * mesh.radius**2 + cut * math.pi * mesh.radius**2
    if isinstance(mesh, Revolved):
        return share * profile(mesh).surface() + cut * 2.0 * profile(mesh).section()
    if isinstance(mesh, RingSector):
        return _ring_surface(mesh)
    inner = mesh.inner_radius if isinstance(mesh, Tube) else 0.0
    ends = 2.0 * math.pi * (mesh.radius**2 - inner**2)
    sides = 2.0 * math.pi * (mesh.radius + inner) * mesh.length
    return share * (ends + sides) + cut * 2.0 * (mesh.radius - inner) * mesh.length


def _ring_surface(mesh: RingSector) -> float:
    turn, ends = ring.angle(mesh), 2.0 * len(ring.angles(mesh))
    wall = mesh.radius - mesh.inner_radius
    return (mesh.radius + mesh.inner_radius) * (turn * wall + turn * mesh.length) + ends * wall * mesh.length


def slit_extents(mesh: Box | Plate) -> tuple[float, float]:
    """Extents of the part of a slit that lies inside the body, in the two directions across the axis of the slit, m; 0
    without a slit.
    """
    if mesh.slit is None:
        return 0.0, 0.0
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    i, j = across(mesh.slit.axis)
    first, second = (
        max(0.0, min(high[d], mesh.slit.high[k]) - max(low[d], mesh.slit.low[k])) for k, d in enumerate((i, j))
    )
    return first, second


def holds(mesh: Generated, point: Vector) -> bool:
    """Whether ``point``, m, lies inside the modelled part of a body; for single tets, inside the bounds of the body."""
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    if not all(a <= x <= b for a, x, b in zip(low, point, high, strict=True)):
        return False
    return round_part(mesh)(point)


def round_part(mesh: Generated) -> Callable[[Vector], bool]:
    """Returns a function that tests whether a point inside the bounds of a body lies inside the body. Make it once for
    many points.
    """
    if isinstance(mesh, Box | Plate | TwoTets | Shards):
        return lambda point: True
    if isinstance(mesh, Sphere):
        return lambda point: math.dist(point, mesh.centre) <= mesh.radius
    i, j = across(mesh.axis)
    x, y = centre(mesh)[i], centre(mesh)[j]
    if isinstance(mesh, Revolved):
        outline, k, start = profile(mesh), index(mesh.axis), centre(mesh)[index(mesh.axis)]
        return lambda point: math.hypot(point[i] - x, point[j] - y) <= outline.at(point[k] - start)
    if isinstance(mesh, RingSector):
        return lambda point: _in_ring(mesh, point[i] - x, point[j] - y)
    inner, outer = mesh.inner_radius if isinstance(mesh, Tube) else 0.0, mesh.radius
    return lambda point: inner <= math.hypot(point[i] - x, point[j] - y) <= outer


def _in_ring(mesh: RingSector, x: float, y: float) -> bool:
    return mesh.inner_radius <= math.hypot(x, y) <= mesh.radius and ring.holds_angle(mesh, x, y)


def thinnest(mesh: Generated) -> float:
    """Smallest extent of the body, m: for example the wall thickness of a tube, the diameter of a sphere, the diameter
    of the larger end of a cone, the outer arc of a ring sector.
    """
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    extents = [b - a for a, b in zip(low, high, strict=True)]
    if isinstance(mesh, RingSector):
        extents += [mesh.radius * (end - begin) for begin, end in ring.angles(mesh)]
    if isinstance(mesh, Tube | RingSector):
        return min(*extents, mesh.radius - mesh.inner_radius)
    return min(extents)


def lowest_along(mesh: Generated, normal: Vector) -> float:
    """Smallest value of ``normal . x`` over all points x of the whole body, m, for a unit vector ``normal``. For a ring
    sector and for single tets it is the smallest value over their bounds.
    """
    if isinstance(mesh, Box | RingSector | TwoTets | Shards):
        return sum(min(n * a, n * b) for n, a, b in zip(normal, *whole_bounds(mesh), strict=True))
    start = _dot(normal, centre(mesh))
    if isinstance(mesh, Sphere):
        return start - mesh.radius
    along = normal[index(mesh.axis)]
    i, j = across(mesh.axis)
    if isinstance(mesh, Plate):
        side = (abs(normal[i]) * mesh.width + abs(normal[j]) * mesh.height) / 2
        return start + min(0.0, along * mesh.thickness) - side
    if isinstance(mesh, Revolved):
        return start + profile(mesh).lowest(along, math.hypot(normal[i], normal[j]))
    return start + min(0.0, along * mesh.length) - mesh.radius * math.hypot(normal[i], normal[j])


def _shift(point: Vector, by: tuple[float, ...]) -> Vector:
    return _vector([a + b for a, b in zip(point, by, strict=True)])


def _vector(values: list[float]) -> Vector:
    return values[0], values[1], values[2]


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
