"""The shapes of bodies without their meshes, for mesh primitives and for operands of combinations."""

from typing import Annotated, Literal

from pydantic import Field

from ..units import Angle, Length, Ratio
from .tables import Axis, Model, Point, Positive


class BoxForm(Model):
    """A rectangular block between two corners."""

    shape: Literal["box"]
    """Selects this shape."""
    low: Point
    """Corner with the lowest coordinates."""
    high: Point
    """Corner with the highest coordinates, which are above those of ``low`` in every direction."""


class PlateForm(Model):
    """A rectangular plate with ``thickness`` along ``axis``, ``width`` and ``height`` across ``axis``."""

    shape: Literal["plate"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the face at the low end of ``axis``; the plate extends from this face by ``thickness``."""
    axis: Axis = "z"
    """Direction of the thickness."""
    width: Annotated[Length, Positive]
    """Extent in the first direction across ``axis`` (x for z, y for x, z for y), half of it on each side of
    ``base``."""
    height: Annotated[Length, Positive]
    """Extent in the second direction across ``axis`` (y for z, z for x, x for y), half of it on each side of
    ``base``."""
    thickness: Annotated[Length, Positive]
    """Extent of the plate along ``axis``."""


class CylinderForm(Model):
    """A solid cylinder. The key ``base`` is the centre of the end face at the low end of ``axis``."""

    shape: Literal["cylinder"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end face at the low end of ``axis``; the cylinder extends from this face by ``length``."""
    axis: Axis = "z"
    """Direction of the cylinder's axis."""
    radius: Annotated[Length, Positive]
    """Radius of the cylinder."""
    length: Annotated[Length, Positive]
    """Length of the cylinder, along ``axis``."""


class TubeForm(Model):
    """A hollow cylinder."""

    shape: Literal["tube"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end face at the low end of ``axis``; the tube extends from this face by ``length``."""
    axis: Axis = "z"
    """Direction of the tube's axis."""
    inner_radius: Annotated[Length, Positive]
    """Inner radius of the tube; below ``radius``."""
    radius: Annotated[Length, Positive]
    """Outer radius of the tube."""
    length: Annotated[Length, Positive]
    """Length of the tube, along ``axis``."""


class SphereForm(Model):
    """A solid sphere."""

    shape: Literal["sphere"]
    """Selects this shape."""
    centre: Point = (0.0, 0.0, 0.0)
    """Centre of the sphere."""
    axis: Axis = "z"
    """Direction across which a sector is cut."""
    radius: Annotated[Length, Positive]
    """Radius of the sphere."""


class ConeForm(Model):
    """A cone or a truncated cone: ``radius`` at ``base``, ``top_radius`` at the high end of ``axis``."""

    shape: Literal["cone"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the end at the low end of ``axis``; the cone extends from this end by ``length``."""
    axis: Axis = "z"
    """Direction of the cone's axis."""
    radius: Annotated[Length, Field(ge=0)]
    """Radius of the cone at ``base``; 0: the tip of the cone is at ``base``."""
    top_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Radius of the cone at the high end of ``axis``; 0: the tip of the cone is at the high end. At least one of
    ``radius`` and ``top_radius`` is above 0."""
    length: Annotated[Length, Positive]
    """Height of the cone, along ``axis``."""


class OgiveForm(Model):
    """A projectile: a cylindrical shank with an ogival nose."""

    shape: Literal["ogive"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Centre of the low end of ``axis``: centre of the rear face, or the tip with ``pointing = "low"``."""
    axis: Axis = "z"
    """Direction of the projectile's axis."""
    pointing: Literal["high", "low"] = "high"
    """End of ``axis`` to which the tip points."""
    radius: Annotated[Length, Positive]
    """Radius of the shank, half of the calibre."""
    shank: Annotated[Length, Field(ge=0)] = 0.0
    """Length of the cylindrical shank behind the nose."""
    crh: Annotated[Ratio, Field(ge=0.5, le=1000)] | None = None
    """Calibre radius head (CRH): radius of the arc of the ogive divided by the diameter of the shank. A tangent ogive
    with a CRH of 0.5 is a hemisphere."""
    nose: Annotated[Length, Positive] | None = None
    """Length of the nose up to its sharp tip. At least one of ``crh`` and ``nose`` is required. If both are given,
    ``crh`` must be at least that of the tangent ogive, (nose / D)^2 + 1/4, with the diameter D of the shank."""
    tip_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Radius of a sphere that rounds the tip, tangent to the arc; the sphere shortens the nose. 0: no rounding. The key
    ``tip_radius`` must not be combined with ``meplat``."""
    meplat: Annotated[Length, Field(ge=0)] = 0.0
    """Diameter of a flat face that cuts off the tip (meplat); the flat face shortens the nose. 0: no flat face. The key
    ``meplat`` must not be combined with ``tip_radius``."""


class BallPiece(Model):
    """Common keys of segments of a sphere."""

    base: Point = (0.0, 0.0, 0.0)
    """Centre of the low end of ``axis``: centre of the flat face, or the pole with ``pointing = "low"``."""
    axis: Axis = "z"
    """Normal of the flat face."""
    pointing: Literal["high", "low"] = "high"
    """End of ``axis`` at which the pole of the spherical surface is."""
    radius: Annotated[Length, Positive]
    """Radius of the sphere."""

    @property
    def rise(self) -> float:
        """Extent of the segment along ``axis``, m."""
        return self.radius


class HemisphereForm(BallPiece):
    """Half of a sphere."""

    shape: Literal["hemisphere"]
    """Selects this shape."""


class SphericalCapForm(BallPiece):
    """A segment of a sphere, cut off by a plane."""

    shape: Literal["spherical_cap"]
    """Selects this shape."""
    height: Annotated[Length, Positive]
    """Extent of the segment along ``axis``; below 2 ``radius``."""

    @property
    def rise(self) -> float:
        """Extent of the segment along ``axis``, m."""
        return self.height


class RingSectorForm(Model):
    """A segment of a tube between two half-planes through its axis."""

    shape: Literal["ring_sector"]
    """Selects this shape."""
    base: Point = (0.0, 0.0, 0.0)
    """Point of the tube's axis at the low end of ``axis``; the body extends from this point by ``length``."""
    axis: Axis = "z"
    """Direction of the tube's axis."""
    inner_radius: Annotated[Length, Field(ge=0)] = 0.0
    """Inner radius of the segment; below ``radius``. 0: a segment of a solid cylinder."""
    radius: Annotated[Length, Positive]
    """Outer radius of the segment."""
    length: Annotated[Length, Positive]
    """Length of the segment, along ``axis``."""
    start: Angle = 0.0
    """Angle at which the segment starts, measured from the first direction across ``axis`` (x for z, y for x, z for y)
    towards the second direction."""
    angle: Annotated[Angle, Field(gt=0, lt=6.283185307179586)]
    """Angle from the start to the end of the segment, below 360 degrees, such as ``"60 deg"``."""
