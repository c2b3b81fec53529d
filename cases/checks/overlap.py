"""Overlap of parts, found from their shapes before there are meshes."""

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations, islice, permutations

from ..model.bodies import Cylinder, Loose, RingSector, Sphere, Tube
from ..model.bonds import GAP, TiedBond
from ..model.joined import bodies
from ..model.schema import Case, Contact, Part
from ..model.solids import Measured
from ..reading.problems import Problem, problem
from ..shapes.geometry import Generated, Vector
from ..shapes.placed import Placed, lattice
from ..shapes.profile import Revolved, profile

_POINTS = 12
"""Number of sampling points per direction in the common bounding box of two bodies (chosen value). Overlaps thinner
than a twelfth of this box may be missed; the worker finds them, because it tests the nodes."""
_PAIRS = 32
"""Largest number of pairs of bodies that this module checks; the check then takes a second at most (chosen value). The
worker checks all pairs."""
_TOUCH = 1e-9
"""Largest depth, divided by the size of a body, that counts as touching and not as overlap. The limit is far above
rounding errors and far below any gap of a model (chosen value)."""


def overlaps(
    parts: Iterable[tuple[int, Part]], contact: Contact | None, tied: Mapping[frozenset[str], float]
) -> Iterator[Problem]:
    """Yields a problem for each of the numbered ``parts`` that overlaps an earlier part with which it is in contact.

    ``tied``: allowed overlap of two parts with a tied bond, m, by the names of the parts. Two tied parts may overlap
    because the tied nodes are moved onto the faces of the other part. Each curved body is first reduced by the depth
    that the facets of its mesh can cut off. Single tets and mesh files are not checked.
    """
    if contact is None or contact.overlap != "refuse":
        return
    solid = [
        (i, part, body, body.bounds())
        for i, part in parts
        if not isinstance(part.mesh, Measured | Loose) and (not contact.parts or part.name in contact.parts)
        for body in [Placed(_core(part.mesh), part.turn)]
    ]
    near = ((a, b, box) for a, b in combinations(solid, 2) if (box := _common(a[3], b[3])) is not None)
    for (i, first, one, _), (j, second, other, _), box in islice(near, _PAIRS):
        depth, gap = _depth(one, other, *box), tied.get(frozenset((first.name, second.name)))
        if depth > (gap or 0.0):
            way = "move them apart, or set contact.overlap = 'push'"
            if gap is not None:
                way = f"the gap of their bond, {gap:.2g} m, is less; move them apart, or raise it"
            message = f"{second.name!r} overlaps parts[{i}], {first.name!r}, by about {depth:.2g} m or more; {way}"
            yield problem(("parts", j, "mesh"), ..., message)


def bond_gaps(case: Case) -> dict[frozenset[str], float]:
    """Returns the allowed overlap of each pair of parts with a tied bond, m, by the names of the parts: the ``gap`` of
    the bond.
    """
    sizes = {part.name: getattr(part.mesh, "element_size", math.inf) for part in case.parts}
    found = dict[frozenset[str], float]()
    for bond in case.bond:
        if isinstance(bond, TiedBond):
            least = GAP * min(sizes.get(name, math.inf) for name in bond.parts)
            found[frozenset(bond.parts)] = bond.gap if bond.gap is not None else least
    return found


