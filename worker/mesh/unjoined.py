"""Search for faces of a part that lie on faces of the same part without common nodes, such as hanging nodes between
elements of two sizes, or coincident nodes that are not merged.
"""

from collections.abc import Iterator

import numpy as np

from .faces import areas, normals
from .model import Floats, Ids, Ints

_NEAR = 1e-6
"""Tolerance of planes and distances, divided by the size of the part: far above rounding errors and below any gap of a
model (chosen value)."""
_MOST = 2_000
"""Largest number of faces of a plane that are compared with all faces of its other side; the chosen value compares
4 million pairs in 0.1 s."""
_PLANES = 100
"""Largest number of planes that are searched (chosen value)."""


def notes(points: Floats, faces: Ints) -> Iterator[str]:
    """Yield a note if outer faces of a part lie on each other. ``points`` (n, 3); ``faces`` (k, 3): the outer faces
    with outward normals. Only flat interfaces are searched.
    """
    area = float(areas(points, faces[_doubled(points, faces)]).sum())
    if area > 0.0:
        yield (
            f"about {0.5e6 * area:.3g} mm^2 of its faces lie on other faces of the part without the same nodes "
            "(hanging or unmerged nodes): the mesh is not joined there"
        )


def _doubled(points: Floats, faces: Ints) -> Ids:
    """Return the faces whose centres lie on a face with the opposite normal, and the faces on which these lie."""
    size = float(np.ptp(points, axis=0).max())
    across = normals(points, faces)
    across /= np.linalg.norm(across, axis=1)[:, None]
    centres = points[faces].mean(axis=1)
    strongest = np.abs(across).argmax(axis=1)
    sign = np.sign(across[np.arange(len(faces)), strongest])
    along = across * sign[:, None]
    planes = np.column_stack([along, ((centres - points[faces[0, 0]]) * along).sum(axis=1) / size])
    _, plane = np.unique(np.floor(planes / (10.0 * _NEAR) + 0.5).astype(np.int64), axis=0, return_inverse=True)
    plane = plane.reshape(-1)
    both = np.intersect1d(plane[sign > 0.0], plane[sign < 0.0])[:_PLANES]
    found = [np.zeros(0, np.int64)]
    for each in both:
        sides = [np.flatnonzero((plane == each) & (sign * s > 0.0)) for s in (1.0, -1.0)]
        for one, other in (sides, sides[::-1]):
            found.append(_on(points, faces, centres[one[:_MOST]], one[:_MOST], other[:_MOST], size * _NEAR))
    return np.unique(np.concatenate(found))


def _on(points: Floats, faces: Ints, centres: Floats, one: Ids, other: Ids, near: float) -> Ids:
    """Return the faces of ``one`` whose centres lie on a face of ``other``, and these faces of ``other``."""
    if not len(one) or not len(other):
        return np.zeros(0, np.int64)
    inside = np.ones((len(one), len(other)), bool)
    corners, up = points[faces[other]], normals(points, faces[other])
    for k in range(3):
        inward = np.cross(up, corners[:, (k + 1) % 3] - corners[:, k])
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        distance = sum(centres[:, None, d] * inward[:, d] for d in range(3)) - (corners[:, k] * inward).sum(axis=1)
        inside &= distance >= -near
    return np.concatenate([one[inside.any(axis=1)], other[inside.any(axis=0)]])
