"""Arrows for vectors on the surface of a body. Only a few vectors are drawn: in each cell of a grid over the
picture, the vector that is nearest to the camera.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import vtk
from .camera import Camera
from .shot import Shot

_ACROSS = 22
"""Number of arrows along the longer side of a panel (chosen value)."""
_LONGEST = 1.8
"""Length of the longest arrow, divided by the distance between two arrows (chosen value)."""


def longest(shots: Sequence[Shot]) -> float:
    """Returns the length of the longest vector in all shots."""
    return max(float(np.linalg.norm(vectors, axis=1).max()) for shot in shots for _, vectors in [_all(shot)])


def on(shot: Shot, eye: Camera, aspect: float, most: float) -> Any | None:
    """Returns the arrows of a shot; None if no vector is longer than 2 % of ``most``. The length ``most`` is drawn
    as the longest arrow.
    """
    places, vectors = _all(shot)
    step = 2.0 * eye.half * max(aspect, 1.0) / _ACROSS
    cell = np.floor(np.stack([places @ eye.right, places @ eye.above], axis=1) / step).astype(np.int64)
    order = np.lexsort((-(places @ eye.towards), cell[:, 1], cell[:, 0]))
    first = np.append(True, np.any(np.diff(cell[order], axis=0) != 0, axis=1))
    chosen = order[first]
    chosen = chosen[np.linalg.norm(vectors[chosen], axis=1) > 0.02 * most]
    return vtk.arrows(places[chosen], vectors[chosen], _LONGEST * step / most) if len(chosen) and most > 0.0 else None


def _all(shot: Shot) -> tuple[Any, Any]:
    surfaces = [piece.surface for piece in shot.pieces]
    return (
        np.concatenate([np.asarray(surface.points, float) for surface in surfaces]),
        np.concatenate([np.asarray(surface.point_data["vector"], float) for surface in surfaces]),
    )
