"""Combinations of shapes before they are meshed: test of points, bounding box, approximate size of the mesh.

Whether a point lies inside is tested exactly; volumes are computed from the points of a lattice that lie inside. A
solid of a CAD file has no size before the file is read.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..estimates.mesh_size import (
    NODES_PER_SURFACE,
    NODES_PER_VOLUME,
    REGULAR,
    TETS_PER_SURFACE,
    TETS_PER_VOLUME,
    MeshSize,
)
from ..model.bodies import Box, Cone, Cylinder, Hemisphere, Ogive, Plate, RingSector, Sphere, SphericalCap, Tube
from ..model.operands import CombinedForm, DifferenceForm, FileForm, Operand, UnionForm
from ..model.solids import Combination
from ..model.tables import Axis, Model
from .geometry import Vector, across
from .graded import size_at, sizes_by_depth
from .placed import Placed, lattice

Bounds = tuple[Vector, Vector]
Inside = Callable[[Vector], bool]

WORST = 0.45
"""Step length of the worst tet in a mesh of gmsh, divided by the step length of a regular tet, for a combination
without edges shorter than an element. Measured: 0.3 to 0.7 for 40 of the combinations of
tests/mesh/test_combinations.py."""
_LATTICE = 12
"""Number of sampling points per direction of a combination (chosen value): 1,728 points in all, which give the volume
within some per cent."""
_BULKY = 1.5
"""Assumed surface of a combination, divided by the surface of a cube of the same volume (chosen value)."""
_BODIES: dict[str, type[Model]] = {
    "box": Box, "plate": Plate, "cylinder": Cylinder, "tube": Tube, "sphere": Sphere, "cone": Cone, "ogive": Ogive,
    "hemisphere": Hemisphere, "spherical_cap": SphericalCap, "ring_sector": RingSector,
}  # fmt: skip


def box_of(form: CombinedForm | Operand) -> Bounds | None:
    """Returns the low and the high corner of the bounding box of a shape, m; None for a file. The box of an operand is
    that before its rotation. For an empty intersection the low corner can be above the high corner.
    """
    if isinstance(form, FileForm):
        return None
    if not isinstance(form, CombinedForm):
        return _placed(form).bounds()
    found = [box_of(each) for each in form.of]
    boxes = [box for box, each in zip(found, form.of, strict=True) if box is not None and _unturned(each)]
    if isinstance(form, DifferenceForm):
        return found[0] if _unturned(form.of[0]) else None
    if isinstance(form, UnionForm) and len(boxes) < len(form.of):
        return None
    if not boxes:
        return None
    low, high = (min, max) if isinstance(form, UnionForm) else (max, min)
    (a, b, c), (d, e, f) = (
        [pick(each) for each in zip(*corners, strict=True)]
        for pick, corners in zip((low, high), zip(*boxes, strict=True), strict=True)
    )
    return (a, b, c), (d, e, f)


def _unturned(form: Operand) -> bool:
    """Whether the bounding box of an operand contains the operand at its position. The box contains the operand if no
    operand inside of the operand is turned.
    """
    return not isinstance(form, CombinedForm) or form.turn is None


def _placed(form: Operand) -> Placed:
    body: Any = _BODIES[form.shape].model_validate({**form.model_dump(exclude={"turn"}), "element_size": 1.0})
    return Placed(body, form.turn)


def inside(form: CombinedForm | Operand) -> Inside | None:
    """Returns a function that tests whether a point, m, lies in the shape. Make it once for many points. For a file the
    result is None.
    """
    if isinstance(form, FileForm):
        return None
    if not isinstance(form, CombinedForm):
        return _placed(form).holds
    asked = [inside(each) for each in form.of]
    known = [each for each in asked if each is not None]
    if len(known) < len(asked):
        return None
    turn = getattr(form, "turn", None)
    here = _joined(form, known)
    if turn is None:
        return here
    back = turn.model_copy(update={"angle": -turn.angle})
    carrier = Placed(Sphere(shape="sphere", radius=1.0, element_size=1.0), back)
    return lambda point: here(carrier.turned(point))


def _joined(form: CombinedForm, known: list[Inside]) -> Inside:
    if isinstance(form, UnionForm):
        return lambda point: any(each(point) for each in known)
    if isinstance(form, DifferenceForm):
        return lambda point: known[0](point) and not any(each(point) for each in known[1:])
    return lambda point: all(each(point) for each in known)


def modelled(mesh: Combination) -> Bounds | None:
    """Returns the bounding box of the modelled part of a combination, m; None where ``box_of`` returns None."""
    box = box_of(mesh)
    if box is None:
        return None
    low, high = list(box[0]), box[1]
    for d in cut_by(mesh.sector, mesh.axis):
        low[d] = max(low[d], mesh.centre[d])
    return (low[0], low[1], low[2]), high


def cut_by(sector: str, axis: Axis) -> tuple[int, ...]:
    """Returns the directions across ``axis`` in which a sector has only the positive side."""
    return across(axis)[: {"full": 0, "half": 1, "quarter": 2}[sector]]


@lru_cache(maxsize=256)
def combined_size(mesh: Combination) -> MeshSize | None:
    """Returns the approximate size of the mesh of a combination; None for a file, or for an empty combination."""
    box, holds = modelled(mesh), inside(mesh)
    if box is None or holds is None or any(a >= b for a, b in zip(*box, strict=True)):
        return None
    points = list(lattice(*box, _LATTICE))
    held = [point for point in points if holds(point)]
    cell = math.prod(b - a for a, b in zip(*box, strict=True)) / len(points)
    if not held:
        return None
    volume = cell * len(held)
    sizes = _sizes(mesh, held, volume)
    filling = volume * math.fsum(h**-3 for h in sizes) / len(sizes)
    covering = _skin(volume) * math.fsum(h**-2 for h in sizes) / len(sizes)
    elements = TETS_PER_VOLUME * filling + TETS_PER_SURFACE * covering
    nodes = NODES_PER_VOLUME * filling + NODES_PER_SURFACE * covering
    return MeshSize(max(6, round(elements)), max(8, round(nodes)), WORST * REGULAR * mesh.element_size)


def _sizes(mesh: Combination, held: list[Vector], volume: float) -> list[float]:
    """Returns the element sizes, m, at equal fractions of the volume, m^3. ``held``: points of a lattice that lie
    inside the shape, m.
    """
    grading = mesh.grading
    if grading is None:
        return [mesh.element_size] * len(held)
    if grading.surface:
        return sizes_by_depth(mesh.element_size, grading, volume, _skin(volume))
    graded = size_at(mesh.element_size, grading)
    return [graded(point) for point in held]


def _skin(volume: float) -> float:
    """Returns the approximate surface, m^2, of a combination with the given volume, m^3."""
    return float(_BULKY * 6.0 * volume ** (2.0 / 3.0))
