"""Estimates, from the shapes of bodies before there is a mesh, of the faces on which tractions act and of the nodes in
a box.
"""

import itertools
import math
from collections.abc import Sequence

from ..estimates.mesh_size import FACES_PER_SURFACE, grid, mesh_size, surface_faces
from ..model.bodies import Box, Cylinder, Loose, MeshFile, Plate, RingSector, Sphere, Tube
from ..model.boundaries import Prescribed, Symmetry, Traction
from ..model.schema import Case, Part
from ..model.solids import Measured
from .geometry import Generated, Vector, surface, volume
from .load import Load
from .placed import Placed, lattice
from .profile import Revolved, profile
from .region import Region, slack
from .sheets import sheets

_FINEST = 60
"""Largest number of patches along a side of a surface; a body then takes a tenth of a second (chosen value)."""
_MOST = 20
"""Largest number of bodies of one boundary; they take two seconds at most (chosen value)."""
_POINTS = 100_000
"""Largest number of nodes of a turned grid that are tested; they take half a second (chosen value)."""
_LATTICE = 20
"""Number of sampling points per direction for a body that is partly in a box: 8,000 points in all (chosen value)."""
_FACETS, _CURVED, _FLAT = 0.3, 0.02, 1e-6
"""Relative errors of an estimated area: the facets of a mesh have less area than a curved surface, and patches may have
less or more area. Curved faces: the first value times the square of the ratio of element size to radius, plus the
second value. Flat faces: the third value. The geometry of a chord 1.3 times as long as an element, and of the end face
of a cylinder, gives a sixth of the squared ratio; all three values are chosen."""
_CORNERS = 4.0
"""Area of mesh faces that a region may contain although it contains no patch, divided by the square of the element
size, for curved and unstructured meshes (chosen value)."""


def loads(case: Case, counted: Sequence[Load] = ()) -> list[Load]:
    """Returns the estimate of each traction and each prescribed velocity of a case. ``counted``: the results for meshes
    that have been read.
    """
    known = {load.boundary: load for load in counted}
    return [known.get(load.boundary, load) for load in _loads(case)]


def _loads(case: Case) -> list[Load]:
    found = [_acted_on(case, number, spec) for number, spec in case.boundaries_of(Traction)]
    found += [_held(case, number, spec) for number, spec in case.boundaries_of(Prescribed)]
    return sorted(found, key=lambda load: load.boundary)


def parts_of(case: Case, spec: Traction | Prescribed) -> list[Part]:
    """Returns the parts on which a boundary acts. A boundary that selects a set and names no part acts on all parts
    with a mesh file.
    """
    if spec.on is not None and not spec.parts:
        return [part for part in case.parts if isinstance(part.mesh, MeshFile)]
    return [part for part in case.parts if not spec.parts or part.name in spec.parts]


def near(body: Placed) -> float:
    """Tolerance at the border of a region for the nodes of a body, m; see ``region.slack``."""
    reach = max(abs(x) for corner in body.bounds() for x in corner)
    return slack(body.mesh, body.mesh.element_size, reach)


def _meets(region: Region, body: Placed) -> bool:
    """Whether the bounds of a body overlap the box of a region."""
    margin = near(body)
    return all(
        a <= top + margin and b >= bottom - margin
        for a, b, bottom, top in zip(region.low or (), region.high or (), *body.bounds(), strict=False)
    )


# Faces ----------------------------------------------------------------------------------------------------------------


def _reached(case: Case, spec: Traction | Prescribed) -> list[tuple[str, Placed]] | None:
    """Returns the names and bodies of the parts of a boundary that overlap its box. The result is None if there are
    mesh files, single tets or too many bodies.
    """
    region, found = Region.of(spec), list[tuple[str, Placed]]()
    for part in parts_of(case, spec):
        if isinstance(part.mesh, Measured):
            return None
        body = Placed(part.mesh, part.turn)
        if not region.everything:
            if not _meets(region, body):
                continue
            if isinstance(part.mesh, Loose) or len(found) == _MOST:
                return None
        found.append((part.name, body))
    return found


def _acted_on(case: Case, number: int, spec: Traction) -> Load:
    bodies = _reached(case, spec)
    if bodies is None:
        return Load(number)
    found = [_free_faces(case, name, body, Region.of(spec)) for name, body in bodies]
    area, faces, spread = (sum(column) for column in zip(*found, strict=True)) if found else (0.0, 0.0, 0.0)
    return Load(number, area, round(faces), spread)


