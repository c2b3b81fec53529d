"""Candidates that cannot meet yet are left alone, until what they have moved could have brought them together.

A list of candidates serves many steps, and in most of them most of its pairs are far apart. When a pair is looked at
and is ``slack`` further apart than it could meet at, it rests for as long as

    slack > U t + P_1 + P_2 + the rest of this step,

U the relative speed with which the two flew at the search, t the time since, and P how far each has strayed from that
flight: the lengths of all deviations, step by step. Both sides of that are sums that only grow, so a pair keeps one
number. It is exact: a pair that rests would not have met. No bit of the answer depends on it, and ranks need not agree.

A node that does not look at a face rests until the face may have turned to it. The normal of a face of sides e, f and
area A changes by less than D (|e| + |f| + D) / A while no two of its corners have moved by D against each other.
"""

from dataclasses import dataclass

import numpy as np

from ..jit import njit
from ..state import Flags, Floats, Indices, extended
from .meetings import DEEP, DEEP_SELF, FACING, NEAR, facing, foot, height, off

_V1, _V2, _N1, _N2 = "float64[::1]", "float64[:, ::1]", "int32[::1]", "int32[:, ::1]"
_ROUND = 0.01
"""Of the size of a face and of the length of an edge: added to the distance at which a pair may meet."""
_BEND = 0.1
"""Largest D, of the two sides of a face."""


@dataclass
class Trail:
    """How far things have strayed: nodes, or faces and edges by the node of theirs that has most."""

    path: Floats
    """(n,) length of all deviations so far, m."""
    step: Floats
    """(n,) the last of them, m."""
    reach: Floats
    """(n,) what this step may add, m."""

    @classmethod
    def of(cls, n: int) -> "Trail":
        """At the start."""
        return cls(np.zeros(n), np.zeros(n), np.zeros(n))

    def grow(self, n: int) -> None:
        """Takes up more things."""
        for name in ("path", "step", "reach"):
            setattr(self, name, extended(getattr(self, name), np.zeros(n)))


@dataclass
class Waiting:
    """The pairs of one kind."""

    until: Floats
    """(p,) m; minus infinity when it is not known, NaN for a pair that is too close to rest until the next search."""
    speed: Floats
    """(p,) U, m/s; NaN when it is not known."""
    turned: Flags
    """(p,) whether a pair rests because its node does not face the face, by the mean normals of the node."""
    some: Indices
    """(p,) room for those that are awake."""

    @classmethod
    def of(cls, n: int) -> "Waiting":
        """All awake."""
        return cls(np.full(n, -np.inf), np.full(n, np.nan), np.zeros(n, bool), np.empty(n, np.int32))

    def grow(self, n: int) -> None:
        """Takes up more pairs, awake."""
        self.until = extended(self.until, np.full(n, -np.inf))
        self.speed, self.turned = extended(self.speed, np.full(n, np.nan)), extended(self.turned, np.zeros(n, bool))
        self.some = np.empty(len(self.until), np.int32)


