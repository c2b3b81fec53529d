"""Bulk viscosity and its effect on the stable step."""

import numpy as np

from ..elements.limits import LENGTH_FACTOR
from ..elements.scratch import AREAS, CHANGE, LIMIT, MODULUS, SEEN, VOLUME, VOLUME_SEEN
from ..kernels.jit import njit
from ..model.rows import MASS, PRESSURE, VISCOUS, WORK_VISCOUS
from ..model.state import CHUNK

HALF = 0.01
"""Ratio of the velocity difference over a tet to the wave speed. The shock term has half of its full value at this
ratio of velocities. Chosen value, between the ratio of elastic waves in bars (10 m/s over some tets: 5e-4) and that of
weak shocks (300 m/s in copper: 0.03)."""
SQUEEZED = 0.1
"""Compressive volume strain above which the viscosity of a tet with averaged pressure resists the full rate of the tet
itself. Chosen value, by tests of columns of metal loaded at 1.5 and 2 km/s (docs/theory/contact.md, "Plates under 100
GPa"). In metal that flows at 100 m/s the compressive volume strain is about 1e-3."""
_P, _Q, _MASS, _WORK = PRESSURE * CHUNK, VISCOUS * CHUNK, MASS * CHUNK, WORK_VISCOUS * CHUNK


@njit("float64(float64, float64, float64, float64)", cache=True, error_model="numpy")
def resisted(own, mean, kept, squeezed):  # type: ignore[no-untyped-def]
    """Returns the rate of compression, 1/s, that the viscosity of a tet with averaged pressure resists: the sum of the
    ``mean`` rate in its pressure, and a fraction of the difference between its ``own`` rate and the mean rate.

    The difference between the two rates is mostly numerical noise. The fraction increases with the volume that the tet
    has lost to its neighbours (``kept``: ratio of its own volume to the averaged volume), and with the ratio of the
    common compression ``squeezed``, 1 - V_seen / V0, to SQUEEZED. A tet that is smaller than its averaged volume has no
    pressure of its own that stops further compression, so noise would crush such a tet under high pressure.
    """
    mean = max(mean, 0.0)
    share = min(max(1.0 - kept, 0.0) + max(squeezed, 0.0) / SQUEEZED, 1.0)
    return mean + share * max(own - mean, 0.0)


@njit(
    "void(float64[::1], float64[::1], int64, float64, float64, float64, float64, boolean, float64)",
    cache=True,
    error_model="numpy",
)
def bulk_viscosity(w, s, n, linear, shock, quadratic, rate_of_change, breaks, initial):  # type: ignore[no-untyped-def]
    """Computes the bulk viscosity under compression, q = density u ((linear + shock S) c + quadratic u), Pa, with u = l
    |rate|. Also computes the work of q, and the row LIMIT, 1/s.

    Sources: von Neumann and Richtmyer 1950 (quadratic), Landshoff 1955 (linear); S = u / (u + HALF c) distinguishes a
    shock from an elastic wave. ``rate_of_change`` converts CHANGE to a volume flux, 1/s. With G = sqrt(sum |grad N|^2)
    and the tangent Q = (linear + shock S (2 - S)) c + 2 quadratic u, the largest stable step is 1 / (G (G l Q + sqrt((G
    l Q)^2 + c^2))); l = LENGTH_FACTOR / G. The formulas of the step and of l are derived in
    docs/theory/time_integration.md. An inverted tet has no viscosity, and NaN as its limit. A tet at rest or in
    expansion has the limit of a tet at the onset of compression. If the part ``breaks``, a tet in tension has the limit
    of a tet that is compressed at the speed of its release, |p| / (density c). ``initial``: initial density in the
    averaged forms, in which the viscosity resists a mean rate (``resisted``); else 0.
    """
    for i in range(n):
        mass, change = s[_MASS + i], w[CHANGE + i]
        inside_out = w[VOLUME + i] <= 0.0
        volume = 1.0 if inside_out else w[VOLUME + i]
        density = mass / volume
        area = np.sqrt(w[AREAS + i])
        c = np.sqrt(w[MODULUS + i] / density)
        gradient, length = area / volume, LENGTH_FACTOR * volume / area
        rate = -change * rate_of_change / volume
        if initial > 0.0:
            seen = w[VOLUME_SEEN + i]
            rate = resisted(rate, -w[SEEN + i] * rate_of_change, volume / seen, 1.0 - initial * seen / mass)
        rate = 0.0 if inside_out or rate < 0.0 else rate
        u = length * rate
        share = u / (u + HALF * c)
        new = density * u * ((linear + shock * share) * c + quadratic * u)
        if breaks:
            u = max(u, -s[_P + i] / (density * c))
            share = u / (u + HALF * c)
        tangent = LENGTH_FACTOR * ((linear + shock * share * (2.0 - share)) * c + 2.0 * quadratic * u)
        s[_WORK + i] -= 0.5 * (s[_Q + i] + new) * change
        s[_Q + i] = new
        limit = gradient * (tangent + np.sqrt(tangent * tangent + c * c))
        w[LIMIT + i] = np.nan if inside_out else limit
