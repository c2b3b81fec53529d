"""Initial positions and velocities of the nodes of a part."""

import numpy as np

from conoid.cases.model.schema import Part, Turn

from ..materials.turning import sine_and_cosine
from ..mesh.model import Floats


def turned(points: Floats, turn: Turn | None) -> Floats:
    """Return the points (n, 3) after the rotation of their part."""
    if turn is None:
        return points
    i, j = ((1, 2), (2, 0), (0, 1))["xyz".index(turn.axis)]
    sine, cosine = sine_and_cosine(turn.angle)
    arms, moved = points - np.array(turn.centre), points.copy()
    moved[:, i] = turn.centre[i] + cosine * arms[:, i] - sine * arms[:, j]
    moved[:, j] = turn.centre[j] + sine * arms[:, i] + cosine * arms[:, j]
    return moved


def velocities(part: Part, points: Floats) -> Floats:
    """Return (n, 3) the velocities, m/s, of nodes of ``part`` at ``points``, (n, 3), m. The random part of the velocity
    is not included.
    """
    found = np.empty_like(points)
    found[:] = part.velocity
    if part.spin is not None:
        found += np.cross(np.array(part.spin.rate), points - np.array(part.spin.centre))
    if part.stretch is not None:
        found += np.array(part.stretch.rate) * (points - np.array(part.stretch.centre))
    return found
