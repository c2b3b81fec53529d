"""Bodies at their initial position, including the rotation of their part: test of points, mass and motion."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from ..model.courses import factor_at
from ..model.schema import Case, Part, Rotation, Turn
from . import geometry
from .geometry import Generated, Vector, across, index

LATTICE = 20
"""Number of sampling points per direction of a body (chosen value): 8,000 points in all, which give moments of inertia
within 1 %."""


@dataclass(frozen=True)
class Placed:
    """A generated body at its position after the rotation of its part."""

    mesh: Generated
    turn: Turn | None = None

    def holds(self, point: Vector) -> bool:
        """Whether ``point``, m, lies in the modelled part of the body."""
        return geometry.holds(self.mesh, _turned(point, self.turn, -1.0))

    def turned(self, point: Vector) -> Vector:
        """Returns the position, m, to which the rotation of the part moves a point of the mesh."""
        return _turned(point, self.turn)

    def bounds(self) -> tuple[Vector, Vector]:
        """Lowest and highest coordinates of the body, m; for a turned body, those of its turned bounding box."""
        low, high = geometry.bounds(self.mesh) or ((0.0,) * 3, (0.0,) * 3)
        corners = [_turned((x, y, z), self.turn) for x, y, z in itertools.product(*zip(low, high, strict=True))]
        (a, b, c), (d, e, f) = ([pick(each) for each in zip(*corners, strict=True)] for pick in (min, max))
        return (a, b, c), (d, e, f)

    def points(self) -> list[Vector]:
        """Points that fill the body evenly; only the centre if the body is too thin for the lattice."""
        low, high = geometry.bounds(self.mesh) or ((0.0,) * 3, (0.0,) * 3)
        inside = list(filter(geometry.round_part(self.mesh), lattice(low, high, LATTICE)))
        return [_turned(point, self.turn) for point in inside or [geometry.centre(self.mesh)]]


def lattice(low: Vector, high: Vector, n: int) -> Iterator[Vector]:
    """Yields the centres of n^3 equal cells of a box."""
    (a, b, c), (d, e, f) = low, high
    for i, j, k in itertools.product(range(n), repeat=3):
        yield a + (d - a) * (i + 0.5) / n, b + (e - b) * (j + 0.5) / n, c + (f - c) * (k + 0.5) / n


def _turned(point: Vector, turn: Turn | None, sense: float = 1.0) -> Vector:
    if turn is None:
        return point
    i, j = across(turn.axis)
    along = index(turn.axis)
    cosine, sine = math.cos(turn.angle), sense * math.sin(turn.angle)
    p, q = point[i] - turn.centre[i], point[j] - turn.centre[j]
    new = {along: point[along], i: turn.centre[i] + cosine * p - sine * q, j: turn.centre[j] + sine * p + cosine * q}
    return new[0], new[1], new[2]


def driven(case: Case, part: Part, factors: tuple[float, float] | None = None) -> Part:
    """Returns the part with the motion of the boundary ``rotation`` that acts on it, if there is one. ``factors``:
    factors of the rotation and of the velocity of its axis; by default those at the start.
    """
    boundary = rotated(case, part)
    if boundary is None:
        return part
    turning, moving = factors or (factor_at(boundary.course, 0.0), factor_at(boundary.velocity_course, 0.0))
    (x, y, z), (a, b, c) = boundary.velocity, boundary.spin.rate
    spin = boundary.spin.model_copy(update={"rate": (turning * a, turning * b, turning * c)})
    speed = moving * x, moving * y, moving * z
    return part.model_copy(update={"velocity": speed, "spin": spin, "stretch": None})


def rotated(case: Case, part: Part) -> Rotation | None:
    """Returns the boundary ``rotation`` that acts on the part; None if there is none."""
    for _, boundary in case.boundaries_of(Rotation):
        if boundary.on is None and (not boundary.parts or part.name in boundary.parts):
            return boundary
    return None


def velocity(part: Part, point: Vector) -> Vector:
    """Returns the initial velocity, m/s, of a part at ``point``, m, without the random velocities of ``jitter``."""
    x, y, z = part.velocity
    if part.spin is not None:
        a, b, c = part.spin.rate
        p, q, r = (p - o for p, o in zip(point, part.spin.centre, strict=True))
        x, y, z = x + b * r - c * q, y + c * p - a * r, z + a * q - b * p
    if part.stretch is not None:
        p, q, r = (k * (p - o) for k, p, o in zip(part.stretch.rate, point, part.stretch.centre, strict=True))
        x, y, z = x + p, y + q, z + r
    return x, y, z


@dataclass(frozen=True)
class Bulk:
    """Mass, bounding box and motion of the modelled part of a body at the start."""

    mass: float
    """Mass, kg."""
    low: Vector
    high: Vector
    """Corners of the bounding box of the body, m."""
    momentum: Vector
    """Momentum, N s."""
    energy: float
    """Kinetic energy, J, without the random velocities of ``jitter``."""
    speed: float
    """Largest speed of a point of the body, m/s."""

    @property
    def extent(self) -> Vector:
        """Extents of the bounding box along x, y, z, m."""
        a, b, c = (high - low for low, high in zip(self.low, self.high, strict=True))
        return a, b, c


def bulk(part: Part, mesh: Generated, density: float) -> Bulk:
    """Returns mass, bounding box and motion of ``part`` from its generated ``mesh``. A motion other than uniform
    translation is summed over points inside the body.
    """
    given = part.rigid.mass if part.rigid is not None else None
    body, mass = Placed(mesh, part.turn), given or density * geometry.volume(mesh)
    moving = part.spin is not None or part.stretch is not None
    points = body.points() if moving else []
    speeds = [velocity(part, point) for point in points] or [part.velocity]
    squares = [math.fsum(c * c for c in v) for v in speeds]
    x, y, z = (mass * math.fsum(each) / len(speeds) for each in zip(*speeds, strict=True))
    energy = 0.5 * mass * math.fsum(squares) / len(squares)
    middle = [math.fsum(each) / len(speeds) for each in zip(*points, strict=True)] if moving else part.velocity
    momentum, energy = with_inertia(part, mass, (middle[0], middle[1], middle[2])) or ((x, y, z), energy)
    return Bulk(mass, *body.bounds(), momentum, energy, math.sqrt(max(squares)))


def with_inertia(part: Part, mass: float, middle: Vector) -> tuple[Vector, float] | None:
    """Returns the initial momentum, N s, and kinetic energy, J, of a rigid part whose inertia the case gives; None for
    any other part. ``middle``: centre of mass that is used if the case gives none.
    """
    rigid = part.rigid
    if rigid is None or rigid.inertia is None:
        return None
    v, (a, b, c) = velocity(part, rigid.centre or middle), part.spin.rate if part.spin is not None else (0.0, 0.0, 0.0)
    xx, yy, zz, yz, zx, xy = rigid.inertia
    turning = xx * a * a + yy * b * b + zz * c * c + 2.0 * (yz * b * c + zx * c * a + xy * a * b)
    squares = math.fsum(each * each for each in v)
    return (mass * v[0], mass * v[1], mass * v[2]), 0.5 * (mass * squares + turning)
