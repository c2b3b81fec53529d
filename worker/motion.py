"""Nodes: forces to velocities, velocities to positions. Increments are added, positions never recomputed."""

from .jit import njit


@njit("void(float64[:, ::1], int64[:, ::1], float64[::1], float64)", cache=True, error_model="numpy")
def kick(v, force, mass, impulse_quantum):  # type: ignore[no-untyped-def]
    """v(n-1/2) to v(n+1/2); ``impulse_quantum`` is the mean step over the force scale, N s."""
    for i in range(len(mass)):
        factor = impulse_quantum / mass[i]
        for k in range(3):
            v[i, k] += force[i, k] * factor


@njit("void(float64[:, ::1], float64[:, ::1], float64)", cache=True)
def move(x, v, dt):  # type: ignore[no-untyped-def]
    """x(n) to x(n+1)."""
    for i in range(len(x)):
        for k in range(3):
            x[i, k] += dt * v[i, k]
