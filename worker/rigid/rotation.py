"""Free rotation of rigid bodies, and positions and velocities of their nodes.

Orientations are unit quaternions q with rotations R(q). The state is the angular momentum l along the axes of space.
Without a moment l is constant to the last bit. A step rotates a body by the implicit midpoint rule for Euler's
equations: with p = R^T l in the body and m the mean of p before and after,

    m = p + dt/2 m x (I^-1 m),    q' = q (1, dt/2 I^-1 m) / norm.

The second equation is the Cayley map of dt I^-1 m to a rotation. The rotation by the Cayley map maps p to 2 m - p, so
that l is conserved. The product of the first equation and I^-1 m shows that p . I^-1 p, which is twice the energy, is
also conserved (Hairer, Lubich and Wanner 2006, Geometric Numerical Integration, IV.2: the midpoint rule preserves
quadratic invariants). The error of the phase is of second order in dt.
"""

import numpy as np

from ..kernels.jit import njit

_ENOUGH = 1e-16
"""Relative change of the mean angular momentum. The iteration ends when the change is smaller."""
_MOST = 60
"""Largest number of fixed-point iterations. Each iteration multiplies the error by dt times the rate of precession,
which is below a tenth (stage.py)."""


@njit("void(float64[:, :, ::1], float64[:, ::1])", cache=True)
def turns_of(rotation, q):  # type: ignore[no-untyped-def]
    """Sets ``rotation`` (b, 3, 3) to the rotations of unit quaternions (b, 4), scalar first."""
    for b in range(len(q)):
        w, x, y, z = q[b, 0], q[b, 1], q[b, 2], q[b, 3]
        rotation[b, 0, 0], rotation[b, 1, 1] = w * w + x * x - y * y - z * z, w * w - x * x + y * y - z * z
        rotation[b, 2, 2] = w * w - x * x - y * y + z * z
        rotation[b, 0, 1], rotation[b, 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
        rotation[b, 1, 2], rotation[b, 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
        rotation[b, 2, 0], rotation[b, 0, 2] = 2.0 * (z * x - w * y), 2.0 * (z * x + w * y)


@njit("void(float64[:, :, ::1], float64[:, :, ::1], float64[:, :, ::1])", cache=True)
def spatial(out, rotation, tensor):  # type: ignore[no-untyped-def]
    """Sets ``out`` (b, 3, 3) to R T R^T of the ``tensor`` (b, 3, 3) of each body."""
    half = np.empty((3, 3))
    for b in range(len(out)):
        for i in range(3):
            for j in range(3):
                half[i, j] = (
                    rotation[b, i, 0] * tensor[b, 0, j]
                    + rotation[b, i, 1] * tensor[b, 1, j]
                    + rotation[b, i, 2] * tensor[b, 2, j]
                )
        for i in range(3):
            for j in range(i, 3):
                out[b, i, j] = (
                    half[i, 0] * rotation[b, j, 0] + half[i, 1] * rotation[b, j, 1] + half[i, 2] * rotation[b, j, 2]
                )
                out[b, j, i] = out[b, i, j]


@njit("void(float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, :, ::1], int64[::1], float64)", cache=True)
def turn(q, momentum, rotation, inverse, which, dt):  # type: ignore[no-untyped-def]
    """Rotates bodies that can turn freely by a step ``dt``, s: changes their quaternions ``q`` (b, 4). ``which`` (k,):
    indices of these bodies; ``momentum`` (b, 3): angular momentum, kg m^2/s; ``rotation``: rotation of q; ``inverse``:
    inverse of the inertia along the axes of the body, 1/(kg m^2).
    """
    p, mean, rate = np.empty(3), np.empty(3), np.empty(3)
    for b in which:
        size = 0.0
        for i in range(3):
            p[i] = 0.0
            for j in range(3):
                p[i] += rotation[b, j, i] * momentum[b, j]
            mean[i] = p[i]
            size += abs(p[i])
        for _ in range(_MOST):
            change = 0.0
            _apply(rate, inverse, b, mean)
            x = p[0] + 0.5 * dt * (mean[1] * rate[2] - mean[2] * rate[1])
            y = p[1] + 0.5 * dt * (mean[2] * rate[0] - mean[0] * rate[2])
            z = p[2] + 0.5 * dt * (mean[0] * rate[1] - mean[1] * rate[0])
            change = abs(x - mean[0]) + abs(y - mean[1]) + abs(z - mean[2])
            mean[0], mean[1], mean[2] = x, y, z
            if change <= _ENOUGH * size:
                break
        _apply(rate, inverse, b, mean)
        multiply(q, b, 0.5 * dt * rate[0], 0.5 * dt * rate[1], 0.5 * dt * rate[2], False)


@njit("void(float64[::1], float64[:, :, ::1], int64, float64[::1])", cache=True)
def _apply(out, tensor, b, vector):  # type: ignore[no-untyped-def]
    for i in range(3):
        out[i] = tensor[b, i, 0] * vector[0] + tensor[b, i, 1] * vector[1] + tensor[b, i, 2] * vector[2]


@njit("void(float64[:, ::1], int64, float64, float64, float64, boolean)", cache=True)
def multiply(q, b, x, y, z, in_space):  # type: ignore[no-untyped-def]
    """Multiplies the quaternion ``q[b]`` by (1, x, y, z) and normalises it; this is a rotation about the axis (x, y, z)
    by twice the arc tangent of its length. The components of the axis are given along the axes of the body, or along
    the axes of space if ``in_space`` is True.
    """
    a, c, d, e = q[b, 0], q[b, 1], q[b, 2], q[b, 3]
    sign = -1.0 if in_space else 1.0
    q[b, 0] = a - c * x - d * y - e * z
    q[b, 1] = c + a * x + sign * (d * z - e * y)
    q[b, 2] = d + a * y + sign * (e * x - c * z)
    q[b, 3] = e + a * z + sign * (c * y - d * x)
    size = np.sqrt(q[b, 0] * q[b, 0] + q[b, 1] * q[b, 1] + q[b, 2] * q[b, 2] + q[b, 3] * q[b, 3])
    for i in range(4):
        q[b, i] /= size


@njit("void(float64[:, ::1], int32[::1], int32[::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1])", cache=True)
def place(x, nodes, body, arms, rotation, centre):  # type: ignore[no-untyped-def]
    """Sets the positions ``x`` of the ``nodes`` (k,) of bodies. The position of a node is the centre of its body plus
    the rotated initial arm, ``arms`` (k, 3).
    """
    for k in range(len(nodes)):
        a, b = nodes[k], body[k]
        for i in range(3):
            x[a, i] = centre[b, i] + (
                rotation[b, i, 0] * arms[k, 0] + rotation[b, i, 1] * arms[k, 1] + rotation[b, i, 2] * arms[k, 2]
            )


@njit(
    "void(float64[:, ::1], float64[:, ::1], int32[::1], int32[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1])",
    cache=True,
)
def carry(v, x, nodes, body, centre, speed, rate):  # type: ignore[no-untyped-def]
    """Sets the velocities of the ``nodes`` of bodies: ``speed`` (b, 3), the velocity of the centre, plus ``rate`` (b,
    3) x arm.
    """
    for k in range(len(nodes)):
        a, b = nodes[k], body[k]
        rx, ry, rz = x[a, 0] - centre[b, 0], x[a, 1] - centre[b, 1], x[a, 2] - centre[b, 2]
        v[a, 0] = speed[b, 0] + (rate[b, 1] * rz - rate[b, 2] * ry)
        v[a, 1] = speed[b, 1] + (rate[b, 2] * rx - rate[b, 0] * rz)
        v[a, 2] = speed[b, 2] + (rate[b, 0] * ry - rate[b, 1] * rx)
