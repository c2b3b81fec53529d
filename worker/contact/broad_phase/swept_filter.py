"""Swept filter: removes candidate pairs whose boxes touch but whose primitives stay apart over the horizon.

The box around a face or an edge is much larger than the face or edge. A pair of edges is removed if a single direction
separates the two edges over the whole horizon. For a node and a face, the height over the face and the distances from
its sides are computed at the beginning, middle and end of the horizon; each of these distances is nearly a parabola in
time. Between two successive moments it deviates from a straight line by an eighth of its second difference. The filter
allows twice the deviation from the straight line. A pair is removed only if a single one of the distances excludes
contact over the whole horizon, with the skin and the depth of contacts as margin.
"""

import numpy as np

from ...kernels.jit import njit, types
from ...model.state import Floats, Indices
from ...parallel.arguments import reader
from ...parallel.packing import Packing, offsets
from ...parallel.passes import Pass
from ...parallel.team import TASK, Team
from ..geometry import VECTOR, at, beyond, cross, dot, minus, nearest
from ..narrow_phase.tables import DEEP, DEEP_SELF
from .boxes import LINES, Lines

_V2 = "float64[:, ::1]"
_PAIRS = 1024
"""Number of pairs in a task. Chosen value: a task takes about 50 us, compared with 2 us to start a parallel region."""
_N2 = types.int32[:, ::1]
_KEEP = _N2, types.int64[::1], _N2, types.float64[::1], LINES, types.float64
_read = reader(*_KEEP)


class SweptFilter:
    """Passes of the filter over pairs, run by the threads of a team."""

    def __init__(self, team: Team) -> None:
        self._faces = Pass(team, _keep_faces, *_KEEP, size=_PAIRS)
        self._edges = Pass(team, _keep_edges, *_KEEP, size=_PAIRS)
        self._packing = Packing(team, _PAIRS)

    def faces(self, pairs: Indices, places: Indices, size: Floats, lines: Lines, skin: float) -> Indices:
        """Returns the pairs of a slot and a face that may be in contact. ``pairs`` (p, 2): all pairs; its content is
        overwritten. ``places`` (f, 4): slots of each face; ``size`` (f,): size of each face, m.
        """
        return self._kept(self._faces, pairs, places, size, lines, skin)

    def edges(self, pairs: Indices, places: Indices, deep: Floats, lines: Lines, skin: float) -> Indices:
        """Returns the pairs of edges that may be in contact. ``pairs`` (p, 2): all pairs; its content is overwritten.
        ``places`` (e, 6): slots of each edge; ``deep`` (e,): greatest depth of a contact, m.
        """
        return self._kept(self._edges, pairs, places, deep, lines, skin)

    def _kept(self, sieve: Pass, pairs: Indices, *of: object) -> Indices:
        n = len(pairs)
        begins, counts = np.empty((2, sieve.many(n)), np.int64)
        sieve.run(n, pairs, counts, *of)
        kept = np.empty((int(offsets(begins, counts)), 2), np.int32)
        self._packing.run(n, kept, pairs, begins, counts)
        return kept


@njit("float64(float64, float64, float64)", cache=True)
def _least(f, g, h):  # type: ignore[no-untyped-def]
    """Returns a lower bound over the horizon of a function that has the values f, g and h at the beginning, middle and
    end of the horizon.
    """
    return min(f, g, h) - 0.25 * abs(f - 2.0 * g + h)


@njit(f"{VECTOR}({_V2}, {_V2}, int64, float64)", cache=True)
def _then(x, v, s, t):  # type: ignore[no-untyped-def]
    """Position of slot s at time t."""
    return beyond(at(x, s), t, at(v, s))


@njit(f"Tuple((float64, {VECTOR}))({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR})", cache=True, error_model="numpy")
def _over(s, i, j, k):  # type: ignore[no-untyped-def]
    """Height of the point s above the face i, j, k, m, and its distance outside of each of the three sides, m."""
    e, f, r = minus(j, i), minus(k, i), minus(s, i)
    g, q = minus(f, e), minus(r, e)
    n = cross(e, f)
    length = np.sqrt(dot(n, n))
    one = -dot(cross(n, e), r) / (length * np.sqrt(dot(e, e)))
    two = -dot(cross(f, n), r) / (length * np.sqrt(dot(f, f)))
    three = -dot(cross(n, g), q) / (length * np.sqrt(dot(g, g)))
    return dot(n, r) / length, (one, two, three)


