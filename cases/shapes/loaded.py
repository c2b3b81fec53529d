"""What tractions act on and what boxes hold before there is a mesh: areas, faces and nodes, by the shapes of bodies."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..estimates.mesh_size import FACES_PER_SURFACE, grid, mesh_size, surface_faces
from ..model.bodies import Box, Cylinder, Loose, MeshFile, Plate, RingSector, Sphere, Tube
from ..model.boundaries import Prescribed, Traction
from ..model.schema import Case, Part
from ..model.solids import Measured
from .geometry import Generated, Vector, surface, volume
from .placed import Placed, lattice
from .profile import Revolved, profile
from .region import Region, slack
from .sheets import sheets

_FINEST = 60
"""Patches along a side of a surface, at most. Chosen: a tenth of a second for a body."""
_MOST = 20
"""Bodies that are gone through for a boundary. Chosen: two seconds at most."""
_POINTS = 100_000
"""Nodes of a turned grid that are gone through. Chosen: half a second."""
_LATTICE = 20
"""Points a direction at which a body is looked at in a box. Chosen: 8,000 points in all."""
_FACETS, _CURVED, _FLAT = 0.3, 0.02, 1e-6
"""Of an area, what facets may have less than the surface that they stand for, and patches less or more: the square of
the size of an element by the radius times the first (a chord 1.3 times as long as an element and the end of a cylinder:
a sixth of it squared), and the second; the third of flat faces. Chosen, but for the sixth (geometry)."""
_CORNERS = 4.0
"""Faces of curved and unstructured meshes that may be in a region although no patch is, by the square of the size of an
element. Chosen."""
_FACTOR, _NODES = 3.0, 10
"""Between an estimate of nodes and their number, and nodes more. Chosen: in a layer of an unstructured mesh are a third
to three times as many as in the volume of a layer."""


@dataclass(frozen=True)
class Load:
    """What a boundary acts on, about: a traction on faces, a prescribed velocity on nodes. None where a mesh file or
    loose tets do not tell, and for the other kind of boundary.
    """

    boundary: int
    """Number of the boundary."""
    area: float | None = None
    """m^2."""
    faces: int | None = None
    spread: float = 0.0
    """By how much the area of the faces of a mesh may be another, m^2."""
    nodes: int | None = None
    fewest: int = 0
    """Of them, those in a box that is not widened by half an element on all sides."""
    exact: bool = False
    """Whether nodes, or faces of a mesh that was read, are counted and not estimated."""

    def agrees(self, nodes: int, faces: int, area: float) -> bool:
        """Whether a mesh has about as much: ``nodes`` that are driven, or ``faces`` with an ``area``, m^2."""
        if self.area is not None and faces:
            return abs(area - self.area) <= self.spread
        if self.nodes is None or faces:
            return True
        if self.exact:
            return nodes == self.nodes
        return self.fewest <= _FACTOR * nodes + _NODES and nodes <= _FACTOR * self.nodes + _NODES

    def words(self) -> str:
        """``about 32 faces, 4 mm^2``."""
        if self.area is not None:
            return f"{'' if self.exact else 'about '}{self.faces} faces, {1e6 * self.area:.6g} mm^2"
        if self.nodes is not None:
            return f"{self.nodes} nodes" if self.exact else f"about {self.nodes} nodes"
        return "not known before there is a mesh"


def loads(case: Case, counted: Sequence[Load] = ()) -> list[Load]:
    """Of each traction and each prescribed velocity of a case; ``counted``: in meshes that have been read."""
    known = {load.boundary: load for load in counted}
    return [known.get(load.boundary, load) for load in _loads(case)]


def _loads(case: Case) -> list[Load]:
    found = [_acted_on(case, number, spec) for number, spec in case.boundaries_of(Traction)]
    found += [_held(case, number, spec) for number, spec in case.boundaries_of(Prescribed)]
    return sorted(found, key=lambda load: load.boundary)


def parts_of(case: Case, spec: Traction | Prescribed) -> list[Part]:
    """Those that a boundary is for: where it is on a set and names none, all that have a mesh from a file."""
    if spec.on is not None and not spec.parts:
        return [part for part in case.parts if isinstance(part.mesh, MeshFile)]
    return [part for part in case.parts if not spec.parts or part.name in spec.parts]


def near(body: Placed) -> float:
    """How far outside of a region what belongs to a body is still in it, m; see ``region.slack``."""
    reach = max(abs(x) for corner in body.bounds() for x in corner)
    return slack(body.mesh, body.mesh.element_size, reach)


def _meets(region: Region, body: Placed) -> bool:
    """Whether a body reaches into the box of a region."""
    margin = near(body)
    return all(
        a <= top + margin and b >= bottom - margin
        for a, b, bottom, top in zip(region.low or (), region.high or (), *body.bounds(), strict=False)
    )


# Faces ----------------------------------------------------------------------------------------------------------------


def _reached(case: Case, spec: Traction | Prescribed) -> list[Placed] | None:
    """The bodies of a boundary into which its box reaches; None where a mesh file, loose tets or too many bodies do not
    tell.
    """
    region, found = Region.of(spec), list[Placed]()
    for part in parts_of(case, spec):
        if isinstance(part.mesh, Measured):
            return None
        body = Placed(part.mesh, part.turn)
        if not region.everything:
            if not _meets(region, body):
                continue
            if isinstance(part.mesh, Loose) or len(found) == _MOST:
                return None
        found.append(body)
    return found


def _acted_on(case: Case, number: int, spec: Traction) -> Load:
    bodies = _reached(case, spec)
    if bodies is None:
        return Load(number)
    found = [_faces(body, Region.of(spec)) for body in bodies]
    area, faces, spread = (sum(column) for column in zip(*found, strict=True)) if found else (0.0, 0.0, 0.0)
    return Load(number, area, round(faces), spread)


def _faces(body: Placed, region: Region) -> tuple[float, float, float]:
    """Area, m^2, and faces that a region has of a body, and by how much the area may be another."""
    mesh = body.mesh
    if region.everything:
        return surface(mesh), surface_faces(mesh), _facets(mesh) * surface(mesh)
    exact = block_faces(body, region)
    return (*exact, _FLAT * exact[0]) if exact is not None else _inside(body, region)


def planes_of(body: Placed, region: Region) -> list[int] | None:
    """How many planes of nodes across x, y and z a box holds of a block of cubes that is neither turned nor slit; None
    of other bodies and regions.
    """
    mesh, margin = body.mesh, near(body)
    if not isinstance(mesh, Box | Plate) or not _regular(mesh) or mesh.slit is not None or body.turn is not None:
        return None
    if region.low is None or region.high is None or region.cylinder is not None:
        return None
    found = []
    for row, low, high in zip(grid(mesh), region.low, region.high, strict=True):
        first = max(0, math.ceil((low - margin - row.start) / row.spacing))
        last = min(row.cells, math.floor((high + margin - row.start) / row.spacing))
        found.append(max(0, last - first + 1))
    return found


def block_faces(body: Placed, region: Region) -> tuple[float, int] | None:
    """Area, m^2, and faces that a box holds of such a block; None of other bodies and regions, and without a face."""
    planes, mesh, margin = planes_of(body, region), body.mesh, near(body)
    if planes is None or not isinstance(mesh, Box | Plate) or region.low is None or region.high is None:
        return None
    area, faces, rows = 0.0, 0, grid(mesh)
    for d, row in enumerate(rows):
        i, j = (d + 1) % 3, (d + 2) % 3
        ends = sum(
            region.low[d] - margin <= x <= region.high[d] + margin
            for x in (row.start, row.start + row.cells * row.spacing)
        )
        cells = max(0, planes[i] - 1) * max(0, planes[j] - 1) * ends
        area, faces = area + cells * rows[i].spacing * rows[j].spacing, faces + 2 * cells
    return (area, faces) if faces else None


def _inside(body: Placed, region: Region) -> tuple[float, float, float]:
    """Area, m^2, and faces of a body whose corners are in a region, of patches as large as elements; and by how much
    the area may be another: by that of patches on the border of the region, and of facets.
    """
    mesh, margin = body.mesh, near(body)
    area, rim = 0.0, 0.0
    for at, first, second in sheets(mesh):
        n, m = (max(1, min(_FINEST, round(length / mesh.element_size))) for length in (first, second))
        aligned = _regular(mesh) and max(first, second) <= _FINEST * mesh.element_size
        rows = [[body.turned(at(i / n, j / m)) for j in range(m + 1)] for i in range(n + 1)]
        held = [[bool(region.holds(point, margin)) for point in row] for row in rows]
        corners = [[sum(held[i][j : j + 2]) + sum(held[i + 1][j : j + 2]) for j in range(m)] for i in range(n)]
        for i, j in itertools.product(range(n), range(m)):
            if corners[i][j] > 2:
                patch = _quad(rows[i][j], rows[i + 1][j], rows[i + 1][j + 1], rows[i][j + 1])
                area += patch * (corners[i][j] == 4)
                rim += patch * (corners[i][j] == 3 or (not aligned and _on_rim(corners, i, j)))
    faces = (2.0 if _counted(mesh) else FACES_PER_SURFACE) * area / mesh.element_size**2
    corners_alone = 0.0 if _regular(mesh) else _CORNERS * mesh.element_size**2
    return area, max(faces, 1.0) if area else 0.0, rim + _facets(mesh) * area + corners_alone


def _on_rim(corners: list[list[int]], i: int, j: int) -> bool:
    """Whether a patch of a sheet has a neighbour that is not wholly in."""
    return any(count < 4 for row in corners[max(i - 1, 0) : i + 2] for count in row[max(j - 1, 0) : j + 2])


def _regular(mesh: Generated) -> bool:
    """Whether the faces of a mesh are halves of the patches."""
    return isinstance(mesh, Box | Plate) and mesh.generator == "structured"


def _facets(mesh: Generated) -> float:
    """Of the area of a body, what facets may have less or more than it."""
    if not isinstance(mesh, Cylinder | Tube | Sphere | Revolved | RingSector):
        return _FLAT
    radius = profile(mesh).widest() if isinstance(mesh, Revolved) else mesh.radius
    radius = mesh.inner_radius or radius if isinstance(mesh, Tube | RingSector) else radius
    return _CURVED + _FACETS * (mesh.element_size / radius) ** 2


def _quad(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """The area of a flat quadrilateral, m^2, by its diagonals."""
    (p, q, r), (s, t, u) = ([y - x for x, y in zip(*pair, strict=True)] for pair in ((a, c), (b, d)))
    return 0.5 * math.hypot(q * u - r * t, r * s - p * u, p * t - q * s)


# Nodes ----------------------------------------------------------------------------------------------------------------


def _held(case: Case, number: int, spec: Prescribed) -> Load:
    bodies = _reached(case, spec)
    if bodies is None:
        return Load(number)
    found = [_nodes(body, Region.of(spec)) for body in bodies]
    fewest, nodes = (sum(each[k] for each in found) for k in (0, 1))
    return Load(number, nodes=nodes, fewest=fewest, exact=all(exact for _, _, exact in found))


def _nodes(body: Placed, region: Region) -> tuple[int, int, bool]:
    """How many nodes a region has of a body, at least and at most, and whether they are counted."""
    if region.everything:
        every = mesh_size(body.mesh).nodes
        return every, every, _counted(body.mesh)
    count = _grid_nodes(body, region)
    return (count, count, True) if count is not None else (*_between(body, region), False)


def _counted(mesh: Generated) -> bool:
    """Whether the nodes of a mesh are known exactly."""
    return mesh.generator == "structured" and not isinstance(mesh, Sphere)


def _grid_nodes(body: Placed, region: Region) -> int | None:
    """The nodes of a block of cubes in a box; None for other meshes, and for turned ones of many nodes."""
    if (planes := planes_of(body, region)) is not None:
        return math.prod(planes)
    mesh, margin = body.mesh, near(body)
    if not isinstance(mesh, Box | Plate) or not _regular(mesh) or mesh.slit is not None:
        return None
    rows = grid(mesh)
    if math.prod(row.cells + 1 for row in rows) > _POINTS:
        return None
    x, y, z = ([row.start + k * row.spacing for k in range(row.cells + 1)] for row in rows)
    return sum(bool(region.holds(body.turned(point), margin)) for point in itertools.product(x, y, z))


def _between(body: Placed, region: Region) -> tuple[int, int]:
    """About how many nodes a body has in a box, and in the same half an element wider on all sides."""
    return _about(body, region, 0.0), _about(body, region, 0.5 * body.mesh.element_size)


def _about(body: Placed, region: Region, wider: float) -> int:
    """The nodes of a body in a box that is ``wider``, m, on all sides, by the volume that the body has in it."""
    assert region.low is not None
    assert region.high is not None
    bottom, top = body.bounds()
    (a, b, c), (d, e, f) = (
        [max(x - wider, y) for x, y in zip(region.low, bottom, strict=True)],
        [min(x + wider, y) for x, y in zip(region.high, top, strict=True)],
    )
    held = sum(body.holds(point) for point in lattice((a, b, c), (d, e, f), _LATTICE)) / _LATTICE**3
    share = held * (d - a) * (e - b) * (f - c) / volume(body.mesh)
    return math.ceil(mesh_size(body.mesh).nodes * min(share, 1.0)) if share > 0.0 else 0
