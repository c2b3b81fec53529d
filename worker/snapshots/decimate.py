"""Fewer triangles for the same bodies: vertices of a cell of a grid become one (Rossignac and Borrel 1993).

Each fragment has cells of its own size, half its extent at most, so that a small one keeps a shape while a large one
becomes coarser; those with few triangles stay as they are. When there are more fragments than triangles for them, the
smallest are left out. All that is decided follows from the whole model, so it does not know how many ranks there are.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..model.state import Floats, Ints
from .outline import Outline

_FINENESS = 2.0**0.25
"""Between the cell sizes that are tried. Chosen: the budget is used up to a third at most."""
_LEAST = 8
"""Triangles that the budget has for each fragment that is drawn, at least: two tets'. Chosen."""
_SIMPLE = 8
"""Triangles up to which a fragment stays as it is. Chosen."""
_SIZES = 128
"""Cell sizes that there are, from the whole box down: the last is 2^-32 of it."""
Fits = Callable[[Outline], bool]
"""Whether an outline keeps to the budget."""


def to_budget(outline: Outline, mass: Floats, most: int, fits: Fits) -> Outline:
    """The finest outline that fits. ``mass`` (fragments,): the heaviest are drawn, ``most`` / 8 of them at most."""
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
    """Where no cells are coarse enough: half the fragments, until they fit."""
    most = len(np.unique(outline.fragment))
    while most and not fits(outline):
        most //= 2
        kept = _heaviest(mass, most)[outline.fragment[outline.triangles[:, 0]]]
        outline = outline.chosen(np.flatnonzero(kept))
    return outline


def _heaviest(mass: Floats, most: int) -> "np.ndarray":
    """(fragments,) which belong to the heaviest; of equal ones the first do."""
    chosen = np.zeros(len(mass), bool)
    chosen[np.argsort(-mass, kind="stable")[:most]] = True
    return chosen


def _extents(outline: Outline, fragments: int) -> Floats:
    """(fragments,) the longest side of the box round the vertices of each, m."""
    low, high = np.full((fragments, 3), np.inf), np.full((fragments, 3), -np.inf)
    np.minimum.at(low, outline.fragment, outline.points)
    np.maximum.at(high, outline.fragment, outline.points)
    return np.asarray(np.maximum(high - low, 0.0).max(axis=1, initial=0.0))


def _level(outline: Outline, longest: float, most: int) -> int:
    """The level of cells whose faces are about as many as the budget has: where the search begins."""
    a, b, c = (outline.points[outline.triangles[:, k]] for k in range(3))
    area = float(np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)).sum()) / 2.0
    size = max(np.sqrt(2.0 * area / most), 1e-9 * longest) if most else longest
    return int(np.clip(np.log(longest / size) / np.log(_FINENESS), 1, _SIZES - 1)) if longest > 0.0 else 1


def _merged(outline: Outline, extent: Floats, longest: float, level: int) -> Outline:
    """With one vertex a cell, at the mean place of those that were there; triangles that have become lines, or double,
    go.
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
    """The rows with three vertices that no row before them has."""
    corners = np.sort(triangles, axis=1)
    whole = np.flatnonzero((corners[:, 1:] != corners[:, :-1]).all(axis=1))
    a, b, c = corners[whole].T
    order = np.lexsort((whole, c, b, a))
    rows = corners[whole[order]]
    first = np.ones(len(order), bool)
    first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return np.sort(whole[order[first]])
