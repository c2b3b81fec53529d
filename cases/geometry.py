"""Sizes of the mesh primitives, by formula: bounds, volume, thinnest extent, reach along a direction."""

import math

from .bodies import Box, Cylinder, Mesh, MeshFile, Plate, Primitive, Sphere, Tube
from .tables import Axis

Vector = tuple[float, float, float]
Generated = Box | Plate | Cylinder | Tube | Sphere

AXES: tuple[Axis, Axis, Axis] = ("x", "y", "z")


def index(axis: Axis) -> int:
    """0, 1, 2 for x, y, z."""
    return AXES.index(axis)


def across(axis: Axis) -> tuple[int, int]:
    """The two directions across ``axis``, in cyclic order: x, y for z; y, z for x; z, x for y."""
    return (index(axis) + 1) % 3, (index(axis) + 2) % 3


def cut_directions(mesh: Primitive, axis: Axis) -> tuple[int, ...]:
    """The directions across ``axis`` in which only the positive side is modelled."""
    return across(axis)[: {"full": 0, "half": 1, "quarter": 2}[mesh.sector]]


def centre(mesh: Generated) -> Vector:
    """The point through which a sector is cut: the origin for a box, the centre or base of the other bodies."""
    if isinstance(mesh, Box):
        return (0.0, 0.0, 0.0)
    return mesh.centre if isinstance(mesh, Sphere) else mesh.base


def whole_bounds(mesh: Generated) -> tuple[Vector, Vector]:
    """Lowest and highest coordinates of the whole body, m, whatever sector of it is modelled."""
    if isinstance(mesh, Box):
        return mesh.low, mesh.high
    if isinstance(mesh, Sphere):
        return _shift(mesh.centre, (-mesh.radius,) * 3), _shift(mesh.centre, (mesh.radius,) * 3)
    i, j = across(mesh.axis)
    half = (mesh.width / 2, mesh.height / 2) if isinstance(mesh, Plate) else (mesh.radius, mesh.radius)
    along = mesh.thickness if isinstance(mesh, Plate) else mesh.length
    low, high = list(mesh.base), list(mesh.base)
    low[i], high[i] = low[i] - half[0], high[i] + half[0]
    low[j], high[j] = low[j] - half[1], high[j] + half[1]
    high[index(mesh.axis)] += along
    return _vector(low), _vector(high)


def bounds(mesh: Mesh) -> tuple[Vector, Vector] | None:
    """Lowest and highest coordinates of what is modelled, m; None for a mesh file."""
    if isinstance(mesh, MeshFile):
        return None
    low, high = map(list, whole_bounds(mesh))
    for direction in cut_directions(mesh, mesh.axis):
        low[direction] = max(low[direction], centre(mesh)[direction])
    return _vector(low), _vector(high)


def volume(mesh: Generated) -> float:
    """Volume of what is modelled, m^3."""
    if isinstance(mesh, Box):
        low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
        return math.prod(max(0.0, b - a) for a, b in zip(low, high, strict=True))
    share = {"full": 1.0, "half": 0.5, "quarter": 0.25}[mesh.sector]
    if isinstance(mesh, Plate):
        return share * mesh.width * mesh.height * mesh.thickness
    if isinstance(mesh, Sphere):
        return share * 4.0 / 3.0 * math.pi * mesh.radius**3
    inner = mesh.inner_radius if isinstance(mesh, Tube) else 0.0
    return share * math.pi * (mesh.radius**2 - inner**2) * mesh.length


def surface(mesh: Generated) -> float:
    """Surface of what is modelled, m^2, the cut faces of a sector included."""
    if isinstance(mesh, Box | Plate):
        low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
        a, b, c = (y - x for x, y in zip(low, high, strict=True))
        return 2.0 * (a * b + b * c + c * a)
    share = {"full": 1.0, "half": 0.5, "quarter": 0.25}[mesh.sector]
    cut = 0.0 if mesh.sector == "full" else 1.0
    if isinstance(mesh, Sphere):
        return share * 4.0 * math.pi * mesh.radius**2 + cut * math.pi * mesh.radius**2
    inner = mesh.inner_radius if isinstance(mesh, Tube) else 0.0
    ends = 2.0 * math.pi * (mesh.radius**2 - inner**2)
    sides = 2.0 * math.pi * (mesh.radius + inner) * mesh.length
    return share * (ends + sides) + cut * 2.0 * (mesh.radius - inner) * mesh.length


def holds(mesh: Generated, point: Vector) -> bool:
    """Whether ``point`` lies inside what is modelled."""
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    if not all(a <= x <= b for a, x, b in zip(low, point, high, strict=True)):
        return False
    if isinstance(mesh, Box | Plate):
        return True
    from_centre = [x - c for x, c in zip(point, centre(mesh), strict=True)]
    if isinstance(mesh, Sphere):
        return math.hypot(*from_centre) <= mesh.radius
    i, j = across(mesh.axis)
    inner = mesh.inner_radius if isinstance(mesh, Tube) else 0.0
    return inner <= math.hypot(from_centre[i], from_centre[j]) <= mesh.radius


def thinnest(mesh: Generated) -> float:
    """The smallest extent of the body, m: the wall of a tube, the diameter of a ball."""
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    extents = [b - a for a, b in zip(low, high, strict=True)]
    if isinstance(mesh, Tube):
        return min(*extents, mesh.radius - mesh.inner_radius)
    return min(extents)


def lowest_along(mesh: Generated, normal: Vector) -> float:
    """The smallest value of ``normal . x`` over the whole body, m, for a unit normal."""
    if isinstance(mesh, Box):
        return sum(min(n * a, n * b) for n, a, b in zip(normal, mesh.low, mesh.high, strict=True))
    start = _dot(normal, centre(mesh))
    if isinstance(mesh, Sphere):
        return start - mesh.radius
    along = normal[index(mesh.axis)]
    i, j = across(mesh.axis)
    if isinstance(mesh, Plate):
        side = (abs(normal[i]) * mesh.width + abs(normal[j]) * mesh.height) / 2
        return start + min(0.0, along * mesh.thickness) - side
    return start + min(0.0, along * mesh.length) - mesh.radius * math.hypot(normal[i], normal[j])


def _shift(point: Vector, by: tuple[float, ...]) -> Vector:
    return _vector([a + b for a, b in zip(point, by, strict=True)])


def _vector(values: list[float]) -> Vector:
    return values[0], values[1], values[2]


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
