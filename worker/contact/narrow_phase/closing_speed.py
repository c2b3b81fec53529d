"""Closing speed of active contacts. The closing speed limits the next time step, because no node may pass more than a
fixed fraction of a tet in one step.
"""

import numpy as np

from ...kernels.jit import njit, types
from .tables import CONTACT_ROWS, FACES, PAIRS, STEP, altitude

_F = types.float64


@njit("void(float64[:, ::1], int64, float64[:, ::1], int64, int64)", cache=True)
def bound(box, row, v, first, stop):  # type: ignore[no-untyped-def]
    """Sets the ``row`` of ``box`` to six numbers: the lowest components of the velocities ``v`` (n, 3) from ``first``
    to ``stop``, and minus the highest components.
    """
    for i in range(6):
        box[row, i] = np.inf
    for a in range(first, stop):
        for i in range(3):
            box[row, i], box[row, 3 + i] = min(box[row, i], v[a, i]), min(box[row, 3 + i], -v[a, i])


@njit("float64(float64[:, ::1], int64)", cache=True)
def spread(boxes, many):  # type: ignore[no-untyped-def]
    """Upper bound of the difference of any two velocities, m/s: the diagonal of the box that contains the first
    ``many`` of ``boxes`` (k, 6) (``bound``).
    """
    square = 0.0
    for i in range(3 if many > 0 else 0):
        low, high = np.inf, np.inf
        for k in range(many):
            low, high = min(low, boxes[k, i]), min(high, boxes[k, 3 + i])
        square += (low + high) ** 2
    return np.sqrt(square)


@njit(_F(STEP, types.int32[:, ::1], types.int64, types.int64), cache=True)
def fastest_of(step, corners, s, f):  # type: ignore[no-untyped-def]
    """Square of the largest speed of node s relative to a corner of face f, m^2/s^2."""
    most = 0.0
    for m in range(3):
        speed = 0.0
        for i in range(3):
            speed += (step.v[s, i] - step.v[corners[f, m], i]) ** 2
        most = max(most, speed)
    return most


@njit(_F(STEP, types.int32[:, ::1], types.int64, types.int64, _F), cache=True, error_model="numpy")
def closing_rate(step, corners, s, f, fastest):  # type: ignore[no-untyped-def]
    """Square of a rate, 1/s^2, of node s and face f. The rate is the largest velocity change by contact, divided by the
    smallest altitude of their tets. The result is 0 if the node and the face do not approach each other by more than
    ``step.fast`` in a step. ``fastest``: result of ``fastest_of``.
    """
    if not fastest * step.beyond**2 > step.fast**2:
        return 0.0
    x, a, b, c, d = step.x, corners[f, 0], corners[f, 1], corners[f, 2], corners[f, 3]
    one, two = min(altitude(x, a, b, c, d), altitude(x, b, c, d, a)), altitude(x, c, d, a, b)
    return step.rebound**2 * fastest / min(one, two, altitude(x, d, a, b, c), step.least[s])


@njit(
    types.float64(CONTACT_ROWS, types.int32[::1], PAIRS, FACES, STEP, types.int64, types.int64),
    cache=True,
    error_model="numpy",
)
def approach(out, found, pairs, faces, step, first, stop):  # type: ignore[no-untyped-def]
    """Largest square of a rate, 1/s^2, of the active contacts ``found`` from ``first`` to ``stop``, which are rows of
    ``out``. The rate is the relative speed of a node divided by the altitude of the tet of its face. The value
    ``closing_rate`` is also included in the maximum.
    """
    e, f, r = np.empty(3), np.empty(3), np.empty(3)
    x, most = step.x, 0.0
    for q in range(first, stop):
        row = found[q]
        s, face = pairs.rows[out.pair[row], 0], pairs.rows[out.pair[row], 1]
        corners, fastest = faces.corners[face], fastest_of(step, faces.corners, s, face)
        a, b, c, d = corners[0], corners[1], corners[2], corners[3]
        for i in range(3):
            e[i], f[i], r[i] = x[b, i] - x[a, i], x[c, i] - x[a, i], x[d, i] - x[a, i]
        nx, ny, nz = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
        square = (nx * r[0] + ny * r[1] + nz * r[2]) ** 2 / (nx * nx + ny * ny + nz * nz)
        most = max(most, fastest / square)
        if step.beyond > 0.0:
            most = max(most, closing_rate(step, faces.corners, s, face, fastest))
    return most
