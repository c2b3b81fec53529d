"""The forms that bodies have, without their meshes: what a mesh primitive and an operand of a combination share."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length, Ratio
from .tables import Axis, Model, Point, Positive


class BoxForm(Model):
    """A rectangular block between two corners."""

    shape: Literal["box"]
    """The kind of body."""
    low: Point
    """Lowest corner."""
    high: Point
    """Highest corner, above ``low`` in every direction."""


class PlateForm(Model):
    """A rectangular plate: ``thickness`` along ``axis``, ``width`` x ``height`` across it, centred on its axis."""

    shape: Literal["plate"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the face at the low end of ``axis``: the plate lies between it and ``base`` plus ``thickness``."""
    axis: Axis = "z"
    """Direction of the thickness."""
    width: Annotated[Length, Positive]
    """Extent in the first direction across ``axis``, half of it to each side: x for z, y for x, z for y."""
    height: Annotated[Length, Positive]
    """Extent in the second direction across ``axis``: y for z, z for x, x for y."""
    thickness: Annotated[Length, Positive]
    """Extent along ``axis``."""


class CylinderForm(Model):
    """A solid cylinder; ``base`` is the centre of its lower end face."""

    shape: Literal["cylinder"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end face at the low end of ``axis``: the cylinder lies between it and ``base`` plus ``length``."""
    axis: Axis = "z"
    """Direction of the cylinder's axis."""
    radius: Annotated[Length, Positive]
    """Of the cylinder."""
    length: Annotated[Length, Positive]
    """Extent along ``axis``."""


class TubeForm(Model):
    """A hollow cylinder."""

    shape: Literal["tube"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end face at the low end of ``axis``: the tube lies between it and ``base`` plus ``length``."""
    axis: Axis = "z"
    """Direction of the tube's axis."""
    inner_radius: Annotated[Length, Positive]
    """Of the hole; below ``radius``."""
    radius: Annotated[Length, Positive]
    """Of the outside."""
    length: Annotated[Length, Positive]
    """Extent along ``axis``."""


class SphereForm(Model):
    """A ball."""

    shape: Literal["sphere"]
    """The kind of body."""
    centre: Point = (0.0, 0.0, 0.0)
    """Of the ball."""
    axis: Axis = "z"
    """The direction across which a sector is cut."""
    radius: Annotated[Length, Positive]
    """Of the ball."""


class ConeForm(Model):
    """A cone or a frustum of one: ``radius`` at ``base``, ``top_radius`` at the high end of ``axis``."""

    shape: Literal["cone"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end at the low end of ``axis``: the cone lies between it and ``base`` plus ``length``."""
    axis: Axis = "z"
    """Direction of the cone's axis."""
    radius: Annotated[Length, Field(ge=0)]
    """At ``base``; 0 where the tip is there."""
    top_radius: Annotated[Length, Field(ge=0)] = 0.0
    """At the high end of ``axis``; 0 where the tip is there. Not both are 0."""
    length: Annotated[Length, Positive]
    """Extent along ``axis``."""


class OgiveForm(Model):
    """A shank with an ogive on it."""

    shape: Literal["ogive"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the low end of ``axis``: of the rear face, or of the tip where ``pointing = "low"``."""
    axis: Axis = "z"
    """Direction of the body's axis."""
    pointing: Literal["high", "low"] = "high"
    """At which end of ``axis`` the tip is."""
    radius: Annotated[Length, Positive]
    """Of the shank: half of the calibre."""
    shank: Annotated[Length, Field(ge=0)] = 0.0
    """Length of the cylinder behind the nose."""
    crh: Annotated[Ratio, Field(ge=0.5, le=1000)] | None = None
    """Calibre radius head: the radius of the arc over the diameter, 2 ``radius``. At 0.5 a tangent ogive is a
    hemisphere."""
    nose: Annotated[Length, Positive] | None = None
    """Length of the nose to its sharp tip. At least one of ``crh`` and ``nose`` is needed; with both the ogive is
    secant, and ``crh`` not below that of the tangent one, (nose / D)^2 + 1/4."""
    tip_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Of the ball that rounds the tip, tangent to the arc; which shortens the nose. 0 is a sharp tip, or a flat one."""
    meplat: Annotated[Length, Field(ge=0)] = 0.0
    """Diameter of the flat end that cuts off the tip; which shortens the nose. 0 is a sharp tip, or a round one."""


class BallPiece(Model):
    """What a plane cuts off a ball."""

    base: Point = (0.0, 0.0, 0.0)
    """Centre of the low end of ``axis``: of the flat face, or of the pole where ``pointing = "low"``."""
    axis: Axis = "z"
    """Normal of the flat face."""
    pointing: Literal["high", "low"] = "high"
    """At which end of ``axis`` the pole is."""
    radius: Annotated[Length, Positive]
    """Of the ball."""

    @property
    def rise(self) -> float:
        """Extent along ``axis``, m."""
        return self.radius


class HemisphereForm(BallPiece):
    """Half of a ball."""

    shape: Literal["hemisphere"]
    """The kind of body."""


class SphericalCapForm(BallPiece):
    """What a plane cuts off a ball."""

    shape: Literal["spherical_cap"]
    """The kind of body."""
    height: Annotated[Length, Positive]
    """Extent along ``axis``, below 2 ``radius``."""

    @property
    def rise(self) -> float:
        """Extent along ``axis``, m."""
        return self.height


class RingSectorForm(Model):
    """A piece of a tube between two half-planes through its axis."""

    shape: Literal["ring_sector"]
    """The kind of body."""
    base: Point = (0.0, 0.0, 0.0)
    """A point of the axis at the low end of ``axis``: the body lies between it and ``base`` plus ``length``."""
    axis: Axis = "z"
    """Direction of the tube's axis."""
    inner_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Of the bore; below ``radius``."""
    radius: Annotated[Length, Positive]
    """Of the outside."""
    length: Annotated[Length, Positive]
    """Extent along ``axis``."""
    start: Angle = 0.0
    """Where it begins, from the first direction across ``axis`` (x for z, y for x, z for y) to the second."""
    angle: Annotated[Angle, Field(gt=0, lt=6.283185307179586)]
    """From its beginning to its end, below a whole turn: ``"60 deg"``."""
