"""Shapes whose dimensions follow from formulas, for tests."""

from typing import Any

from pydantic import TypeAdapter

from conoid.cases.model.bodies import Cone, Hemisphere, Mesh, Ogive, RingSector, SphericalCap
from conoid.cases.shapes.profile import Revolved

SHAPES: dict[str, dict[str, Any]] = {
    "frustum": {"shape": "cone", "radius": 0.5, "top_radius": 0.2, "length": 2.0, "axis": "y"},
    "cone": {"shape": "cone", "radius": 0.5, "length": 1.0},
    "tangent": {"shape": "ogive", "radius": 0.5, "crh": 3.0, "shank": 1.0},
    "secant": {"shape": "ogive", "radius": 0.5, "crh": 3.0, "nose": 1.2, "axis": "x", "pointing": "low"},
    "rounded": {"shape": "ogive", "radius": 0.5, "nose": 1.2, "shank": 0.5, "tip_radius": 0.2},
    "meplat": {"shape": "ogive", "radius": 0.5, "crh": 2.0, "meplat": 0.3, "pointing": "low"},
    "hemisphere": {"shape": "hemisphere", "radius": 0.7, "axis": "x"},
    "cap": {"shape": "spherical_cap", "radius": 0.7, "height": 1.1, "pointing": "low"},
    "ring": {"shape": "ring_sector", "inner_radius": 0.3, "radius": 0.7, "length": 0.5, "start": 0.5, "angle": 3.5},
    "wedge": {"shape": "ring_sector", "radius": 0.7, "length": 0.5, "angle": "60 deg", "start": "-30 deg", "axis": "y"},
}  # fmt: skip
Shape = Cone | Ogive | Hemisphere | SphericalCap | RingSector


def revolved(name: str, **more: Any) -> Revolved:
    """Returns a random body of revolution."""
    made = shape(name, **more)
    assert not isinstance(made, RingSector)
    return made


def shape(name: str, **more: Any) -> Shape:
    """Returns a random shape away from the origin, with elements of 0.1 m."""
    request = {"base": (0.1, 0.2, 0.3), "element_size": 0.1, **SHAPES[name], **more}
    made: Mesh = TypeAdapter[Mesh](Mesh).validate_python(request)
    assert isinstance(made, Shape)
    return made
