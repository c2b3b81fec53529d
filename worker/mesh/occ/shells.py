"""Closed surfaces (shells) of a set of triangles. An outer shell faces outwards; the shell of a cavity faces
inwards.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model import Floats

Triangles = NDArray[np.int64]

_LOOKED_AT = 64
"""Number of facets of a shell whose position relative to other shells is tested. Chosen value."""
_IN = 1e-6
"""Depth, divided by the extent of the surface, at which a tested point lies inside of its own shell."""


@dataclass(frozen=True)
class Surface:
    """Surface that consists of triangles.

    ``points`` (n, 3) in units of the file; ``faces`` (k, 3) nodes of the triangles; ``shell`` (n,) the number of the
    closed surface of each point.
    """

    points: Floats
    faces: Triangles
    shell: Triangles

    def volume(self) -> float:
        """Enclosed volume without cavities, in cubic units of the file."""
        return _volume(self.points[self.faces])

    def corners(self, shell: int) -> Floats:
        """Return (k, 3, 3) the corners of the facets of a closed surface."""
        found: Floats = self.points[self.faces[self.shell[self.faces[:, 0]] == shell]]
        return found

    def volumes(self) -> list[float]:
        """Volume of each closed surface, in cubic units of the file; negative for a cavity."""
        return [_volume(self.corners(shell)) for shell in range(int(self.shell.max()) + 1)]


def shells(n: int, faces: Triangles) -> Triangles:
    """Return (n,) the number of the closed surface of each point, from 0. The closed surfaces are ordered by their
    smallest point.
    """
    least = np.arange(n)
    while True:
        known = least.copy()
        np.minimum.at(least, faces.ravel(), np.repeat(least[faces].min(axis=1), 3))
        least = least[least]
        if np.array_equal(known, least):
            return np.unique(least, return_inverse=True)[1].reshape(-1)


def nested(surface: Surface) -> list[list[int]]:
    """Return the closed surfaces of each body: the outer shell, and the shells of the cavities."""
    volumes = surface.volumes()
    outer = [shell for shell, volume in enumerate(volumes) if volume > 0.0]
    bodies = {shell: [shell] for shell in outer}
    for shell, volume in enumerate(volumes):
        if volume <= 0.0:
            point = surface.corners(shell)[0].mean(axis=0)
            round_it = [each for each in outer if _winds(surface.corners(each), point)]
            bodies[min(round_it, key=lambda each: volumes[each])].append(shell)
    return list(bodies.values())


def astray(surface: Surface) -> Floats | None:
    """Return a point of a shell in a wrong position; None if all positions are right.

    An outer shell is wrong if it is inside of another body. The shell of a cavity is wrong if it is outside of all
    bodies. Only a sample of facets is tested.
    """
    volumes = surface.volumes()
    if len(volumes) == 1:
        return None
    every = [surface.corners(shell) for shell in range(len(volumes))]
    inwards = _IN * float(np.ptp(surface.points, axis=0).max())
    for shell, corners in enumerate(every):
        seen = corners[:: max(1, len(corners) // _LOOKED_AT)]
        normals = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
        lengths = np.sqrt((normals**2).sum(axis=1, keepdims=True))
        points = seen.mean(axis=1) - inwards * normals / np.maximum(lengths, 1e-300)
        for point in points:
            others = (_winding(each, point) for n, each in enumerate(every) if n != shell)
            if sum(map(round, others)) != (0 if volumes[shell] > 0.0 else 1):
                return np.asarray(point)
    return None


def _volume(corners: Floats) -> float:
    a, b, c = corners.transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6.0)


def _winds(corners: Floats, point: Floats) -> bool:
    return round(_winding(corners, point)) != 0


def _winding(corners: Floats, point: Floats) -> float:
    """Return the winding number of a closed surface about a point: the solid angle of the surface (van Oosterom and
    Strackee 1983, IEEE Trans. Biomed. Eng. 30, 125) divided by 4 pi.
    """
    a, b, c = (corners - point).transpose(1, 0, 2)
    p, q, r = (np.sqrt((x * x).sum(axis=1)) for x in (a, b, c))
    over = (a * np.cross(b, c)).sum(axis=1)
    under = p * q * r + (a * b).sum(axis=1) * r + (b * c).sum(axis=1) * p + (c * a).sum(axis=1) * q
    return 2.0 * float(np.arctan2(over, under).sum()) / (4.0 * math.pi)