@njit(TASK, cache=True, error_model="numpy")
def _keep_faces(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: moves those of its pairs of a slot and a face that may be in contact to the front of its range."""
    pairs, counts, faces, size, lines, skin = _read(table)
    x, v, part, horizon, n = lines.x, lines.v, lines.part, lines.horizon, first
    half = 0.5 * horizon
    for p in range(first, stop):
        s, face = pairs[p, 0], pairs[p, 1]
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        far = skin + (DEEP_SELF if part[s] == part[i] else DEEP) * size[face]
        h0, o0 = _over(at(x, s), at(x, i), at(x, j), at(x, k))
        apart = False
        if not (abs(h0) <= far and max(o0[0], o0[1], o0[2]) <= far):
            h1, o1 = _over(_then(x, v, s, half), _then(x, v, i, half), _then(x, v, j, half), _then(x, v, k, half))
            h2, o2 = _over(
                _then(x, v, s, horizon), _then(x, v, i, horizon), _then(x, v, j, horizon), _then(x, v, k, horizon)
            )  # fmt: skip
            apart = _least(h0, h1, h2) > far or _least(-h0, -h1, -h2) > far
            for m in range(3):
                apart |= _least(o0[m], o1[m], o2[m]) > far
        if not apart:
            pairs[n, 0], pairs[n, 1] = s, face
            n += 1
    counts[first // _PAIRS] = n - first


@njit(f"boolean({VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, {VECTOR}, float64)", cache=True)
def _beyond(axis, a, b, c, d, far):  # type: ignore[no-untyped-def]
    """Returns True if the segment cd is beyond the segment ab, in the direction of ``axis``, by more than ``far``."""
    one, two = max(dot(axis, a), dot(axis, b)), min(dot(axis, c), dot(axis, d))
    return two - one > far * np.sqrt(dot(axis, axis))


@njit(f"boolean({_V2}, {_V2}, int64, int64, int64, int64, float64, float64, float64)", cache=True)
def _separated(x, v, a, b, c, d, begin, end, far):  # type: ignore[no-untyped-def]
    """Returns True if the segments ab and cd remain further apart than ``far`` from the time ``begin`` to the time
    ``end``. The distance is measured along the direction in which the segments are nearest at the middle of this time.
    On straight lines the distance along a fixed direction is least at the beginning or at the end.
    """
    half = 0.5 * (begin + end)
    axis = nearest(_then(x, v, a, half), _then(x, v, b, half), _then(x, v, c, half), _then(x, v, d, half))
    return _beyond(
        axis, _then(x, v, a, begin), _then(x, v, b, begin), _then(x, v, c, begin), _then(x, v, d, begin), far
    ) and _beyond(axis, _then(x, v, a, end), _then(x, v, b, end), _then(x, v, c, end), _then(x, v, d, end), far)


@njit(TASK, cache=True, error_model="numpy")
def _keep_edges(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: moves those of its pairs of edges that may be in contact to the front of its range."""
    pairs, counts, edges, deep, lines, skin = _read(table)
    x, v, horizon, n = lines.x, lines.v, lines.horizon, first
    half = 0.5 * horizon
    for p in range(first, stop):
        one, two = pairs[p, 0], pairs[p, 1]
        a, b, c, d = edges[one, 0], edges[one, 1], edges[two, 0], edges[two, 1]
        far = skin + min(deep[one], deep[two])
        r = nearest(at(x, a), at(x, b), at(x, c), at(x, d))
        if dot(r, r) <= far * far or not (
            _separated(x, v, a, b, c, d, 0.0, horizon, far)
            or (_separated(x, v, a, b, c, d, 0.0, half, far) and _separated(x, v, a, b, c, d, half, horizon, far))
        ):
            pairs[n, 0], pairs[n, 1] = one, two
            n += 1
    counts[first // _PAIRS] = n - first
