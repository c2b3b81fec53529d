"""Decimation of the outline: vertices in one cell of a grid are merged (Rossignac and Borrel 1993).

The cells for a fragment are at most half as large as the fragment, so that a small fragment keeps a shape while a large
fragment becomes coarser. Fragments with few triangles are not changed. If there are more fragments than the budget of
triangles allows, the smallest fragments are omitted. All decisions depend on the whole model, not on the number of
ranks.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..model.state import Floats, Ints
from .outline import Outline

_FINENESS = 2.0**0.25
"""Ratio of two successive cell sizes. Chosen value: at most a third of the budget of triangles is unused."""
_LEAST = 8
"""Number of triangles that the budget has at least for each fragment. Chosen value: the number of triangles of two
tets."""
_SIMPLE = 8
"""Largest number of triangles of a fragment that is not decimated. Chosen value."""
_SIZES = 128
"""Number of cell sizes. The cell size decreases from the whole box to 2^-32 of the box."""
Fits = Callable[[Outline], bool]
"""Callback that returns True if an outline is within the budget."""


def to_budget(outline: Outline, mass: Floats, most: int, fits: Fits) -> Outline:
    """Return the finest outline within the budget.

    ``mass`` (fragments,): mass of each fragment. At most ``most`` / 8 fragments are drawn: the heaviest fragments.
    """
    if fits(outline):
        return outline
    outline = outline.chosen(np.flatnonzero(_heaviest(mass, most // _LEAST)[outline.fragment[outline.triangles[:, 0]]]))
    if fits(outline):
        return outline
    extent = _extents(outline, len(mass))
    longest = float(extent.max(initial=0.0))
    level = _level(outline, longest, most)
    coarse = _merged(outline, extent, longest, level)
    step = 1 if fits(coarse) else -1
    while 0 < level < _SIZES:
        level += step
        other = _merged(outline, extent, longest, level)
        if fits(other) != (step > 0):
            return coarse if step > 0 else other
        coarse = other
    return _fewest(coarse, mass, fits)


def _fewest(outline: Outline, mass: Floats, fits: Fits) -> Outline:
    """Return the outline if no cells are coarse enough: the number of fragments is halved until the outline is within
    the budget.
    """
    most = len(np.unique(outline.fragment))
    while most and not fits(outline):
        most //= 2
        kept = _heaviest(mass, most)[outline.fragment[outline.triangles[:, 0]]]
        outline = outline.chosen(np.flatnonzero(kept))
    return outline


def _heaviest(mass: Floats, most: int) -> "np.ndarray":
    """Return (fragments,) True for each of the heaviest fragments. If several fragments have the same mass, the first
    of them are chosen.
    """
    chosen = np.zeros(len(mass), bool)
    chosen[np.argsort(-mass, kind="stable")[:most]] = True
    return chosen


def _extents(outline: Outline, fragments: int) -> Floats:
    """Return (fragments,) the longest side of the bounding box of the vertices of each fragment, m."""
    low, high = np.full((fragments, 3), np.inf), np.full((fragments, 3), -np.inf)
    np.minimum.at(low, outline.fragment, outline.points)
    np.maximum.at(high, outline.fragment, outline.points)
    return np.asarray(np.maximum(high - low, 0.0).max(axis=1, initial=0.0))


def _level(outline: Outline, longest: float, most: int) -> int:
    """Return the level of cell size at which the search starts. At the level where the search starts, the number of
    cell faces is about equal to the number of triangles in the budget.
    """
    a, b, c = (outline.points[outline.triangles[:, k]] for k in range(3))
    area = float(np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum()) / 2.0
    size = max(np.sqrt(2.0 * area / most), 1e-9 * longest) if most else longest
    return int(np.clip(np.log(longest / size) / np.log(_FINENESS), 1, _SIZES - 1)) if longest > 0.0 else 1


def _merged(outline: Outline, extent: Floats, longest: float, level: int) -> Outline:
    """Return the outline with one vertex for each cell, at the mean position of the vertices in the cell; degenerate
    and duplicate triangles are removed.
    """
    size = np.minimum(longest * _FINENESS**-level, 0.5 * extent)
    count = np.bincount(outline.fragment[outline.triangles[:, 0]], minlength=len(extent))
    simple = (count <= _SIMPLE) | (size <= 0.0)
    cell = np.floor(outline.points / np.where(simple, 1.0, size)[outline.fragment][:, None]).astype(np.int64)
    kept = np.flatnonzero(simple[outline.fragment])
    cell[kept] = np.column_stack([kept, np.zeros((len(kept), 2), np.int64)])
    order = np.lexsort((*cell.T, outline.fragment))
    keys = np.column_stack([outline.fragment, cell])[order]
    first = np.ones(len(order), bool)
    first[1:] = (keys[1:] != keys[:-1]).any(axis=1)
    of = np.empty(len(order), np.int64)
    of[order] = np.cumsum(first) - 1
    n = np.bincount(of)
    points = np.column_stack([np.bincount(of, outline.points[:, k]) / n for k in range(3)])
    merged = replace(outline, points=points, fragment=keys[first, 0], triangles=of[outline.triangles])
    return merged.chosen(_distinct(merged.triangles))


def _distinct(triangles: Ints) -> Ints:
    """Return the triangles that have three different vertices, each triangle once."""
    corners = np.sort(triangles, axis=1)
    whole = np.flatnonzero((corners[:, 1:] != corners[:, :-1]).all(axis=1))
    a, b, c = corners[whole].T
    order = np.lexsort((whole, c, b, a))
    rows = corners[whole[order]]
    first = np.ones(len(order), bool)
    first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return np.sort(whole[order[first]])
