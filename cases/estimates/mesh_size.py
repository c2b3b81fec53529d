"""Estimates of the mesh of a primitive: number of tets, nodes and faces, and the step length of its worst tet (the one
with the smallest stable time step).
"""

import math
from dataclasses import dataclass
from functools import lru_cache

from ..model.bodies import Box, Cylinder, Plate, RingSector, Shards, Sphere, Tube, TwoTets
from ..model.grading import Grading
from ..shapes.geometry import (
    Generated,
    across,
    bounds,
    centre,
    cut_directions,
    round_part,
    side_areas,
    surface,
    tets,
    volume,
)
from ..shapes.graded import size_at, sizes_by_depth
from ..shapes.profile import Revolved, tips

TETS_PER_VOLUME, TETS_PER_SURFACE = 5.55, 1.42
NODES_PER_VOLUME, NODES_PER_SURFACE = 0.87, 1.23
"""Coefficients a and b of the number of nodes; those of the number of tets are above. For a body with volume V, surface
S and element size h, gmsh makes a V / h^3 + b S / h^2 tets or nodes. The coefficients were fitted to seven bodies."""

FACES_PER_SURFACE = 1.8
"""Number of surface faces divided by S / h^2, for the surface S and the element size h in meshes of gmsh. The
structured generator has the value 2."""

REGULAR = 6**-0.5
"""Step length 1 / sqrt(sum |grad N|^2) divided by the edge h, for a regular tet; the tets of a cut cube have the same
value."""
WORST_UNSTRUCTURED = 0.68
"""Step length of the worst tet in a mesh of gmsh, divided by the step length of a regular tet. Measured: 0.64 to 0.74
for the seven bodies of the fit."""
SHARP, BLUNT = 1.3, 0.9
"""Largest step length of a tet at the tip of a cone or an ogive, divided by h. Sharp tip: the first value times the
tangent of half the angle of the tip. Flat or round tip: the second value times the radius of the tip divided by h.
Measured for full bodies and sectors: 0.16 to 0.25 and 0.40 to 0.68 for cones whose half angle is 9 and 27 degrees; 0.20
to 0.24 and 0.20 to 0.64 for tips whose radius is h/4 and h/2."""
WORST_CYLINDER, WORST_TUBE = 0.81, 0.78
"""Step length of the worst tet, divided by that of a cut cube: in structured cylinders whose cells are cut into 6 tets,
and in structured tubes."""
WORST_FIVE = 0.54
"""The same ratio for structured cylinders whose cells are cut into 5 tets, times the number of cells along the radius:
the tets on the diagonal become flat."""
WORST_SHARD = 1.7
"""Relative reduction of the step length of the worst separate tet, divided by ``perturbation``. Measured: 1.5 to 1.9
among 1,000 and 10,000 tets."""

_LATTICE = 20
"""Number of sampling points per direction for the mean of a graded element size: 8,000 points in all (chosen value)."""


@dataclass(frozen=True)
class MeshSize:
    """Number of tets, number of nodes, and step length of the worst tet, m. The stable time step is the step length
    divided by the wave speed.
    """

    elements: int
    nodes: int
    step_length: float


def mesh_size(mesh: Generated) -> MeshSize:
    """Returns the size of the mesh of a primitive: exact numbers for the structured generator, estimates for gmsh."""
    if not isinstance(mesh, Sphere | Revolved | RingSector) and mesh.generator == "structured":
        return _structured(mesh)
    filling, covering = volume(mesh) * _mean_powers(mesh)[0], _covering(mesh)
    elements = TETS_PER_VOLUME * filling + TETS_PER_SURFACE * covering
    nodes = NODES_PER_VOLUME * filling + NODES_PER_SURFACE * covering
    return MeshSize(max(6, round(elements)), max(8, round(nodes)), _worst(mesh) * REGULAR * mesh.element_size)


def _worst(mesh: Generated) -> float:
    """Returns the step length of the worst tet in a mesh of gmsh, divided by the step length of a regular tet."""
    if not isinstance(mesh, Revolved):
        return WORST_UNSTRUCTURED
    at_tips = [SHARP * slope if radius == 0.0 else BLUNT * radius / mesh.element_size for radius, slope in tips(mesh)]
    return min(WORST_UNSTRUCTURED, *at_tips)


def surface_faces(mesh: Generated) -> int:
    """Returns the estimated number of surface faces of a primitive, including the faces on the cuts of its sector."""
    return round(FACES_PER_SURFACE * _covering(mesh))


def _covering(mesh: Generated) -> float:
    """Returns the integral of 1 / h^2 over the surface and the cuts of the sector, with the element size h. In a mesh
    graded by the depth below the surface, h is ``element_size`` on the whole surface. In other meshes the mean of 1 /
    h^2 over the volume is used.
    """
    if mesh.grading is None or not mesh.grading.surface:
        return surface(mesh) * _mean_powers(mesh)[1]
    whole = mesh.model_copy(update={"sector": "full"})
    skin = surface(whole) * volume(mesh) / volume(whole)
    return skin * mesh.element_size**-2 + (surface(mesh) - skin) * _mean_powers(mesh)[1]


