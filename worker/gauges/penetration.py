"""Depth of the hole that a part has made in the other parts, measured on straight lines parallel to the axis.

A line is cut into spans inside of tets and voids between the tets. Voids of neighbouring lines are joined if they
overlap. The hole consists of the void in front of the bodies and all voids joined to this void. A cavity that opens
ahead of the hole is not joined to the hole, and a flake in the hole does not end the hole. The free space beyond the
bodies is not a void.
"""

from itertools import pairwise

import numpy as np

from ..model.state import Floats, Ints, Model, Tets
from ..parallel.comm import Comm

LINES = np.arange(1, 11) / 10.0
"""Distances of the measuring lines from the axis, divided by the radius of the part. Voids of neighbouring lines are
joined."""
MEASURED = (0, 2, 4)
"""Indices in ``LINES`` of the lines whose depths are averaged; these are the lines at 0.1, 0.3 and 0.5 of the
radius."""
_TOUCHING = 1e-6
"""Largest gap between two tets that counts as closed, divided by the radius of the part. The function ``spans`` moves
lines to the side by the largest closed gap."""


def spans(x: Floats, tets: Tets, axis: int, at: tuple[float, float]) -> tuple[Ints, Floats]:
    """Return the tets (k,) through which a line along ``axis`` passes, and (k, 2) the interval of the line inside of
    each tet, m.

    ``at``: position of the line in the two directions normal to ``axis``. The line is moved aside by about 1e-6 of its
    distance from the axis, because a line that lies in a face would be in two tets.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    aside = 1e-6 * max(map(abs, at))
    at = (at[0] + aside, at[1] + 0.618 * aside)
    low, high = (f(f(x[tets[:, 0]], x[tets[:, 1]]), f(x[tets[:, 2]], x[tets[:, 3]])) for f in (np.minimum, np.maximum))
    met = np.flatnonzero(
        (low[:, i] <= at[0]) & (high[:, i] >= at[0]) & (low[:, j] <= at[1]) & (high[:, j] >= at[1])
    )  # fmt: skip
    corners = x[tets[met]]
    point = np.zeros(3)
    point[i], point[j] = at
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    start = np.einsum("pi,pij->pj", point - corners[:, 0], inverse)
    start = np.column_stack([1.0 - start.sum(axis=1), start])
    slope = np.column_stack([-inverse[:, axis].sum(axis=1), inverse[:, axis]])
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -start / slope
    enters = np.where(slope > 0.0, crossing, np.where((slope == 0.0) & (start < 0.0), np.inf, -np.inf)).max(axis=1)
    leaves = np.where(slope < 0.0, crossing, np.inf).min(axis=1)
    inside = leaves > enters
    return met[inside], np.column_stack([enters, leaves])[inside]


def passed(x: Floats, tets: Tets, part: Ints, axis: int, radius: float) -> Floats:
    """Return (k, 4) line, part and interval, m, for every tet on a line; ``part`` (n,): part of each tet. The lines are
    placed between the two directions normal to the axis, because every sector of a body has tets there.
    """
    rows = [np.zeros((0, 4))]
    for line, share in enumerate(LINES):
        at = float(share * radius / np.sqrt(2.0))
        which, span = spans(x, tets, axis, (at, at))
        rows.append(np.column_stack([np.full(len(which), float(line)), part[which], span]))
    return np.concatenate(rows)


def passed_by(model: Model, name: str, along: str, comm: Comm) -> tuple[Floats, float]:
    """Return the intervals of the lines in the parts other than ``name`` (see ``passed``), and the radius of ``name``,
    m.

    Collective. If the part lies above the other parts on the axis, the axis is reversed, so that the part always starts
    below the other parts.
    """
    nodes, axis = model.nodes, "xyz".index(along)
    mine = nodes.in_part(model.parts.index(name))
    radius = _maximum(comm, np.hypot(*np.delete(nodes.x0[mine], axis, axis=1).T))
    others = [block for block in model.blocks if model.parts[block.part] != name]
    rows = [passed(nodes.x, b.tets, np.full(b.n, b.part), axis, radius) for b in others]
    gathered = comm.gather(np.concatenate([np.zeros((0, 4)), *rows]))
    found: Floats = comm.broadcast(np.concatenate(gathered) if gathered is not None else None)
    found = found[np.lexsort(found.T[::-1])]
    if _middle(comm, nodes.x0[mine, axis]) > _middle(comm, nodes.x0[~mine, axis]):
        found = np.column_stack([found[:, :2], -found[:, 3], -found[:, 2]])
    return found, radius


def _middle(comm: Comm, x: Floats) -> float:
    return _maximum(comm, x) - _maximum(comm, -x)


def _maximum(comm: Comm, values: Floats) -> float:
    return float(comm.maximum(np.array([np.max(values, initial=-np.inf)]))[0])


def thickness(rows: Floats, parts: int) -> Floats:
    """Return (measured lines, parts) the length of each line inside of each part, m. ``rows``: result of ``passed``."""
    total = np.zeros((len(LINES), parts))
    np.add.at(total, (rows[:, 0].astype(int), rows[:, 1].astype(int)), rows[:, 3] - rows[:, 2])
    return total[list(MEASURED)]


def depth(rows: Floats, thick: Floats, radius: float) -> float:
    """Return (measured lines, parts) a part of the thickness ``thick``, m: the part that lies in front of the end of
    the hole.

    The hole starts at the low end of the axis. The remaining thickness of each part is the distance from the end of the
    hole to the rear of the part; it includes cavities. The rear is the furthest point of the part on any line, because
    a cavity may have opened the rear on some lines.
    """
    rears = np.full(thick.shape[1], -np.inf)
    np.maximum.at(rears, rows[:, 1].astype(int), rows[:, 3])
    left = rears - bottoms(rows, _TOUCHING * radius)[list(MEASURED), None]
    return float(np.clip(thick - left, 0.0, thick).sum(axis=1).mean())


def bottoms(rows: Floats, tolerance: float) -> Floats:
    """Return (lines,) the position of the end of the hole on each line, m; infinite if the line is open to the rear."""
    voids = [_voids(rows[rows[:, 0] == line, 2:], tolerance) for line in range(len(LINES))]
    reached = [np.arange(len(some)) == 0 for some in voids]
    while True:
        before = sum(int(some.sum()) for some in reached)
        for one, two in pairwise(range(len(LINES))):
            joined = _overlap(voids[one], voids[two], tolerance)
            reached[two] |= joined[reached[one]].any(axis=0)
            reached[one] |= joined[:, reached[two]].any(axis=1)
        if sum(int(some.sum()) for some in reached) == before:
            return np.array([some[flags, 1].max() for some, flags in zip(voids, reached, strict=True)])


def _voids(spans: Floats, tolerance: float) -> Floats:
    """Return (v, 2) the intervals of a line that are outside of all bodies. The interval beyond the last body is
    omitted.
    """
    spans = spans[np.argsort(spans[:, 0])]
    reach = np.concatenate([[-np.inf], np.maximum.accumulate(spans[:, 1])])
    starts = np.append(spans[:, 0], np.inf)
    open_ = starts > reach + tolerance
    open_[1:] &= np.isfinite(starts[1:])
    return np.column_stack([reach, starts])[open_]


def _overlap(one: Floats, two: Floats, tolerance: float) -> "np.ndarray":
    """Return (v, w) flags: True if a void of one line (v voids) overlaps a void of another line (w voids)."""
    low, high = np.maximum(one[:, None, 0], two[:, 0]), np.minimum(one[:, None, 1], two[:, 1])
    return np.asarray(high > low + tolerance)
