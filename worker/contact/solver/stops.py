"""Walls and symmetry planes within the sweeps. A node that reaches a plane is stopped at the plane after every sweep.

The boundaries for walls and mirror images act after contact (walls.py, mirrors.py), on each node alone. Without stops,
the sweeps would treat a node between a body and a wall as free, and the wall would then cancel the result of the
sweeps. Therefore each node that would end the step behind a plane gets an impulse that stops the node at the plane, and
a friction impulse along the plane. Later sweeps may reduce the normal impulse, but not below zero; after the last sweep
the impulses of stops are removed, because the boundary applies them and computes their work. Every rank with a copy of
a node computes the same stop.
"""

from typing import NamedTuple

import numpy as np

from conoid.cases.model import schema
from conoid.cases.model.schema import Case

from ...boundaries.walls import ACROSS
from ...kernels.jit import njit, record, types
from ...model.state import Flags, Floats, Indices, Ints, Model
from ...parallel.comm import Comm
from ...scene.conditions import AXES, part_sides
from ...scene.selection import named
from .active import MOBILITY, NODES, V

_NEAR = 0.25
"""Ratio of the distance of a node from a plane to the typical size of a face. Nodes with a larger ratio are ignored.
Chosen value: no step moves a node so far (clock.py). If a step did, the boundary would still stop the node."""


class Stops(NamedTuple):
    """Half spaces that are bounded by fixed plane walls and symmetry planes."""

    points: Floats
    """(k, 3) a point on each plane, m."""
    normals: Floats
    """(k, 3) unit normals, towards the free side."""
    sides: Floats
    """(k, parts) 1 for a part in front of the plane, -1 for a part behind it, 0 for a part that the plane does not
    hold."""
    friction: Floats
    """(k,) Coulomb's coefficient of friction of each plane."""
    mirrors: Flags
    """(k,) True for each plane that is a symmetry plane. Nodes without tets may pass symmetry planes."""

    @classmethod
    def of(cls, case: Case, model: Model, comm: Comm) -> "Stops":
        """Returns the walls and symmetry planes of a case. If a part has nodes on both sides of a plane, there is no
        stop for the part at this plane; only the boundary acts on it. Prescribed motions are not considered, only held
        components. Collective.
        """
        walls, planes = case.boundaries_of(schema.Wall), case.boundaries_of(schema.Symmetry)
        axes = [np.eye(3)[AXES[plane.axis]] for _, plane in planes]
        heights = [plane.at for _, plane in planes]
        walls = [(index, wall) for index, wall in walls if wall.plain]
        points = [wall.point for _, wall in walls] + [at * axis for at, axis in zip(heights, axes, strict=True)]
        normals = np.array([wall.normal for _, wall in walls] + axes, float).reshape(-1, 3)
        held = np.zeros((len(points), len(model.parts)))
        for k, (_, wall) in enumerate(walls):
            held[k] = named(wall, model.parts)
        for k, (_, plane) in enumerate(planes, len(walls)):
            held[k] = part_sides(case, plane, model, comm)
        held[:, case.rigid] = 0.0  # rigid bodies have other stops (rigid/stops.py)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        friction = np.array([*(wall.friction for _, wall in walls), *(0.0 for _ in planes)])
        mirrors = np.arange(len(points)) >= len(walls)
        return cls(np.array(points, float).reshape(-1, 3), normals, held, friction, mirrors)


class Surface(NamedTuple):
    """Columns of the surface nodes that the stops need; see SurfaceNodes."""

    x: Floats
    v: Floats
    mobility: Floats
    part: Indices
    local: Indices


class Braced(NamedTuple):
    """Slots near stops. The table has one row for each pair of a slot and a stop. A task has a range of slots; its rows
    begin at the number of its first slot times the number of stops.
    """

    rows: Indices
    """(rows, 2) slot and stop of each pair."""
    normal: Floats
    """(rows, 3) unit normal of the stop, towards the side of the node; zero in held components."""
    least: Floats
    """(rows,) normal speed with which the node reaches the plane exactly at the end of the step, m/s."""
    push: Floats
    """(rows,) change of the normal speed by the stop so far, m/s."""
    rub: Floats
    """(rows, 3) change of the velocity across the normal by friction at the stop so far, m/s."""
    mu: Floats
    """(rows,) coefficient of friction."""
    many: Ints
    """(tasks,) number of pairs of each task."""

    @classmethod
    def room(cls, n: int, tasks: int) -> "Braced":
        """Allocates arrays for ``n`` rows and ``tasks`` tasks."""
        return cls(
            np.empty((n, 2), np.int32), np.empty((n, 3)), np.empty(n), np.empty(n), np.empty((n, 3)), np.empty(n),
            np.zeros(tasks, np.int64),
        )  # fmt: skip