class Rest:
    """The rest of the candidates of one scene."""

    def __init__(self, x: Floats, v: Floats, faces: int, edges: int, node_face: int, edge_edge: int) -> None:
        """``x``, ``v`` (crowd, 3) at the search; how many faces, edges and candidates there are."""
        self._x, self._v = x.copy(), v.copy()
        self._nodes, self._faces, self._edges = Trail.of(len(x)), Trail.of(faces), Trail.of(edges)
        self._node_face, self._edge_edge = Waiting.of(node_face), Waiting.of(edge_edge)
        self.faces: Flags = np.zeros(faces, bool)
        """(f,) which have new corners."""
        self.edges: Flags = np.zeros(edges, bool)
        """(e,) the same."""
        self.nodes: Flags = np.zeros(len(x), bool)
        """(crowd,) whose mean normals have changed."""
        self._dt, self._t = 0.0, 0.0
        self.fresh = True
        """Whether no step has been made since the search."""
        self.looked: tuple[Indices, Indices] = (np.zeros(0, np.int32), np.zeros(0, np.int32))
        """Which candidates were awake in the last step."""

    def add(self, x: Floats, v: Floats) -> None:
        """Takes up more nodes, as they are, (n, 3) each."""
        self._x, self._v = extended(self._x, x), extended(self._v, v)
        self._nodes.grow(len(x))
        self.nodes = extended(self.nodes, np.zeros(len(x), bool))

    def add_candidates(self, n: int) -> None:
        """Takes up more candidates of nodes and faces."""
        self._node_face.grow(n)

    def add_edges(self, n: int) -> None:
        """Takes up more candidates of edges and edges."""
        self._edge_edge.grow(n)

    def turn(self) -> None:
        """All mean normals have changed."""
        self._node_face.until[self._node_face.turned] = -np.inf

    def move(self, x: Floats, v: Floats, faces: Indices, edges: Indices, dt: float) -> None:
        """A step ``dt`` from the positions ``x`` on, with velocities ``v`` before contact."""
        self._t, self.fresh = self._t + self._dt, False
        _stray(*_of(self._nodes), self._x, self._v, x, v, self._dt, dt)
        _follow(*_of(self._faces), faces, 3, self._nodes.step, self._nodes.reach)
        _follow(*_of(self._edges), edges, 2, self._nodes.step, self._nodes.reach)
        self._dt = dt

    def awake(self, node_face: Indices, edge_edge: Indices) -> tuple[Indices, Indices]:
        """Which candidates have to be looked at."""
        end = self._t + self._dt
        nodes, faces, edges = self._nodes, self._faces, self._edges
        first = _awake(
            self._node_face.some, node_face, self._node_face.until, self._node_face.speed, nodes.path, nodes.reach,
            faces.path, faces.reach, self.nodes, self.faces, end,
        )  # fmt: skip
        second = _awake(
            self._edge_edge.some, edge_edge, self._edge_edge.until, self._edge_edge.speed, edges.path, edges.reach,
            edges.path, edges.reach, self.edges, self.edges, end,
        )  # fmt: skip
        self.nodes[:], self.faces[:], self.edges[:] = False, False, False
        self.looked = self._node_face.some[:first], self._edge_edge.some[:second]
        return self.looked

    def settle(
        self, pairs: Indices, edges: Indices, node_face: Indices, edge_edge: Indices, faces: Indices, size: Floats,
        sides: Indices, length: Floats, normals: Floats, planes: Floats, known: Flags, x: Floats, part: Indices,
    ) -> None:  # fmt: skip
        """Lets candidates, ``pairs`` and ``edges``, rest; ``x`` (crowd, 3) at the end of the step.

        ``size`` of the ``faces``, ``length`` of the edges ``sides``, ``normals`` of the nodes, ``planes`` and
        ``known``: meetings.py.
        """
        end, wait, trail, nodes = self._t + self._dt, self._node_face, self._faces, self._nodes
        _settle_nodes(
            wait.until, wait.speed, wait.turned, pairs, node_face, faces, size, normals, planes, known, x, self._v,
            part, nodes.path, nodes.reach, trail.path, trail.reach, end,
        )  # fmt: skip
        wait, trail = self._edge_edge, self._edges
        _settle_edges(
            wait.until, wait.speed, edges, edge_edge, sides, length, x, self._v, trail.path, trail.reach, end
        )  # fmt: skip


def _of(trail: Trail) -> tuple[Floats, Floats, Floats]:
    return trail.path, trail.step, trail.reach


@njit(f"void({_V1}, {_V1}, {_V1}, {_V2}, {_V2}, {_V2}, {_V2}, float64, float64)", cache=True)
def _stray(path, step, reach, x_then, v_then, x, v, passed, dt):  # type: ignore[no-untyped-def]
    for a in range(len(path)):
        off, change = 0.0, 0.0
        for i in range(3):
            off += (x[a, i] - x_then[a, i] - passed * v_then[a, i]) ** 2
            change += (v[a, i] - v_then[a, i]) ** 2
            x_then[a, i] = x[a, i]
        step[a] = np.sqrt(off)
        path[a] += step[a]
        reach[a] = dt * np.sqrt(change)


@njit(f"void({_V1}, {_V1}, {_V1}, {_N2}, int64, {_V1}, {_V1})", cache=True)
def _follow(path, step, reach, corners, many, node_step, node_reach):  # type: ignore[no-untyped-def]
    for f in range(len(path)):
        step[f], reach[f] = 0.0, 0.0
        for k in range(many):
            step[f] = max(step[f], node_step[corners[f, k]])
            reach[f] = max(reach[f], node_reach[corners[f, k]])
        path[f] += step[f]


@njit(f"int64({_N1}, {_N2}, {_V1}, {_V1}, {_V1}, {_V1}, {_V1}, {_V1}, boolean[::1], boolean[::1], float64)", cache=True)
def _awake(some, pairs, until, speed, path1, reach1, path2, reach2, fresh1, fresh2, end):  # type: ignore[no-untyped-def]
    n = 0
    for p in range(len(pairs)):
        one, two = pairs[p, 0], pairs[p, 1]
        if fresh1[one] or fresh2[two]:
            until[p], speed[p] = -np.inf, np.nan
        if not until[p] > path1[one] + reach1[one] + path2[two] + reach2[two] + speed[p] * end:
            some[n] = p
            n += 1
    return n


@njit(f"float64({_V2}, int64, int64)", cache=True)
def _between(v, a, b):  # type: ignore[no-untyped-def]
    """|v_a - v_b|."""
    square = 0.0
    for i in range(3):
        square += (v[a, i] - v[b, i]) ** 2
    return np.sqrt(square)


