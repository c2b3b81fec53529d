"""Outlines of bodies of revolution: the radius as a function of the height, with formulas for volume, area and other
integrals.

Heights z are measured along the axis from the low end of the body, radii r from the axis. An outline is a sequence of
lines and arcs from the low end to the high end. A flat face closes an end whose radius is not 0.
"""

import math
from dataclasses import dataclass

from ..model.bodies import Cone, Hemisphere, Ogive, SphericalCap
from ..model.forms import BallPiece, ConeForm, OgiveForm

_TIP = 1e-7
"""Radius of the end of an arc up to which this end counts as on the axis, divided by the height: the square root of the
rounding error."""

Revolved = Cone | Ogive | Hemisphere | SphericalCap
RevolvedForm = ConeForm | OgiveForm | BallPiece


@dataclass(frozen=True)
class Line:
    """A line from (z0, r0) to (z1, r1), z0 below z1."""

    z0: float
    r0: float
    z1: float
    r1: float

    def at(self, z: float) -> float:
        """The radius of the line at a height, m."""
        return self.r0 + (self.r1 - self.r0) * (z - self.z0) / (self.z1 - self.z0)

    def volume(self) -> float:
        """Volume of the frustum that the line encloses, m^3."""
        return math.pi / 3.0 * (self.z1 - self.z0) * (self.r0**2 + self.r0 * self.r1 + self.r1**2)

    def side(self) -> float:
        """Area of the surface that the line makes when it turns around the axis, m^2."""
        return math.pi * (self.r0 + self.r1) * math.hypot(self.z1 - self.z0, self.r1 - self.r0)

    def section(self) -> float:
        """Area between the line and the axis, m^2."""
        return 0.5 * (self.z1 - self.z0) * (self.r0 + self.r1)

    def widest(self) -> float:
        """The largest radius of the line, m."""
        return max(self.r0, self.r1)

    def lowest(self, along: float, out: float) -> float:
        """Smallest value of ``along`` z - ``out`` r on the line, m, for ``out`` of at least 0."""
        return min(along * self.z0 - out * self.r0, along * self.z1 - out * self.r1)

    def length(self) -> float:
        """Extent of the line along the axis, m."""
        return math.hypot(self.z1 - self.z0, self.r1 - self.r0)

    def mirrored(self, top: float) -> "Line":
        """Returns the line with heights measured from the other end of a body of height ``top``, m."""
        return Line(top - self.z1, self.r1, top - self.z0, self.r0)


@dataclass(frozen=True)
class Arc:
    """An arc r = rc + sqrt(radius^2 - (z - zc)^2) between the heights z0 and z1."""

    z0: float
    z1: float
    zc: float
    rc: float
    radius: float

    def at(self, z: float) -> float:
        """Radius of the outline at a height on the arc, m."""
        return max(0.0, self.rc + self._rise(z - self.zc))

    @property
    def r0(self) -> float:
        """The radius of the outline at the lower end of the arc, m."""
        return self.at(self.z0)

    @property
    def r1(self) -> float:
        """The radius of the outline at the higher end of the arc, m."""
        return self.at(self.z1)

    def volume(self) -> float:
        """Volume that the arc encloses when it turns around the axis, pi times the integral of r^2, m^3."""

        def integral(u: float) -> float:
            return (self.rc**2 + self.radius**2) * u - u**3 / 3.0 + 2.0 * self.rc * self._under(u)

        return math.pi * (integral(self.z1 - self.zc) - integral(self.z0 - self.zc))

    def side(self) -> float:
        """Area of the surface that the arc makes when it turns around the axis, 2 pi times the integral of r over its
        length, m^2.
        """
        return 2.0 * math.pi * self.radius * (self.rc * self._angle() + self.z1 - self.z0)

    def section(self) -> float:
        """Area between the arc and the axis, m^2."""
        return self.rc * (self.z1 - self.z0) + self._under(self.z1 - self.zc) - self._under(self.z0 - self.zc)

    def widest(self) -> float:
        """The largest radius of the outline on the arc, m."""
        return self.rc + self.radius if self.z0 <= self.zc <= self.z1 else max(self.r0, self.r1)

    def lowest(self, along: float, out: float) -> float:
        """Smallest value of ``along`` z - ``out`` r on the arc, m, for ``out`` of at least 0."""
        ends = [along * self.z0 - out * self.r0, along * self.z1 - out * self.r1]
        length = math.hypot(along, out)
        touch = self.zc - self.radius * along / length if length else self.z0
        inside = self.z0 < touch < self.z1
        return min(*ends, *([along * self.zc - out * self.rc - self.radius * length] if inside else []))

    def length(self) -> float:
        """Extent of the arc along the axis, m."""
        return self.radius * self._angle()

    def mirrored(self, top: float) -> "Arc":
        """Returns the arc with heights measured from the other end of a body of height ``top``, m."""
        return Arc(top - self.z1, top - self.z0, top - self.zc, self.rc, self.radius)

    def _rise(self, u: float) -> float:
        return math.sqrt(max(0.0, self.radius**2 - u**2))

    def _under(self, u: float) -> float:
        """Returns the integral of sqrt(radius^2 - u^2) from 0 to ``u``, m^2."""
        return 0.5 * (u * self._rise(u) + self.radius**2 * math.asin(_share(u / self.radius)))

    def _angle(self) -> float:
        begin, end = (math.asin(_share((z - self.zc) / self.radius)) for z in (self.z0, self.z1))
        return end - begin


Segment = Line | Arc


