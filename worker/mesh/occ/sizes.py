"""Element sizes in the current model: one size, or a grading (a size that depends on the position)."""

import math
from collections.abc import Sequence
from typing import Any

from conoid.cases.model.grading import Grading

from .frame import Frame
from .sliding import Cut

GMSH_SIZE = 0.87
"""Size given to gmsh, divided by ``element_size``. In a cube with an edge of the given size HXT makes 4 tets. With this
factor HXT makes 6 tets in a cube with the edge element_size, as the structured generator does, and the mean edge is
1.15 element_size."""
_FINEST = 400
"""Largest number of points of a face, in each direction, from which distances are measured. Chosen value: gmsh needs a
second for the 160,000 points of a face."""
_FLAT = 1e-6
"""Largest thickness of a face that counts as lying on a cut plane of a sector, in units of the model. The thickness is
above the tolerance of OpenCASCADE, 1e-7."""


def set_size(
    gmsh: Any, element_size: float, grading: Grading | None, frame: Frame, cuts: Sequence[Cut] = ()
) -> None:  # fmt: skip
    """Set the element size of the whole model. ``cuts``: planes of the frame on which the model is cut."""
    sizes = [element_size] if grading is None else [element_size, grading.far_size]
    if grading is not None:
        volumes = [tag for _, tag in gmsh.model.getEntities(3)]
        gmsh.model.mesh.field.setAsBackgroundMesh(graded(gmsh, element_size, grading, frame, volumes, cuts))
    for name, pick in (("Min", min), ("Max", max)):
        gmsh.option.setNumber(f"Mesh.MeshSize{name}", GMSH_SIZE * frame.length(pick(sizes)))


def graded(
    gmsh: Any, element_size: float, grading: Grading, frame: Frame, volumes: Sequence[int], cuts: Sequence[Cut]
) -> int:  # fmt: skip
    """Return the number of a gmsh field: the element size as a linear function of a distance.

    ``volumes``: numbers of the volumes of the body; ``cuts``: planes of the frame on which the body is cut.
    """
    field = gmsh.model.mesh.field
    if grading.surface:
        distance = _depth(gmsh, max(frame.length(grading.near), frame.length(element_size)), volumes, cuts)
    else:
        distance = field.add("MathEval")
        field.setString(distance, "F", _distance(grading, frame))
    size = field.add("Threshold")
    for name, value in (("DistMin", grading.near), ("DistMax", grading.far)):
        field.setNumber(size, name, frame.length(value))
    for name, value in (("SizeMin", element_size), ("SizeMax", grading.far_size)):
        field.setNumber(size, name, GMSH_SIZE * frame.length(value))
    field.setNumber(size, "InField", distance)
    return int(size)


def _distance(grading: Grading, frame: Frame) -> str:
    """Return the gmsh expression of the distance from a point, a line along an axis, a plane, a sphere or a
    cylinder.
    """
    origin = frame.place(grading.origin)
    if grading.normal is not None:
        d = frame.direction(grading.normal)
        return f"Abs({'xyz'[d]}-({origin[d]!r}))"
    along = None if grading.axis is None else frame.direction(grading.axis)
    squares = [f"({'xyz'[i]}-({origin[i]!r}))^2" for i in range(3) if i != along]
    return f"Abs(Sqrt({'+'.join(squares)})-{frame.length(grading.radius)!r})"


def _depth(gmsh: Any, fine: float, volumes: Sequence[int], cuts: Sequence[Cut]) -> int:
    """Return the number of a gmsh field: the distance from the surface of ``volumes``, measured from points on the
    faces.

    The distance between two points is half of ``fine``. Therefore the distance computed for a node on the surface is
    below ``fine``.
    """
    field, model = gmsh.model.mesh.field, gmsh.model
    faces = [abs(tag) for _, tag in model.getBoundary([(3, tag) for tag in volumes], combined=True, oriented=False)]
    boxes = {tag: model.getBoundingBox(2, tag) for tag in faces}
    outer = [tag for tag, box in boxes.items() if not any(_lies_on(box, cut) for cut in cuts)]
    longest = max((math.dist(boxes[tag][:3], boxes[tag][3:]) for tag in outer), default=0.0)
    distance = field.add("Distance")
    field.setNumbers(distance, "SurfacesList", outer)
    field.setNumber(distance, "Sampling", min(max(math.ceil(2.0 * longest / fine), 20), _FINEST))
    return int(distance)


def _lies_on(box: Sequence[float], cut: Cut) -> bool:
    """Return True if a face lies on a plane of the frame; ``box``: lowest and highest corner of the face."""
    d, at = cut
    return max(abs(box[d] - at), abs(box[3 + d] - at)) < _FLAT
