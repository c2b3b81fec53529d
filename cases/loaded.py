"""What the tractions of a case act on, as far as that is known before there is a mesh: area and number of faces."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from .bodies import Box, Cylinder, Loose, MeshFile, Plate, Shards, Sphere, Tube, TwoTets
from .boundaries import ROUND, Traction
from .geometry import Generated, Vector, across, bounds, centre, index, surface
from .mesh_size import FACES_PER_SURFACE, surface_faces
from .placed import Placed
from .problems import Problem, problem
from .schema import Case, Part

_FINEST = 60
"""Patches along a side of a surface, at most. Chosen: a tenth of a second for a body."""
_MOST = 20
"""Bodies whose surfaces are gone through. Chosen: two seconds at most."""

Point = Callable[[float, float], Vector]
"""The point of a surface at two numbers from 0 to 1."""
Sheet = tuple[Point, float, float]
"""A part of a surface, and about how long it is along both numbers, m."""
Within = Callable[[Vector], bool]


@dataclass(frozen=True)
class Load:
    """What a traction acts on, about; None where a mesh file or loose tets do not tell."""

    boundary: int
    """Number of the boundary."""
    area: float | None
    """m^2."""
    faces: int | None


def loads(case: Case) -> list[Load]:
    """Of each traction of a case."""
    return [Load(number, *_acted_on(case, spec)) for number, spec in case.boundaries_of(Traction)]


def unloaded(case: Case) -> Iterator[Problem]:
    """A warning for each traction in whose region no face seems to lie."""
    for load in loads(case):
        if load.faces == 0:
            message = "no face of the bodies that it is for seems to lie in it; where there is none no run starts"
            yield problem(("boundaries", load.boundary), ..., message)


def _acted_on(case: Case, spec: Traction) -> tuple[float | None, int | None]:
    within = _region(spec)
    area, faces, left = 0.0, 0.0, _MOST
    for part in case.parts:
        if spec.parts and part.name not in spec.parts:
            continue
        mesh = part.mesh
        if isinstance(mesh, MeshFile):
            return None, None
        if within is None:
            area, faces = area + surface(mesh), faces + surface_faces(mesh)
        elif not _apart(spec, part, mesh):
            if isinstance(mesh, Loose) or not left:
                return None, None
            more, number = _inside(mesh, part, within)
            area, faces, left = area + more, faces + number, left - 1
    return area, round(faces)


def _region(spec: Traction) -> Within | None:
    """Whether a point is in the box and in the cylinder of a traction; None where it has neither."""
    low, high, shell = spec.low, spec.high, spec.cylinder
    if shell is None and (low is None or high is None):
        return None
    slack = ROUND * max(map(abs, (*(low or ()), *(high or ()))), default=0.0)

    def within(point: Vector) -> bool:
        boxed = low is None or high is None or all(
            a - slack <= x <= b + slack for a, x, b in zip(low, point, high, strict=True)
        )  # fmt: skip
        return boxed and (shell is None or shell.holds(point))

    return within


def _apart(spec: Traction, part: Part, mesh: Generated) -> bool:
    """Whether a body is off the box."""
    if spec.low is None or spec.high is None:
        return False
    return any(
        a > top or b < bottom
        for a, b, bottom, top in zip(spec.low, spec.high, *Placed(mesh, part.turn).bounds(), strict=True)
    )


def _inside(mesh: Generated, part: Part, within: Within) -> tuple[float, float]:
    """Area, m^2, and faces of a body whose corners are in a region: of patches as large as elements."""
    body, area, faces = Placed(mesh, part.turn), 0.0, 0.0
    for at, first, second in _sheets(mesh):
        n, m = (max(1, min(_FINEST, round(length / mesh.element_size))) for length in (first, second))
        rows = [[body.turned(at(i / n, j / m)) for j in range(m + 1)] for i in range(n + 1)]
        inside = [[within(point) for point in row] for row in rows]
        for i, j in itertools.product(range(n), range(m)):
            if inside[i][j] and inside[i + 1][j] and inside[i][j + 1] and inside[i + 1][j + 1]:
                area += _quad(rows[i][j], rows[i + 1][j], rows[i + 1][j + 1], rows[i][j + 1])
    per_area = 2.0 if mesh.generator == "structured" and not isinstance(mesh, Sphere) else FACES_PER_SURFACE
    faces = per_area * area / mesh.element_size**2
    return area, max(faces, 1.0) if area else 0.0


def _quad(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """The area of a flat quadrilateral, m^2, by its diagonals."""
    (p, q, r), (s, t, u) = ([y - x for x, y in zip(*pair, strict=True)] for pair in ((a, c), (b, d)))
    return 0.5 * math.hypot(q * u - r * t, r * s - p * u, p * t - q * s)


# Surfaces of bodies ---------------------------------------------------------------------------------------------------


def _sheets(mesh: Generated) -> Iterator[Sheet]:
    if isinstance(mesh, TwoTets | Shards):
        return
    if isinstance(mesh, Box | Plate):
        yield from _block(mesh)
        return
    begin, end = {"full": (0.0, 2.0), "half": (-0.5, 0.5), "quarter": (0.0, 0.5)}[mesh.sector]
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
    """The rectangle across direction ``d`` at ``at``."""
    i, j = (d + 1) % 3, (d + 2) % 3

    def point(u: float, v: float) -> Vector:
        x = [at, at, at]
        x[i], x[j] = low[i] + u * (high[i] - low[i]), low[j] + v * (high[j] - low[j])
        return x[0], x[1], x[2]

    return point, high[i] - low[i], high[j] - low[j]


def _barrel(mesh: Cylinder | Tube, begin: float, end: float) -> Iterator[Sheet]:
    """A cylinder or a tube, of angles from ``begin`` to ``end``, in pi."""
    inner, outer, length = mesh.inner_radius if isinstance(mesh, Tube) else 0.0, mesh.radius, mesh.length
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
    """Shares of the way round at which a sector is cut; none of a whole body."""
    return () if end - begin == 2.0 else (0.0, 1.0)


def _turning(mesh: Cylinder | Tube | Sphere, begin: float, end: float) -> Callable[[float, float, float], Vector]:
    """The point at a radius, a share of the way round and a height."""
    start, k, (i, j) = centre(mesh), index(mesh.axis), across(mesh.axis)

    def point(radius: float, u: float, height: float) -> Vector:
        angle, x = math.pi * (begin + u * (end - begin)), list(start)
        x[i], x[j], x[k] = x[i] + radius * math.cos(angle), x[j] + radius * math.sin(angle), x[k] + height
        return x[0], x[1], x[2]

    return point
