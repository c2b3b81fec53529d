"""Drawing of forms into the current model. Each form is drawn in its own frame and then moved into the frame of the
model.
"""

import math
from collections.abc import Sequence
from typing import Any

from conoid.cases.model.forms import (
    BallPiece,
    BoxForm,
    ConeForm,
    CylinderForm,
    OgiveForm,
    PlateForm,
    RingSectorForm,
    SphereForm,
    TubeForm,
)
from conoid.cases.model.motion import Turn
from conoid.cases.model.tables import Axis
from conoid.cases.shapes.geometry import index
from conoid.cases.shapes.profile import Arc, Profile, Segment, profile

from .frame import Frame, Vector

Solids = list[tuple[int, int]]
"""Entities of gmsh. Each entity is given by its dimension and its number."""
Angles = tuple[float, float]
Form = (
    BoxForm | PlateForm | CylinderForm | TubeForm | SphereForm | ConeForm | OgiveForm | BallPiece
    | RingSectorForm
)  # fmt: skip

ROUND: Angles = (0.0, 2.0 * math.pi)
"""Full range of angles of a body of revolution, rad."""


def drawn(occ: Any, form: Form, frame: Frame, ranges: Sequence[Angles] = (ROUND,)) -> Solids:
    """Draw the form in the ``frame`` of the model. ``ranges`` are the angles in which a body of revolution or a ring
    sector is drawn.
    """
    scale, made = frame.scale, Solids()
    if isinstance(form, BoxForm):
        made = _box(occ, [x / scale for x in form.low], [x / scale for x in form.high])
    elif isinstance(form, PlateForm):
        a, b, c = form.width / 2.0 / scale, form.height / 2.0 / scale, form.thickness / scale
        made = _box(occ, [-a, -b, 0.0], [a, b, c])
    elif isinstance(form, SphereForm):
        made = [(3, occ.addSphere(0, 0, 0, form.radius / scale))]
    elif isinstance(form, CylinderForm | TubeForm):
        made = _barrel(occ, form, scale)
    elif isinstance(form, RingSectorForm):
        made = [each for begin, end in ranges for each in _ring(occ, form, scale, begin, end)]
    else:
        made = [each for begin, end in ranges for each in _revolved(occ, profile(form), scale, begin, end)]
    into(occ, made, _axis(form), _start(form), frame)
    return made


def into(occ: Any, solids: Solids, axis: Axis, start: Vector, frame: Frame) -> None:
    """Move solids into the frame of the model. In the frame of the solids the origin is at ``start``, m, and the third
    direction is along ``axis``.
    """
    steps = ((index(axis) + 1) - (index(frame.axis) + 1)) % 3
    if steps:
        occ.rotate(solids, 0, 0, 0, 1, 1, 1, steps * 2.0 * math.pi / 3.0)
    away = frame.place(start)
    if any(away):
        occ.translate(solids, *away)


def turn(occ: Any, solids: Solids, by: Turn | None, frame: Frame) -> None:
    """Rotate solids of the model by the rotation of a case."""
    if by is not None:
        along = [0.0, 0.0, 0.0]
        along[frame.direction(by.axis)] = 1.0
        occ.rotate(solids, *frame.place(by.centre), *along, by.angle)


def _axis(form: Form) -> Axis:
    return "z" if isinstance(form, BoxForm) else form.axis


def _start(form: Form) -> Vector:
    if isinstance(form, BoxForm):
        return (0.0, 0.0, 0.0)
    return form.centre if isinstance(form, SphereForm) else form.base


def _box(occ: Any, low: list[float], high: list[float]) -> Solids:
    return [(3, occ.addBox(*low, *(b - a for a, b in zip(low, high, strict=True))))]


def _barrel(occ: Any, form: CylinderForm | TubeForm, scale: float) -> Solids:
    made = [(3, occ.addCylinder(0, 0, 0, 0, 0, form.length / scale, form.radius / scale))]
    if isinstance(form, TubeForm):
        hole = [(3, occ.addCylinder(0, 0, 0, 0, 0, form.length / scale, form.inner_radius / scale))]
        made, _ = occ.cut(made, hole)
    return made


def _ring(occ: Any, form: RingSectorForm, scale: float, begin: float, end: float) -> Solids:
    if (begin, end) == ROUND:
        begin, end = form.start, form.start + form.angle
    inner, outer, top = (each / scale for each in (form.inner_radius, form.radius, form.length))
    corners = [occ.addPoint(r, 0, z) for r, z in ((inner, 0.0), (outer, 0.0), (outer, top), (inner, top))]
    sides = [occ.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    return _swept(occ, sides, begin, end)


def _revolved(occ: Any, outline: Profile, scale: float, begin: float, end: float) -> Solids:
    """Draw the solid that results from a rotation about the axis of the area between the outline and the axis."""
    segments = outline.segments
    low, high = (radius / scale for radius in outline.ends)
    start = occ.addPoint(0, 0, 0)
    last = point = start if low == 0.0 else occ.addPoint(low, 0, 0)
    sides = [] if low == 0.0 else [occ.addLine(start, point)]
    top = occ.addPoint(0, 0, outline.height / scale)
    for each in segments:
        tip = each is segments[-1] and high == 0.0
        point = top if tip else occ.addPoint(each.r1 / scale, 0, each.z1 / scale)
        sides.append(_side(occ, each, last, point, scale))
        last = point
    if high > 0.0:
        sides.append(occ.addLine(last, top))
    sides.append(occ.addLine(top, start))
    if (begin, end) == ROUND and min(low, high) == 0.0:
        return _in_thirds(occ, sides)
    return _swept(occ, sides, begin, end)


def _side(occ: Any, each: Segment, first: int, last: int, scale: float) -> int:
    if isinstance(each, Arc):
        centre = occ.addPoint(each.rc / scale, 0, each.zc / scale)
        return int(occ.addCircleArc(first, centre, last))
    return int(occ.addLine(first, last))


def _in_thirds(occ: Any, sides: list[int]) -> Solids:
    """Draw a body of revolution with a surface of three faces that have a common tip. Three faces are needed: if a
    slender tip has only one face, gmsh makes two triangles with the same three nodes.
    """
    third = _swept(occ, sides, 0.0, ROUND[1] / 3.0)
    others = [occ.copy(third) for _ in range(2)]
    for k, each in enumerate(others, 1):
        occ.rotate(each, 0, 0, 0, 0, 0, 1, k * ROUND[1] / 3.0)
    made: Solids = occ.fuse(third, [*others[0], *others[1]])[0]
    return made


def _swept(occ: Any, sides: list[int], begin: float, end: float) -> Solids:
    """Return the volume that results from a rotation of the area within ``sides`` between two angles, rad. The drawn
    area is removed.
    """
    area = occ.addPlaneSurface([occ.addCurveLoop(sides)])
    if begin:
        occ.rotate([(2, area)], 0, 0, 0, 0, 0, 1, begin)
    made = [each for each in occ.revolve([(2, area)], 0, 0, 0, 0, 0, 1, end - begin) if each[0] == 3]
    occ.remove([(2, area)], recursive=True)
    return made