@lru_cache(maxsize=4096)
def _mean_powers(mesh: Generated) -> tuple[float, float]:
    """Returns means over the volume of 1 / h^3 and 1 / h^2 for the element size h of a graded mesh."""
    if mesh.grading is None:
        return mesh.element_size**-3, mesh.element_size**-2
    sizes = _sizes(mesh, mesh.grading)
    return math.fsum(h**-3 for h in sizes) / len(sizes), math.fsum(h**-2 for h in sizes) / len(sizes)


def _sizes(mesh: Generated, grading: Grading) -> list[float]:
    """Returns the element sizes, m, of equal fractions of the volume of a graded primitive."""
    if grading.surface:
        whole = mesh.model_copy(update={"sector": "full"})
        return sizes_by_depth(mesh.element_size, grading, volume(whole), surface(whole))
    graded = size_at(mesh.element_size, grading)
    return [graded(point) for point in _lattice(mesh)]


def _lattice(mesh: Generated) -> list[tuple[float, float, float]]:
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    lines = [[a + (b - a) * (i + 0.5) / _LATTICE for i in range(_LATTICE)] for a, b in zip(low, high, strict=True)]
    inside = round_part(mesh)
    return [point for x in lines[0] for y in lines[1] for z in lines[2] if inside(point := (x, y, z))] or [centre(mesh)]


def _structured(mesh: Box | Plate | Cylinder | Tube | TwoTets | Shards) -> MeshSize:
    if isinstance(mesh, TwoTets | Shards):
        return _loose(mesh)
    if isinstance(mesh, Cylinder):
        return _structured_cylinder(mesh)
    if isinstance(mesh, Tube):
        return _structured_tube(mesh)
    rows = grid(mesh)
    cells, nodes = math.prod(row.cells for row in rows), math.prod(row.cells + 1 for row in rows)
    return MeshSize(mesh.split * cells, nodes + math.prod(slit_lines(mesh)), _cell_step([row.spacing for row in rows]))


@dataclass(frozen=True)
class Row:
    """The planes of nodes of the structured generator that are normal to one direction: coordinate ``start`` of the
    first plane and distance ``spacing`` between planes, m.
    """

    start: float
    spacing: float
    cells: int

    def place(self, x: float) -> float:
        """Number of spacings from the first plane to the coordinate ``x``, m; a number that is whole within rounding
        errors counts as whole.
        """
        place = (x - self.start) / self.spacing
        return round(place) if abs(place - round(place)) < 1e-6 else place


def grid(mesh: Box | Plate) -> list[Row]:
    """Planes of nodes across x, y and z."""
    low, high = bounds(mesh) or ((0.0,) * 3, (0.0,) * 3)
    counts = [_divisions(b - a, mesh.element_size) for a, b in zip(low, high, strict=True)]
    return [Row(a, (b - a) / n, n) for a, b, n in zip(low, high, counts, strict=True)]


def slit_lines(mesh: Box | Plate) -> tuple[int, int]:
    """Numbers of lines of nodes that a slit doubles, in the two directions across the axis of the slit; 0, 0 without a
    slit.
    """
    if mesh.slit is None:
        return 0, 0
    rows = [grid(mesh)[d] for d in across(mesh.slit.axis)]
    first, second = (
        max(0, _doubled(row, row.place(low), row.place(high)))
        for row, low, high in zip(rows, mesh.slit.low, mesh.slit.high, strict=True)
    )
    return first, second


def _doubled(row: Row, low: float, high: float) -> int:
    """Number of planes between two coordinates. A border on the surface of the body counts; a border inside the body
    does not count.
    """
    first = 0 if low <= 0 else math.floor(low) + 1
    last = row.cells if high >= row.cells else math.ceil(high) - 1
    return last - first + 1


def _loose(mesh: TwoTets | Shards) -> MeshSize:
    if isinstance(mesh, TwoTets):
        areas = math.hypot(math.sqrt(3.0) / 4.0 * mesh.element_size**2, *side_areas(mesh)[:3])
        return MeshSize(2, 5, 1.5 * volume(mesh) / areas)
    shrunk = 1.0 - WORST_SHARD * mesh.perturbation
    return MeshSize(tets(mesh), 4 * tets(mesh), shrunk * REGULAR * mesh.element_size)


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
    """Step length of a tet of a box-shaped cell with the edges a, m: 1 / sqrt(2 sum 1 / a^2), the same for both ways of
    cutting the cell.
    """
    return 1.0 / math.sqrt(2.0 * sum(1.0 / length**2 for length in cell))


def _divisions(length: float, size: float) -> int:
    return max(1, round(length / size))
