"""Rays normal to an axis, from a point to the nearest material. The rays measure the shape of a hole around the
axis.
"""

import numpy as np

from ..materials.turning import sines_and_cosines
from ..mesh.faces import FACES
from ..model.state import Floats, Tets

RAYS = 360
"""Number of rays. Chosen value: a hole with a hundred tets on its circumference has three or four rays for each tet."""


def directions(axis: int) -> Floats:
    """Return (RAYS, 3) unit vectors normal to an axis. No vector lies in a coordinate plane, because such a plane may
    be a symmetry plane.
    """
    angles: Floats = (np.arange(RAYS, dtype=float) + 0.5) * (2.0 * np.pi / RAYS)
    sines, cosines = sines_and_cosines(angles)
    found = np.zeros((RAYS, 3))
    found[:, (axis + 1) % 3], found[:, (axis + 2) % 3] = cosines, sines
    return found


def reach(x: Floats, tets: Tets, origin: Floats, axis: int) -> Floats:
    """Return (RAYS,) the distance, m, from ``origin`` (3,) to the nearest material along each ray normal to an axis;
    infinite if the ray meets no material.

    A point of a ray is inside of a tet if it is on the inner side of the planes of all faces (algorithm of Cyrus and
    Beck).
    """
    along = x[tets][:, :, axis]
    corners = x[tets[(along.min(axis=1) <= origin[axis]) & (along.max(axis=1) >= origin[axis])]]
    first = corners[:, FACES[:, 0]]
    outward = np.cross(corners[:, FACES[:, 1]] - first, corners[:, FACES[:, 2]] - first)
    r = origin - first
    height = outward[..., 0] * r[..., 0] + outward[..., 1] * r[..., 1] + outward[..., 2] * r[..., 2]
    found = np.full(RAYS, np.inf)
    for k, way in enumerate(directions(axis)):
        slope = outward[..., 0] * way[0] + outward[..., 1] * way[1] + outward[..., 2] * way[2]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -height / slope
        enters = np.where(slope < 0.0, at, np.where((slope == 0.0) & (height > 0.0), np.inf, 0.0)).max(axis=1)
        leaves = np.where(slope > 0.0, at, np.inf).min(axis=1)
        enters = np.maximum(enters, 0.0)
        found[k] = enters[enters < leaves].min(initial=np.inf)
    return found
