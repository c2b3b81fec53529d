"""Search for parts from mesh files whose surfaces coincide with the surface of another part, without a gap."""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from conoid.cases.model.bodies import Loose
from conoid.cases.model.schema import Case
from conoid.cases.model.solids import Measured
from conoid.cases.shapes.placed import Placed
from conoid.cases.warnings.touching import NEAR, Touch, bonded, size

from .faces import normals
from .model import Floats, Ids, Ints

_MOST = 20_000
"""Largest number of faces that are tested against the surface of a generated body. Only faces inside of the bounding
box of the body are tested. Chosen value: the test takes half a second."""

Surface = tuple[Floats, Ints]
"""Surface of a part: its nodes (n, 3), m, and its faces (k, 3) with outward normals."""


def touches(case: Case, surfaces: Mapping[int, Surface]) -> Iterator[Touch]:
    """Yield the pairs of parts that touch without a bond. At least one part of a pair has a mesh from a file.

    ``surfaces``: dictionary from part numbers to surfaces. Two meshes from files touch in faces with equal corners. A
    mesh from a file touches a generated body in faces that lie on the surface of the body.
    """
    for (i, one), (j, other) in combinations(surfaces.items(), 2):
        if not bonded(case, i, j) and (area := _matched(one, other)):
            yield Touch(one=i, other=j, area=area)
    for i, surface in surfaces.items():
        for j, part in enumerate(case.parts):
            if isinstance(part.mesh, Measured | Loose) or bonded(case, i, j):
                continue
            if area := _lying(surface, Placed(part.mesh, part.turn)):
                yield Touch(one=min(i, j), other=max(i, j), area=area)


def _matched(one: Surface, other: Surface) -> float:
    """Return the area, m^2, of the faces that belong to both surfaces."""
    grain = NEAR * max(float(np.ptp(points, axis=0).max()) for points, _ in (one, other))
    keys = [_corners(points, faces, grain) for points, faces in (one, other)]
    unique = [np.unique(key, axis=0, return_index=True) for key in keys]
    both = np.concatenate([unique[0][0], unique[1][0]])
    _, first, times = np.unique(both, axis=0, return_index=True, return_counts=True)
    common = unique[0][1][first[times > 1]]
    return float(0.5 * np.linalg.norm(normals(one[0], one[1][common]), axis=1).sum())


def _corners(points: Floats, faces: Ints, grain: float) -> Ids:
    """Return (k, 9) the corners of faces as integer multiples of the tolerance. The corners of each face are sorted."""
    cells = np.floor(points / grain + 0.5).astype(np.int64)[faces]
    order = np.lexsort((cells[..., 2], cells[..., 1], cells[..., 0]), axis=1)
    return np.take_along_axis(cells, order[..., None], axis=1).reshape(len(faces), 9)


def _lying(surface: Surface, body: Placed) -> float:
    """Return the total area, m^2, of the faces that lie on the surface of a generated body."""
    points, faces = surface
    margin = NEAR * min(size(body), float(np.ptp(points, axis=0).max()))
    centres, across = points[faces].mean(axis=1), normals(points, faces)
    areas = 0.5 * np.linalg.norm(across, axis=1)
    low, high = (np.array(corner) for corner in body.bounds())
    near = np.flatnonzero(((centres >= low - margin) & (centres <= high + margin)).all(axis=1))[:_MOST]
    step = margin * across[near] / (2.0 * areas[near, None])
    area = 0.0
    for face, own, far in zip(near, centres[near] - step, centres[near] + step, strict=True):
        if body.holds(tuple(far.tolist())) and not body.holds(tuple(own.tolist())):
            area += float(areas[face])
    return area
