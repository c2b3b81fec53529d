"""Nodes and faces that the regions of a case select. Their numbers are compared with the numbers that ``conoid
validate`` predicts.
"""

import logging
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from conoid.cases.checks.on import bits
from conoid.cases.model import schema
from conoid.cases.model.bodies import MeshFile
from conoid.cases.shapes import loaded, region
from conoid.cases.shapes.region import Region

from ..mesh.faces import normals
from ..model.state import Flags, Floats, Indices, Ints
from .marks import Marks

log = logging.getLogger("conoid.worker")

_CLOSE = 0.5
"""Distance outside of a region, divided by the shortest edge. Nodes nearer to the region are counted to detect a layer
of nodes. Chosen value: half of the distance of the next layer of a regular mesh."""
_LAYER, _FEWEST = 0.5, 4
"""Smallest fraction of the counted nodes within region.MOST, and smallest number of these nodes, at which the nodes
count as a layer. Chosen values: of randomly placed nodes a fifth is within that distance."""
Members = tuple[Ints, Indices]
"""Two arrays (m,): nodes, and the parts of the nodes. A node of several parts has one entry for each of its parts
(state.Nodes.of_parts)."""
_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""Pairs of corners of a tet that form its edges."""


@dataclass(frozen=True)
class Nearness:
    """Distances, m, within which nodes count as lying on the border of a region (``cases/shapes/region.py``). Each part
    has its own distances from the border.
    """

    edge: Floats
    """(parts,) shortest edge of each part, m."""
    slack: Floats
    """(parts,) distance that is used for regions, m."""
    rounding: Floats
    """(parts,) distance that is used for symmetry planes, m."""


def nearness(case: schema.Case, x: Floats, members: Members, tets: Indices, tet_part: Indices) -> Nearness:
    """Return the distances within which nodes count as lying on a border, for all parts. Arguments: positions of the
    nodes (n, 3), m; tets (m, 4); part of each node; and part of each tet."""
    nodes, part = members
    n = len(case.parts)
    squared, reach = np.full(n, np.inf), np.zeros(n)
    for i, j in _EDGES:
        along = x[tets[:, i]] - x[tets[:, j]]
        np.minimum.at(squared, tet_part, (along * along).sum(axis=1))
    np.maximum.at(reach, part, np.abs(x).max(axis=1)[nodes])
    edge = np.sqrt(squared)
    found = [(each.mesh, float(a), float(b)) for each, a, b in zip(case.parts, edge, reach, strict=True)]
    return Nearness(
        edge, np.array([region.slack(*each) for each in found]), np.array([region.rounding(*each) for each in found])
    )


def named(spec: schema.Boundary, parts: Sequence[str]) -> Flags:
    """Return (parts,) True for each part that a boundary names. If a boundary names no part, the value is True for all
    parts.
    """
    return np.array([not spec.parts or name in spec.parts for name in parts])


def settled(case: schema.Case, there: Container[int]) -> list[bool]:
    """Return for each boundary True if all its parts are in ``there``, a collection of part numbers."""
    return [all(index in there for index in np.flatnonzero(meant(case, spec)).tolist()) for spec in case.boundaries]


def meant(case: schema.Case, spec: schema.Boundary) -> Flags:
    """Return (parts,) True for each part of a boundary. If the boundary is on a set and names no part, it has all parts
    with a mesh from a file.
    """
    found = named(spec, [part.name for part in case.parts])
    if getattr(spec, "on", None) is not None and not spec.parts:
        found &= np.array([isinstance(part.mesh, MeshFile) for part in case.parts])
    return found


def inside(spec: schema.Prescribed | schema.Traction, x: Floats, part: Indices, near: Floats) -> Flags:
    """Return (n,) True for each point (n, 3) in the region of a boundary; ``near``: (parts,) tolerance, m. The parts of
    the boundary are ignored.
    """
    return np.asarray(np.full(len(x), True) & Region.of(spec).holds(x.T, near[part]))


def held(
    spec: schema.Prescribed | schema.Traction, names: Sequence[str], x: Floats, members: Members, near: Floats
) -> Flags:  # fmt: skip
    """Return (n,) True for each node (n, 3) that is in the region of a boundary and belongs to one of its parts.
    ``names``: names of the parts; ``near``: (parts,) tolerance, m.
    """
    nodes, part = members
    some = named(spec, names)[part] & inside(spec, x[nodes], part, near)
    found = np.zeros(len(x), bool)
    found[nodes[some]] = True
    return found


@dataclass(frozen=True)
class Selected:
    """Nodes or faces that a boundary selects: faces of a traction and their area, m^2, or nodes of a velocity."""

    boundary: int
    nodes: int
    faces: int = 0
    area: float = 0.0


def compared(case: schema.Case, found: Sequence[Selected]) -> Iterator[str]:
    """Log the selected numbers and the numbers that ``conoid validate`` predicts. Yield a warning for each
    difference.
    """
    expected = {load.boundary: load for load in loaded.loads(case)}
    for each in found:
        load = expected[each.boundary]
        took, meant = _words(each), load.words()
        log.info("boundaries[%d] %s; expected: %s", each.boundary, took, meant)
        if not load.agrees(each.nodes, each.faces, each.area):
            yield (
                f"boundaries[{each.boundary}]: {took}, but `conoid validate` predicts {meant}; check its box, its "
                "cylinder and its parts against the mesh"
            )


def _words(found: Selected) -> str:
    if found.faces:
        return f"acts on {found.faces} faces, {1e6 * found.area:.6g} mm^2"
    return f"drives {found.nodes} nodes"


def missed(
    case: schema.Case, number: int, x: Floats, members: Members, near: Nearness, took: Flags
) -> Iterator[str]:  # fmt: skip
    """Yield warnings about a boundary. ``took`` (parts,): parts of which its region selects nodes or faces.

    One warning is given if the boundary names a part of which it selects no node. Another warning is given if a layer
    of nodes is so close to the region that the user may have meant it.
    """
    spec = case.boundaries[number]
    assert isinstance(spec, schema.Prescribed | schema.Traction)
    for name, some in zip([each.name for each in case.parts], took, strict=True):
        if name in spec.parts and not some:
            yield f"boundaries[{number}]: selects no node or face of part {name!r}, although it names this part"
    if spec.on is not None:
        return
    nodes, part = members
    chosen = np.flatnonzero(named(spec, [each.name for each in case.parts])[part])
    at, of = x[nodes[chosen]], part[chosen]
    took_up, close, wide = (
        inside(spec, at, of, within) for within in (near.slack, region.MOST * near.edge, _CLOSE * near.edge)
    )
    fringe, around = int((close & ~took_up).sum()), int((wide & ~took_up).sum())
    if fringe >= _FEWEST and fringe > _LAYER * around:
        yield (
            f"boundaries[{number}]: {fringe} nodes lie outside of its region by less than a tenth of an edge and are "
            "not in it; move its border away from them"
        )


def counted(
    case: schema.Case,
    number: int,
    x: Floats,
    members: Members,
    faces: tuple[Indices, Indices],
    near: Nearness,
    marked: Marks,
) -> tuple[Selected, Flags]:
    """Return the numbers that boundary ``number`` selects. Also return flags: (n,) True for each selected node of a
    velocity, or (m,) True for each selected face of a traction.

    ``faces``: exposed faces (m, 3) and their parts (m,); ``marked``: sets of the nodes.
    """
    spec, names = case.boundaries[number], [each.name for each in case.parts]
    assert isinstance(spec, schema.Prescribed | schema.Traction)
    found = held(spec, names, x, members, near.slack)
    bit = None if spec.on is None else bits(case)[spec.on]
    if bit is not None and isinstance(spec, schema.Prescribed):
        found &= marked.holds(bit)
    nodes, (corners, of) = int(found.sum()), faces
    if isinstance(spec, schema.Prescribed):
        return Selected(number, nodes), found
    chosen: Flags = np.asarray(found[corners].all(axis=1) & meant(case, spec)[of] & ~_cut(case, x, faces, near, marked))
    if bit is not None:
        chosen &= marked.chosen(bit, corners, of)
    area = float(0.5 * np.linalg.norm(normals(x, corners[chosen]), axis=1).sum())
    return Selected(number, nodes, int(chosen.sum()), area), chosen


def _cut(
    case: schema.Case, x: Floats, faces: tuple[Indices, Indices], near: Nearness, marked: Marks
) -> Flags:  # fmt: skip
    """Return (m,) True for each of the exposed faces (m, 3), with their parts (m,), that lies on a symmetry plane. A
    face on a symmetry plane is a cut through the whole body, and no traction loads it.
    """
    (corners, of), names = faces, [each.name for each in case.parts]
    found = np.zeros(len(corners), bool)
    for _, plane in case.boundaries_of(schema.Symmetry):
        away = np.abs(x[corners, "xyz".index(plane.axis)] - plane.at).max(axis=1)
        there = away <= near.rounding[of]
        if plane.on is not None:
            there = marked.holds(bits(case)[plane.on])[corners].all(axis=1)
        found |= named(plane, names)[of] & there
    return found


NO_FACES = np.zeros((0, 3), np.int32), np.zeros(0, np.int32)
"""Value of the argument ``faces`` of ``counted`` for velocities, which have no faces."""


def off_planes(
    case: schema.Case, x: Floats, members: Members, near: Nearness, known: Sequence[bool]
) -> Iterator[str]:  # fmt: skip
    """Yield a warning for each ``known`` symmetry plane with nodes close to it. The nodes are not on the plane, but the
    user may have meant them to be on it.
    """
    names, (nodes, part) = [each.name for each in case.parts], members
    for number, plane in case.boundaries_of(schema.Symmetry):
        if not known[number] or plane.on is not None:
            continue
        away = np.abs(x[nodes, "xyz".index(plane.axis)] - plane.at)
        off = named(plane, names)[part] & (away > near.rounding[part]) & (away <= near.slack[part])
        if off.sum() >= _FEWEST:
            yield (
                f"boundaries[{number}]: {int(off.sum())} nodes start up to {away[off].max():.2g} m off this plane of "
                "symmetry, less than a hundredth of an edge, and are not on it: they are free until they reach it"
            )
