"""Sizes of elements in the current model: one size, or a grading."""

from typing import Any

from conoid.cases.model.grading import Grading

from .frame import Frame

GMSH_SIZE = 0.87
"""gmsh's size divided by ``element_size``. HXT makes 4 tets in the cube of its size. With this factor it makes 6
tets in element_size^3, as the structured generator does, and the mean edge is 1.15 element_size."""


def set_size(gmsh: Any, element_size: float, grading: Grading | None, frame: Frame) -> None:
    """Set the size of the whole model."""
    sizes = [element_size] if grading is None else [element_size, grading.far_size]
    if grading is not None:
        gmsh.model.mesh.field.setAsBackgroundMesh(graded(gmsh, element_size, grading, frame))
    for name, pick in (("Min", min), ("Max", max)):
        gmsh.option.setNumber(f"Mesh.MeshSize{name}", GMSH_SIZE * frame.length(pick(sizes)))


def graded(gmsh: Any, element_size: float, grading: Grading, frame: Frame) -> int:
    """Return the number of a field of gmsh. The field is a size that is a linear function of the distance from a
    point, from a line along an axis, or from a sphere or cylinder.
    """
    origin = frame.place(grading.origin)
    along = None if grading.axis is None else frame.direction(grading.axis)
    squares = [f"({'xyz'[i]}-({origin[i]!r}))^2" for i in range(3) if i != along]
    field = gmsh.model.mesh.field
    distance, size = field.add("MathEval"), field.add("Threshold")
    field.setString(distance, "F", f"Abs(Sqrt({'+'.join(squares)})-{frame.length(grading.radius)!r})")
    for name, value in (("DistMin", grading.near), ("DistMax", grading.far)):
        field.setNumber(size, name, frame.length(value))
    for name, value in (("SizeMin", element_size), ("SizeMax", grading.far_size)):
        field.setNumber(size, name, GMSH_SIZE * frame.length(value))
    field.setNumber(size, "InField", distance)
    return int(size)