@njit(f"float64({_V2}, {_V2}, int64, int64, int64, int64, {_V1})", cache=True, error_model="numpy")
def _bent(out, x, s, i, j, k, m):  # type: ignore[no-untyped-def]
    """Half of the D, m, that a face of normal m has to spare before node s looks at it; none, or less, when it does."""
    mean, least = facing(out, s, m)
    turn = max(mean - FACING, 0.5 * (least + FACING))
    ee, ff, ef = 0.0, 0.0, 0.0
    for a in range(3):
        e, f = x[j, a] - x[i, a], x[k, a] - x[i, a]
        ee, ff, ef = ee + e * e, ff + f * f, ef + e * f
    sides = np.sqrt(ee) + np.sqrt(ff)
    return 0.5 * min(0.5 * turn * np.sqrt(ee * ff - ef * ef) / ((1.0 + _BEND) * sides), _BEND * sides)


@njit(
    f"void({_V1}, {_V1}, boolean[::1], {_N1}, {_N2}, {_N2}, {_V1}, {_V2}, {_V2}, boolean[::1], {_V2}, {_V2}, {_N1}, "
    f"{_V1}, {_V1}, {_V1}, {_V1}, float64)",
    cache=True,
    error_model="numpy",
)
def _settle_nodes(  # type: ignore[no-untyped-def]
    until, speed, turned, some, pairs, faces, size, out, planes, known, x, v_then, part, path1, reach1, path2,
    reach2, end,
):  # fmt: skip
    b, m = np.empty(3), np.empty(3)
    for p in some:
        if np.isnan(until[p]):
            continue
        s, f = pairs[p, 0], pairs[p, 1]
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if not known[f]:
            height(planes[f], x, s, i, j, k)
            known[f] = True
        apart = 0.0
        for a in range(3):
            m[a] = planes[f, a]
            apart += m[a] * (x[s, a] - x[i, a])
        apart = abs(apart)
        if not foot(b, x, x, s, i, j, k, 0.0):
            apart = min(off(x, s, i, j), off(x, s, j, k), off(x, s, k, i))
        if np.isnan(speed[p]) or turned[p]:
            speed[p] = max(_between(v_then, s, i), _between(v_then, s, j), _between(v_then, s, k))
        deep = _ROUND + max(DEEP_SELF if part[s] == part[i] else DEEP, NEAR)
        slack = apart - deep * size[f]
        turned[p] = not slack > 0.0
        if turned[p]:
            slack = _bent(out, x, s, i, j, k, m)
            speed[p] = max(_between(v_then, i, j), _between(v_then, i, k))
        until[p] = slack + path1[s] - reach1[s] + path2[f] - reach2[f] + speed[p] * end if slack > 0.0 else np.nan


@njit(f"float64({_V2}, int64, int64, int64, int64)", cache=True, error_model="numpy")
def _segments(x, a, b, c, d):  # type: ignore[no-untyped-def]
    """Distance of the segments ab and cd, m: where their lines are nearest, or from an end."""
    uu, uw, ww, ur, wr, rr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, w, r = x[b, i] - x[a, i], x[d, i] - x[c, i], x[c, i] - x[a, i]
        uu, uw, ww, ur, wr, rr = uu + u * u, uw + u * w, ww + w * w, ur + u * r, wr + w * r, rr + r * r
    area = uu * ww - uw * uw
    s, t = (ww * ur - uw * wr) / area, (uw * ur - uu * wr) / area
    if min(s, t) >= 0.0 and max(s, t) <= 1.0:
        square = rr + s * s * uu + t * t * ww - 2.0 * (s * ur - t * wr + s * t * uw)
        return np.sqrt(max(square, 0.0))
    return min(min(off(x, a, c, d), off(x, b, c, d)), min(off(x, c, a, b), off(x, d, a, b)))


@njit(
    f"void({_V1}, {_V1}, {_N1}, {_N2}, {_N2}, {_V1}, {_V2}, {_V2}, {_V1}, {_V1}, float64)",
    cache=True,
    error_model="numpy",
)
def _settle_edges(until, speed, some, pairs, edges, length, x, v_then, path, reach, end):  # type: ignore[no-untyped-def]
    for p in some:
        if np.isnan(until[p]):
            continue
        one, two = pairs[p, 0], pairs[p, 1]
        a, b, c, d = edges[one, 0], edges[one, 1], edges[two, 0], edges[two, 1]
        if a == b or c == d:  # an edge that has gone
            until[p] = np.inf
            continue
        if np.isnan(speed[p]):
            speed[p] = max(
                max(_between(v_then, a, c), _between(v_then, a, d)), max(_between(v_then, b, c), _between(v_then, b, d))
            )
        slack = _segments(x, a, b, c, d) - (_ROUND + DEEP_SELF) * max(length[one], length[two])
        until[p] = slack + path[one] - reach[one] + path[two] - reach[two] + speed[p] * end if slack > 0.0 else np.nan
