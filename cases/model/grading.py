"""Element sizes that grow with the distance from a place."""

from typing import Annotated

from pydantic import Field

from ..units import Length
from .tables import Axis, Model, Point, Positive


class Grading(Model):
    """Element size grows from ``element_size`` to ``far_size`` with the distance from a point, an axis line, or a
    sphere or cylinder round one of them.

    Within ``near`` of the origin (or the line through it along ``axis``) the size is ``element_size``, beyond ``far``
    it is ``far_size``, linear between. With ``radius`` distances are from the sphere (or cylinder) of that radius, on
    either side of it.
    """

    origin: Point = (0.0, 0.0, 0.0)
    """Where distances begin."""
    axis: Axis | None = None
    """Distances are from the line along it through ``origin``; without it from the point."""
    radius: Annotated[Length, Field(ge=0)] = 0.0
    """Of the sphere, or cylinder, from which distances are measured: 0 is the point, or the line."""
    near: Annotated[Length, Field(ge=0)]
    """Up to this distance the size is ``element_size``; below ``far``."""
    far: Annotated[Length, Positive]
    """From this distance on the size is ``far_size``."""
    far_size: Annotated[Length, Positive]
    """Not below ``element_size``."""
