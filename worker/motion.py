"""Nodes: forces to velocities, velocities to positions. Increments are added, positions never recomputed."""

from .jit import njit


@njit(
    "void(float64[:, ::1], int64[:, ::1], float64[::1], float64[::1], float64, float64)",
    cache=True,
    error_model="numpy",
)
def kick(v, force, mass, stepping, impulse_quantum, shorter):  # type: ignore[no-untyped-def]
    """v(n-1/2) to v*(n+1/2); ``impulse_quantum`` is the mean step over the force scale, N s; ``shorter``: a quarter of
    what the step ahead is shorter than the one behind, over the force scale, for the account ``stepping`` (n,), J.
    """
    for i in range(len(mass)):
        factor, power = impulse_quantum / mass[i], 0.0
        for k in range(3):
            power += v[i, k] * force[i, k]
            v[i, k] += force[i, k] * factor
        stepping[i] += shorter * power


@njit("void(float64[:, ::1], float64[:, ::1], int64[:, ::1], float64[::1], float64, float64)", cache=True)
def move(x, v, force, stepping, dt, shorter):  # type: ignore[no-untyped-def]
    """x(n) to x(n+1); ends the account that ``kick`` has begun, with the same f(n)."""
    for i in range(len(x)):
        power = 0.0
        for k in range(3):
            x[i, k] += dt * v[i, k]
            power += v[i, k] * force[i, k]
        stepping[i] -= shorter * power
