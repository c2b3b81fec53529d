"""How many tets and nodes the generators will make of a primitive, and the step length of its worst tet."""

import itertools
import math
from dataclasses import dataclass

from .bodies import Box, Cylinder, Grading, Plate, Sphere, Tube
from .geometry import Generated, bounds, centre, cut_directions, holds, index, surface, volume

TETS_PER_VOLUME, TETS_PER_SURFACE = 5.55, 1.42
NODES_PER_VOLUME, NODES_PER_SURFACE = 0.87, 1.23
"""gmsh makes a V / h^3 + b S / h^2 tets and nodes of a body with volume V and surface S: fitted to seven bodies."""

FACES_PER_SURFACE = 1.8
"""Faces of a surface S over S / h^2; a structured mesh has 2."""

REGULAR = 6**-0.5
"""Step length 1 / sqrt(sum |grad N|^2) of the regular tet, and of the tets of a cut cube, over the edge h."""
WORST_UNSTRUCTURED = 0.68
"""Step length of the worst tet of gmsh over that of a regular tet: 0.64 to 0.74 for the bodies of the fit."""
WORST_CYLINDER, WORST_TUBE = 0.81, 0.78
"""The same for structured cylinders cut into 6, and tubes."""
WORST_FIVE = 0.54
"""The same for structured cylinders cut into 5, times the cells along the radius: they flatten on the diagonal."""

_LATTICE = 20


@dataclass(frozen=True)
class MeshSize:
    """Counts, and the step length, m, of the worst tet: the stable time step is this over the wave speed."""

    elements: int
    nodes: int
    step_length: float


def mesh_size(mesh: Generated) -> MeshSize:
    """The size of the mesh of a primitive: exact counts for the structured generator, estimates for gmsh."""
    if mesh.generator == "structured" and not isinstance(mesh, Sphere):
        return _structured(mesh)
    per_volume, per_surface = _mean_powers(mesh)
    filling, covering = volume(mesh) * per_volume, surface(mesh) * per_surface
    elements = TETS_PER_VOLUME * filling + TETS_PER_SURFACE * covering
    nodes = NODES_PER_VOLUME * filling + NODES_PER_SURFACE * covering
    return MeshSize(max(6, round(elements)), max(8, round(nodes)), WORST_UNSTRUCTURED * REGULAR * mesh.element_size)


def surface_faces(mesh: Generated) -> int:
    """How many faces the surface of a primitive has, cuts of its sector included: an estimate."""
    return round(FACES_PER_SURFACE * surface(mesh) * _mean_powers(mesh)[1])


def _mean_powers(mesh: Generated) -> tuple[float, float]:
    """Means over the volume of 1 / h^3 and 1 / h^2 for the element size h, which grading makes vary."""
    if mesh.grading is None:
        return mesh.element_size**-3, mesh.element_size**-2
    sizes = [graded_size(mesh, point) for point in _lattice(mesh)]
    return math.fsum(h**-3 for h in sizes) / len(sizes), math.fsum(h**-2 for h in sizes) / len(sizes)


def _lattice(mesh: Generated) -> list[tuple[float, float, float]]:
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    lines = [[a + (b - a) * (i + 0.5) / _LATTICE for i in range(_LATTICE)] for a, b in zip(low, high, strict=True)]
    inside = [(x, y, z) for x, y, z in itertools.product(*lines) if holds(mesh, (x, y, z))]
    return inside or [centre(mesh)]


def graded_size(mesh: Generated, point: tuple[float, float, float]) -> float:
    """The element size, m, that a primitive asks for at ``point``."""
    grading = mesh.grading
    if grading is None:
        return mesh.element_size
    share = (_distance(grading, point) - grading.near) / (grading.far - grading.near)
    return mesh.element_size + (grading.far_size - mesh.element_size) * min(max(share, 0.0), 1.0)


def _distance(grading: Grading, point: tuple[float, float, float]) -> float:
    offsets = [x - o for x, o in zip(point, grading.origin, strict=True)]
    if grading.axis is not None:
        offsets[index(grading.axis)] = 0.0
    return math.hypot(*offsets)


def _structured(mesh: Box | Plate | Cylinder | Tube) -> MeshSize:
    if isinstance(mesh, Cylinder):
        return _structured_cylinder(mesh)
    if isinstance(mesh, Tube):
        return _structured_tube(mesh)
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    extents = [b - a for a, b in zip(low, high, strict=True)]
    counts = [_divisions(extent, mesh.element_size) for extent in extents]
    cell = [extent / count for extent, count in zip(extents, counts, strict=True)]
    return MeshSize(mesh.split * math.prod(counts), math.prod(n + 1 for n in counts), _cell_step(cell))


def _structured_cylinder(mesh: Cylinder) -> MeshSize:
    n, layers = _divisions(mesh.radius, mesh.element_size), _divisions(mesh.length, mesh.element_size)
    cut = len(cut_directions(mesh, mesh.axis))
    a, b = (n if cut > 0 else 2 * n), (n if cut > 1 else 2 * n)
    worst = WORST_CYLINDER if mesh.split == 6 else WORST_FIVE / n
    cell = [mesh.radius / n, mesh.radius / n, mesh.length / layers]
    return MeshSize(mesh.split * a * b * layers, (a + 1) * (b + 1) * (layers + 1), worst * _cell_step(cell))


def _structured_tube(mesh: Tube) -> MeshSize:
    rings, layers = (_divisions(extent, mesh.element_size) for extent in (mesh.radius - mesh.inner_radius, mesh.length))
    n = _divisions(math.pi / 4.0 * (mesh.radius + mesh.inner_radius), mesh.element_size)
    quarters = {"full": 4, "half": 2, "quarter": 1}[mesh.sector]
    lines = quarters * n + (mesh.sector != "full")
    arc = math.pi / 2.0 / n
    cell = [(mesh.radius - mesh.inner_radius) / rings, arc * mesh.inner_radius, mesh.length / layers]
    step = min(WORST_TUBE * REGULAR * mesh.element_size, _cell_step(cell))
    return MeshSize(mesh.split * rings * quarters * n * layers, (rings + 1) * lines * (layers + 1), step)


def _cell_step(cell: list[float]) -> float:
    """Step length of a tet that a box-shaped cell is cut into: 1 / sqrt(2 sum 1 / a^2), for every cut."""
    return 1.0 / math.sqrt(2.0 * sum(1.0 / length**2 for length in cell))


def _divisions(length: float, size: float) -> int:
    return max(1, round(length / size))
