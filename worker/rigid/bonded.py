"""Rigid bodies in tied bonds: the points of the bodies to which nodes are tied, and the impulses of the tied rows on
the bodies.

In each sweep of the bonds (bonds/sweeps.py) the impulses on the points of a body, and their moments about the centre of
the body, are summed as integers over the ranks. The sums of the impulses change the motion of the body, and the
velocities of the points are set to this motion. In a step a point moves along the chord of its arc. Therefore a tied
row uses the arm r and the rotation vector w at mid-step: the velocity of the point is V + (w + dt/2 w') x (r + dt/2 w x
r). Here V is the velocity of the centre, and w' = W (l x w) is the rate of change of w in a free rotation with the
angular momentum l and the inverse inertia W.
"""

import numpy as np

from ..kernels.jit import njit, types
from ..model.state import Floats, Indices, Ints
from ..parallel.comm import Comm
from .bodies import Bodies, times
from .points import Points
from .rotation import place, spatial
from .rows import WORDS, add_impulse
from .stops import BodyStops

_F, _F1, _F2 = types.float64, types.float64[::1], types.float64[:, ::1]
_N1, _I2 = types.int32[::1], types.int64[:, ::1]


class BodyBonds:
    """Impulses of tied bonds on the rigid bodies of a case. All ranks have equal values."""

    def __init__(self, bodies: Bodies, stops: BodyStops, start: Floats, rate: Floats, comm: Comm) -> None:
        """``start`` (2, b, 3): velocities and rotation vectors of the bodies before the impulses of the step; ``rate``
        (b, 3): present rotation vectors, which this class updates.
        """
        self._bodies, self._stops, self._start, self._rate, self._comm = bodies, stops, start, rate, comm
        self._total: Ints = np.zeros((bodies.n, WORDS), np.int64)
        """(b, WORDS) sums of the impulses of the bonds on each body in the step, quanta."""
        self._scale, self._half = 1.0, 0.0
        """Number of quanta per N s; and half of the time step, s."""
        self._origins = np.zeros((bodies.n, 3))
        self._inertia, self._ahead = np.empty((bodies.n, 3, 3)), np.zeros((bodies.n, 3))
        """(b, 3, 3) inertia along the axes of space, kg m^2; (b, 3) change of the rotation vector from n to mid-step,
        rad/s."""

    def begin(self) -> None:
        """Starts a step without impulses."""
        self._total[:] = 0

    def take_up(self, points: Points, places: Indices, scale: float) -> None:
        """Registers the ``points`` of the tied rows of this rank, and the ``places`` of the points in the table of
        nodes of the bonds. ``scale``: quanta per N s.
        """
        self._points, self._places, self._scale = points, places, scale
        self._arms = np.zeros((len(points), 3))
        """(k, 3) arms (vectors from the centre of the body to the points) at n, m."""
        self._every = np.arange(len(points), dtype=np.int32)

    def set_out(self, v: Floats, dt: float) -> None:
        """Sets the velocities of the points in the table ``v`` (n, 3), at the start of the sweeps. ``dt``: time step,
        s.
        """
        bodies, spin = self._bodies, self._rate
        place(self._arms, self._every, self._points.body, self._points.arm, bodies.rotation, self._origins)
        self._half = 0.5 * dt
        spatial(self._inertia, bodies.rotation, bodies.inertia)
        momentum = times(self._inertia, spin)
        turning = np.stack(
            [momentum[:, i] * spin[:, j] - momentum[:, j] * spin[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1
        )
        self._ahead = self._half * times(bodies.yielding, turning)
        self._spread(v)

    def give(self, v: Floats, words: Ints, *, walls: bool) -> None:
        """Moves the bodies, and the points in ``v`` (n, 3), after a sweep. ``words`` (n, 3): impulses of the sweep on
        the nodes of the table, quanta; ``walls``: True if walls stop the bodies. Collective.
        """
        bodies, sums = self._bodies, np.zeros((self._bodies.n, WORDS), np.int64)
        gather(sums, words, self._places, self._points.body, self._arms, bodies.reach)
        sums = self._comm.sum(sums) if self._comm.size > 1 else sums
        self._total += sums
        change = self._valued(sums)
        bodies.speed = bodies.speed + bodies.lightness * change[:, :3]
        self._rate += times(bodies.yielding, change[:, 3:])
        if walls:
            self._stops.stop(bodies.speed, self._rate)
        self._spread(v)

    def settle_start(self) -> None:
        """Stores the present motion as the motion from which contact starts; to be called after the warm start."""
        self._start[0], self._start[1] = self._bodies.speed, self._rate

    @property
    def impulse(self) -> Floats:
        """(b, 6) impulse, N s, and moment, N m s, of the bonds in the step."""
        return self._valued(self._total)

    def _valued(self, words: Ints) -> Floats:
        found = words / self._scale
        found[:, 3:] *= self._bodies.reach[:, None]
        return np.asarray(found)

    def _spread(self, v: Floats) -> None:
        rate = self._rate + self._ahead
        spread(v, self._places, self._points.body, self._arms, self._bodies.speed, rate, self._half)


@njit(types.void(_I2, _I2, _N1, _N1, _F2, _F1), cache=True)
def gather(sums, words, places, body, arms, reach):  # type: ignore[no-untyped-def]
    """Adds the impulses ``words`` (n, 3) on the points at ``places`` to ``sums`` (b, WORDS); also adds their moments,
    divided by the reach of the body.
    """
    for k in range(len(places)):
        a, b = places[k], body[k]
        add_impulse(sums, b, words[a, 0], words[a, 1], words[a, 2], arms, k, reach[b])


@njit(types.void(_F2, _N1, _N1, _F2, _F2, _F2, _F), cache=True)
def spread(v, places, body, arms, speed, rate, half):  # type: ignore[no-untyped-def]
    """Sets the velocities ``v`` (n, 3) at ``places`` to those along the chords of the points: speed + w x (arm + half w
    x arm). ``rate``: rotation vectors w (b, 3); ``half``: half of the time step, s.
    """
    for k in range(len(places)):
        a, b = places[k], body[k]
        p, q, r, x, y, z = rate[b, 0], rate[b, 1], rate[b, 2], arms[k, 0], arms[k, 1], arms[k, 2]
        x, y, z = x + half * (q * z - r * y), y + half * (r * x - p * z), z + half * (p * y - q * x)
        v[a, 0] = speed[b, 0] + (q * z - r * y)
        v[a, 1] = speed[b, 1] + (r * x - p * z)
        v[a, 2] = speed[b, 2] + (p * y - q * x)