_F1, _F2, _N1, _N2 = types.float64[::1], types.float64[:, ::1], types.int32[::1], types.int32[:, ::1]
_B1, _F, _I = types.boolean[::1], types.float64, types.int64
STOPS = record(Stops, _F2, _F2, _F2, _F1, _B1)
SURFACE = record(Surface, _F2, _F2, _F2, _N1, _N1)
BRACED = record(Braced, _N2, _F2, _F1, _F1, _F2, _F1, types.int64[::1])


@njit(types.void(BRACED, NODES, STOPS, _N1, SURFACE, _B1, _F, _F, _I, _I, _I), cache=True)
def find(braced, active, stops, places, nodes, loose, size, dt, task, first, stop):  # type: ignore[no-untyped-def]
    """Finds the slots of a ``task``, from ``first`` to ``stop``, that are near a stop in a step of length ``dt``, s.
    ``nodes``: surface nodes; ``loose`` (nodes,): nodes of this rank without tets, which no other rank has; ``size``:
    size of a face, m.
    """
    fixed, begin, x, part, local = active.fixed, first * len(stops.points), nodes.x, nodes.part, nodes.local
    n = begin
    for s in range(first, stop):
        a = places[s]
        for k in range(len(stops.points)):
            side = stops.sides[k, part[a]]
            if side == 0.0 or (stops.mirrors[k] and local[a] >= 0 and loose[local[a]]):
                continue
            gap, along = 0.0, 0.0
            for i in range(3):
                gap += side * stops.normals[k, i] * (x[a, i] - stops.points[k, i])
                if fixed[s, MOBILITY + i] > 0.0:
                    along += stops.normals[k, i] * stops.normals[k, i]
            if gap < _NEAR * size and along > ACROSS:
                for i in range(3):
                    free = fixed[s, MOBILITY + i] > 0.0
                    braced.normal[n, i] = side * stops.normals[k, i] if free else 0.0
                    braced.rub[n, i] = 0.0
                braced.rows[n, 0], braced.rows[n, 1] = s, k
                braced.least[n], braced.push[n], braced.mu[n] = -gap / dt, 0.0, stops.friction[k]
                n += 1
    braced.many[task] = n - begin


@njit(types.void(NODES, BRACED, _I, _I), cache=True)
def stop(active, braced, task, begin):  # type: ignore[no-untyped-def]
    """Stops those nodes of a ``task`` that would end the step behind a plane. Reduces the impulse of nodes that would
    not. The rows of the task begin at ``begin``.

    The formula is push = max(0, push + (least - n.v) / n.n); friction is limited to mu push.
    """
    v, path, slide = active.moving, active.path, np.empty(3)
    for r in range(begin, begin + braced.many[task]):
        s, speed, along = braced.rows[r, 0], 0.0, 0.0
        for i in range(3):
            speed += braced.normal[r, i] * v[s, V + i]
            along += braced.normal[r, i] * braced.normal[r, i]
        push = max(0.0, braced.push[r] + (braced.least[r] - speed) / along)
        change = push - braced.push[r]
        if change != 0.0:
            braced.push[r] = push
            for i in range(3):
                v[s, V + i] += change * braced.normal[r, i]
                path[s] += abs(change * braced.normal[r, i])
        if braced.mu[r] > 0.0 and (push > 0.0 or change != 0.0):
            speed, size = 0.0, 0.0
            for i in range(3):
                speed += braced.normal[r, i] * v[s, V + i]
            for i in range(3):
                held = active.fixed[s, MOBILITY + i] == 0.0
                slide[i] = 0.0 if held else braced.rub[r, i] - v[s, V + i] + speed / along * braced.normal[r, i]
                size += slide[i] * slide[i]
            most = braced.mu[r] * push
            share = most / np.sqrt(size) if size > most * most else 1.0
            for i in range(3):
                change = share * slide[i] - braced.rub[r, i]
                braced.rub[r, i] = share * slide[i]
                v[s, V + i] += change
                path[s] += abs(change)


@njit(types.void(NODES, BRACED, _I, _I), cache=True)
def release(active, braced, task, begin):  # type: ignore[no-untyped-def]
    """Removes the impulses of the stops in a ``task``, whose rows begin at ``begin``."""
    for r in range(begin, begin + braced.many[task]):
        for i in range(3):
            active.moving[braced.rows[r, 0], V + i] -= braced.push[r] * braced.normal[r, i] + braced.rub[r, i]
            braced.rub[r, i] = 0.0
        braced.push[r] = 0.0