def _free_faces(case: Case, name: str, body: Placed, region: Region) -> tuple[float, float, float]:
    """Returns the result of ``_faces`` without the faces of part ``name`` on planes of symmetry: these faces are cuts
    and not surface.
    """
    area, faces, spread = _faces(body, region)
    for _, plane in case.boundaries_of(Symmetry):
        cut = region.on_plane(plane, body.bounds(), near(body)) if not plane.parts or name in plane.parts else None
        if cut is not None:
            less, fewer, more = _faces(body, cut)
            area, faces, spread = max(area - less, 0.0), max(faces - fewer, 0.0), spread + more
    return area, faces, spread


def _faces(body: Placed, region: Region) -> tuple[float, float, float]:
    """Returns the area, m^2, and the number of the surface faces of a body in a region, and the error of the area,
    m^2.
    """
    mesh = body.mesh
    if region.everything:
        return surface(mesh), surface_faces(mesh), _facets(mesh) * surface(mesh)
    exact = block_faces(body, region)
    return (*exact, _FLAT * exact[0]) if exact is not None else _inside(body, region)


def planes_of(body: Placed, region: Region) -> list[int] | None:
    """Returns the numbers of planes of nodes normal to x, y and z that lie in a box, for a block of cubes that is
    neither turned nor slit; None for other bodies and regions.
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
    """Returns the area, m^2, and the number of the surface faces of a block of cubes in a box. The result is None for
    other bodies and regions, and if the box contains no face.
    """
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
    """Returns the area, m^2, and the number of the surface faces that have all corners in a region, from patches as
    large as elements. Also returns the error of the area, m^2, that patches on the border of the region and facets
    cause.
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
    """Whether a patch of a surface has a neighbouring patch that is not completely inside the region."""
    return any(count < 4 for row in corners[max(i - 1, 0) : i + 2] for count in row[max(j - 1, 0) : j + 2])


def _regular(mesh: Generated) -> bool:
    """Whether the mesh has two triangular faces in each patch of its surface."""
    return isinstance(mesh, Box | Plate) and mesh.generator == "structured"


def _facets(mesh: Generated) -> float:
    """Relative uncertainty of the area of a body that is caused by the facets of its mesh."""
    if not isinstance(mesh, Cylinder | Tube | Sphere | Revolved | RingSector):
        return _FLAT
    radius = profile(mesh).widest() if isinstance(mesh, Revolved) else mesh.radius
    radius = mesh.inner_radius or radius if isinstance(mesh, Tube | RingSector) else radius
    return _CURVED + _FACETS * (mesh.element_size / radius) ** 2


def _quad(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """Area of a flat quadrilateral, m^2, from its diagonals."""
    (p, q, r), (s, t, u) = ([y - x for x, y in zip(*pair, strict=True)] for pair in ((a, c), (b, d)))
    return 0.5 * math.hypot(q * u - r * t, r * s - p * u, p * t - q * s)


# Nodes ----------------------------------------------------------------------------------------------------------------


def _held(case: Case, number: int, spec: Prescribed) -> Load:
    bodies = _reached(case, spec)
    if bodies is None:
        return Load(number)
    found = [_nodes(body, Region.of(spec)) for _, body in bodies]
    fewest, nodes = (sum(each[k] for each in found) for k in (0, 1))
    return Load(number, nodes=nodes, fewest=fewest, exact=all(exact for _, _, exact in found))


def _nodes(body: Placed, region: Region) -> tuple[int, int, bool]:
    """Returns the smallest and the largest possible number of nodes of a body in a region, and whether these numbers
    are exact.
    """
    if region.everything:
        every = mesh_size(body.mesh).nodes
        return every, every, _counted(body.mesh)
    count = _grid_nodes(body, region)
    return (count, count, True) if count is not None else (*_between(body, region), False)


def _counted(mesh: Generated) -> bool:
    """Whether the number of nodes of the mesh is known exactly."""
    return mesh.generator == "structured" and not isinstance(mesh, Sphere)


def _grid_nodes(body: Placed, region: Region) -> int | None:
    """Returns the number of nodes of a block of cubes in a box; None for other meshes, and for turned blocks with too
    many nodes.
    """
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
    """Returns the approximate number of nodes of a body in a box, and that in the box widened by half an element on all
    sides.
    """
    return _about(body, region, 0.0), _about(body, region, 0.5 * body.mesh.element_size)


def _about(body: Placed, region: Region, wider: float) -> int:
    """Returns the approximate number of nodes of a body in a box widened by ``wider``, m, on all sides, from the volume
    of the body in this box.
    """
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
