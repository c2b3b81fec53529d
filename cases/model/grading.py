"""Graded meshes: the element size grows with the distance from a region of interest."""

from typing import Annotated

from pydantic import Field

from ..units import Length
from .tables import Axis, Model, Point, Positive


class Grading(Model):
    """A graded mesh. The element size is ``element_size`` up to the distance ``near`` and ``far_size`` from the
    distance ``far`` on; it is linear between the two distances.

    Distances are measured from the point ``origin``; with ``axis``, from the line through ``origin``; with ``normal``,
    from the plane through ``origin``; with ``radius``, to both sides from the surface of a sphere (with ``axis``: of a
    cylinder) around ``origin``; with ``surface``, from the surface of the body.
    """

    origin: Point = (0.0, 0.0, 0.0)
    """Point from which distances are measured."""
    axis: Axis | None = None
    """Direction of a line through ``origin``; distances are measured from this line."""
    normal: Axis | None = None
    """Normal of a plane through ``origin``; distances are measured from this plane, to both sides. The key ``normal``
    must not be combined with ``axis`` or ``radius``."""
    radius: Annotated[Length, Field(ge=0)] = 0.0
    """Radius of a sphere, or with ``axis`` of a cylinder; distances are measured from its surface. 0: from the point or
    line itself."""
    surface: bool = False
    """Whether distances are measured from the surface of the body, without the cuts of a sector: the tets are small at
    the surface and coarse inside. The key ``surface`` must not be combined with ``origin``, ``axis``, ``normal`` or
    ``radius``."""
    near: Annotated[Length, Field(ge=0)]
    """Distance up to which the element size is ``element_size``; below ``far``."""
    far: Annotated[Length, Positive]
    """Distance from which on the element size is ``far_size``."""
    far_size: Annotated[Length, Positive]
    """Element size at a distance of ``far`` and more; not below ``element_size``."""