@dataclass(frozen=True)
class Profile:
    """The outline of a body of revolution from its low end to its high end."""

    segments: tuple[Segment, ...]

    @property
    def height(self) -> float:
        """Height of the body, m."""
        return self.segments[-1].z1

    @property
    def ends(self) -> tuple[float, float]:
        """Radii of the flat faces at the low and the high end, m; 0 for an end without a flat face."""
        low, high = (r if r > _TIP * self.height else 0.0 for r in (self.segments[0].r0, self.segments[-1].r1))
        return low, high

    def at(self, z: float) -> float:
        """The radius of the outline at a height within the body, m."""
        return next((each for each in self.segments if z <= each.z1), self.segments[-1]).at(z)

    def volume(self) -> float:
        """Volume of the body of revolution, m^3."""
        return math.fsum(each.volume() for each in self.segments)

    def surface(self) -> float:
        """Surface of the body of revolution with its flat faces, m^2."""
        return math.fsum([*(each.side() for each in self.segments), *(math.pi * r**2 for r in self.ends)])

    def section(self) -> float:
        """Area of one half of a cut through the body along its axis, m^2."""
        return math.fsum(each.section() for each in self.segments)

    def widest(self) -> float:
        """The largest radius of the outline, m."""
        return max(each.widest() for each in self.segments)

    def lowest(self, along: float, out: float) -> float:
        """Smallest value of ``along`` z - ``out`` r on the outline, m, for ``out`` of at least 0."""
        return min(each.lowest(along, out) for each in self.segments)


def profile(mesh: RevolvedForm) -> Profile:
    """Returns the outline of a body whose sizes have passed the checks of the module ``form_checks``."""
    if isinstance(mesh, ConeForm):
        return Profile((Line(0.0, mesh.radius, mesh.length, mesh.top_radius),))
    found = _ogive(mesh) if isinstance(mesh, OgiveForm) else (_cap(mesh),)
    top = found[-1].z1
    return Profile(found if mesh.pointing == "high" else tuple(each.mirrored(top) for each in reversed(found)))


def tips(mesh: RevolvedForm) -> list[tuple[float, float]]:
    """Returns, for both ends of a body, the radius of the flat or round tip, m (0 for a sharp tip), and the slope of
    the outline at the end. The slope is used only for a sharp tip.
    """
    outline = profile(mesh)
    small = 1e-4 * outline.height
    near = outline.at(small) / small, outline.at(outline.height - small) / small
    found = list(zip(outline.ends, near, strict=True))
    if isinstance(mesh, OgiveForm) and mesh.tip_radius:
        found[mesh.pointing == "high"] = mesh.tip_radius, 0.0
    return found


def _cap(mesh: BallPiece) -> Arc:
    return Arc(0.0, mesh.rise, mesh.rise - mesh.radius, 0.0, mesh.radius)


def arc_of(mesh: OgiveForm) -> Arc:
    """Returns the arc of a sharp nose that begins at height 0. The arc passes through (z, r) = (0, R) and (L, 0), and
    its centre is on the other side of the axis. For a tangent ogive the centre is at height 0: L^2 = radius^2 - (radius
    - R)^2.
    """
    if mesh.nose is None or mesh.crh is None:
        radius = (mesh.nose**2 + mesh.radius**2) / (2.0 * mesh.radius) if mesh.nose else arc_radius(mesh)
        return Arc(0.0, nose_length(mesh), 0.0, mesh.radius - radius, radius)
    length, radius = mesh.nose, arc_radius(mesh)
    chord = math.hypot(length, mesh.radius)
    off = math.sqrt(max(0.0, radius**2 - 0.25 * chord**2)) / chord
    return Arc(0.0, length, 0.5 * length - off * mesh.radius, 0.5 * mesh.radius - off * length, radius)


def tangent(nose: float, radius: float) -> float:
    """Returns the calibre radius head (radius of the arc divided by the diameter) of a tangent ogive with a nose of
    length ``nose``, m, on a shank of ``radius``, m.
    """
    return (nose / (2.0 * radius)) ** 2 + 0.25


def arc_radius(mesh: OgiveForm) -> float:
    """Radius of the arc of the nose, m, from its calibre radius head."""
    return 2.0 * mesh.radius * (mesh.crh or 0.5)


def nose_length(mesh: OgiveForm) -> float:
    """Length of the nose up to its sharp tip, m; for a tangent ogive D sqrt(crh - 1/4) with the diameter D."""
    return mesh.nose or 2.0 * mesh.radius * math.sqrt((mesh.crh or 0.5) - 0.25)


def _ogive(mesh: OgiveForm) -> tuple[Segment, ...]:
    sharp, back = arc_of(mesh), mesh.shank
    nose = Arc(back, back + sharp.z1, back + sharp.zc, sharp.rc, sharp.radius)
    shank = (Line(0.0, mesh.radius, back, mesh.radius),) if back else ()
    if mesh.tip_radius:
        return (*shank, *_rounded(nose, mesh.tip_radius))
    if mesh.meplat:
        end = nose.zc + math.sqrt(nose.radius**2 - (0.5 * mesh.meplat - nose.rc) ** 2)
        return (*shank, Arc(nose.z0, end, nose.zc, nose.rc, nose.radius))
    return (*shank, nose)


def _rounded(nose: Arc, tip: float) -> tuple[Arc, Arc]:
    """Returns the arc of a nose that is rounded by a ball of radius ``tip``, m, and the arc of this ball. The ball
    touches the arc of the nose from inside: its centre is on the axis, and the distance of the two centres is the
    difference of the radii.
    """
    centre = nose.zc + math.sqrt(max(0.0, (nose.radius - tip) ** 2 - nose.rc**2))
    touch = centre + (centre - nose.zc) * tip / (nose.radius - tip)
    return Arc(nose.z0, touch, nose.zc, nose.rc, nose.radius), Arc(touch, centre + tip, centre, 0.0, tip)


def _share(x: float) -> float:
    return min(1.0, max(-1.0, x))