def grazes(case: Case) -> Iterator[Problem]:
    """Yields a warning for each part whose radius equals that of the hole around it, except for a difference below the
    depth that facets cut off. The meshes of such parts overlap, because their circles become polygons with different
    corners. Two parts of one body give no warning, because they have common facets; two tied parts give none, because
    tied nodes are moved onto the faces.
    """
    contact, body = case.contact, bodies(case)
    if contact is None or contact.overlap != "refuse":
        return
    round_ones = [
        (i, part, part.mesh)
        for i, part in enumerate(case.parts)
        if isinstance(part.mesh, Cylinder | Tube) and (not contact.parts or part.name in contact.parts)
    ]
    tied = {frozenset(bond.parts) for bond in case.bond}
    for (i, outer, tube), (j, inner, rod) in permutations(round_ones, 2):
        if not isinstance(tube, Tube) or tube.axis != rod.axis or outer.turn != inner.turn:
            continue
        if body[i] == body[j] or {outer.name, inner.name} in tied:
            continue
        along = "xyz".index(tube.axis)
        off = math.hypot(*(tube.base[k] - rod.base[k] for k in range(3) if k != along))
        gap = tube.inner_radius - rod.radius - off
        low, high = max(tube.base[along], rod.base[along]), min(m.base[along] + m.length for m in (tube, rod))
        if abs(gap) < _cut_off(tube.inner_radius, tube.element_size) and low < high:
            room = f"leaves {gap:.2g} m in" if gap > 0.0 else "fills"
            message = (
                f"{inner.name!r} {room} the hole of parts[{i}], {outer.name!r}: the facets of the two may overlap; "
                "contact.overlap = 'push' moves them apart"
            )
            yield problem(("parts", j, "mesh"), ..., message)


def _core(mesh: Generated) -> Generated:
    """Returns the body reduced by the depth that facets of its element size can cut off its curved surface."""
    if not isinstance(mesh, Cylinder | Tube | Sphere):
        return mesh
    left = max(0.5 * mesh.radius, mesh.radius - _cut_off(mesh.radius, mesh.element_size))
    return mesh.model_copy(update={"radius": left})


def _rim(mesh: Generated) -> float:
    """Returns the largest depth that facets can cut off a body with a curved surface other than a cylinder or a
    sphere, m."""
    if isinstance(mesh, RingSector):
        return _cut_off(mesh.radius, mesh.element_size)
    return _cut_off(profile(mesh).widest(), mesh.element_size) if isinstance(mesh, Revolved) else 0.0


def _cut_off(radius: float, size: float) -> float:
    """Returns the height of the arc above a chord of length ``size``, m: size^2 / (8 radius)."""
    return size**2 / (8.0 * radius)


def _common(one: tuple[Vector, Vector], other: tuple[Vector, Vector]) -> tuple[Vector, Vector] | None:
    """Returns the box that the bounding boxes of two bodies have in common; None if they do not overlap."""
    (low, high), (low2, high2) = one, other
    (a, b, c), (d, e, f) = map(max, low, low2), map(min, high, high2)
    size = max(y - x for x, y in zip(low + low2, high + high2, strict=True))
    return ((a, b, c), (d, e, f)) if min(d - a, e - b, f - c) > _TOUCH * size else None


def _round(point: Vector, margin: float) -> Iterator[Vector]:
    """Yields six points around ``point``, each at the distance ``margin``, m. Where turned bodies touch, rounding can
    put the point itself inside both bodies; the six points around it are then not all inside.
    """
    x, y, z = point
    for off in (-margin, margin):
        yield from ((x + off, y, z), (x, y + off, z), (x, y, z + off))


def _depth(one: Placed, other: Placed, low: Vector, high: Vector) -> float:
    """Returns the smallest extent, m, of the volume that two bodies have in common inside a box; 0 if there is none."""
    both = [point for point in lattice(low, high, _POINTS) if one.holds(point) and other.holds(point)]
    margin = _TOUCH * max(b - a for body in (one, other) for a, b in zip(*body.bounds(), strict=True))
    margin = max(margin, _rim(one.mesh), _rim(other.mesh))
    both = [point for point in both if all(one.holds(each) and other.holds(each) for each in _round(point, margin))]
    if not both:
        return 0.0
    cells = [(b - a) / _POINTS for a, b in zip(low, high, strict=True)]
    spans = (max(each) - min(each) for each in zip(*both, strict=True))
    return min((span + cell for span, cell in zip(spans, cells, strict=True)), default=0.0)
