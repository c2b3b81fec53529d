"""Recursive coordinate bisection: which rank computes which tet. Berger and Bokhari 1987.

No rank sees the points of another: a cut is found digit by digit from sums of weights over all ranks.
"""

from dataclasses import dataclass

import numpy as np

from ..state import Flags, Floats, Indices, Ints
from .comm import Comm

_LEVELS = 2.0**31 - 1.0
"""Places along an axis that are told apart; points in one place are told apart by their ids."""
_ID_BITS = 32
_DIGIT = 8
_FINEST = 2.0**30
"""Quanta of the largest weight: sums of four billion of them are exact."""


@dataclass
class Cut:
    """The ranks ``first`` .. ``first + parts - 1`` in two: what lies below ``key`` along an axis, and the rest."""

    first: int
    parts: int
    axis: int
    low: float
    high: float
    key: int

    @property
    def left(self) -> int:
        """Ranks on the lower side."""
        return self.parts // 2

    def keys(self, points: Floats, ids: Ints) -> Ints:
        """(n,) places of points (n, 3) along the axis, then their ``ids`` (n,)."""
        extent = self.high - self.low
        share = (points[:, self.axis] - self.low) / (extent if extent > 0.0 else 1.0)
        return np.asarray((np.clip(share, 0.0, 1.0) * _LEVELS).astype(np.int64) << _ID_BITS | ids)


def bisect(
    points: Floats, ids: Ints, weights: Floats, parts: int, comm: Comm
) -> tuple[Indices, list[Cut]]:  # fmt: skip
    """(n,) part of each of this rank's points (n, 3), and the cuts: boxes cut across their longest axis so that the
    ``weights`` (n,) are equal; all ranks take part.

    Points in one place are told apart by their ``ids`` (n,), below 2^32, so the parts do not depend on how the points
    are spread over the ranks. A number of parts that is no power of two is split as floor : ceiling.
    """
    owner, cuts = np.zeros(len(points), np.int32), []
    largest = float(comm.maximum(np.array([weights.max(initial=0.0)]))[0])
    quanta = np.maximum(np.rint(weights * (_FINEST / largest if largest > 0.0 else 1.0)), 1.0).astype(np.int64)
    groups = [(0, parts)]
    while groups := [(first, size) for first, size in groups if size > 1]:
        now = _level(points, ids, quanta, owner, groups, comm)
        for cut in now:
            inside = np.flatnonzero(owner == cut.first)
            owner[inside[cut.keys(points[inside], ids[inside]) >= cut.key]] += cut.left
        cuts += now
        groups = [g for c in now for g in ((c.first, c.left), (c.first + c.left, c.parts - c.left))]
    return owner, cuts


def place(cuts: list[Cut], points: Floats) -> Indices:
    """(n,) the parts in which other points (n, 3) lie."""
    owner, none = np.zeros(len(points), np.int32), np.zeros(len(points), np.int64)
    for cut in cuts:
        inside = np.flatnonzero(owner == cut.first)
        owner[inside[cut.keys(points[inside], none[inside]) >= cut.key]] += cut.left
    return owner


def _level(
    points: Floats, ids: Ints, quanta: Ints, owner: Indices, groups: list[tuple[int, int]], comm: Comm
) -> list[Cut]:  # fmt: skip
    """A cut for each of the ``groups`` (first, parts), of the points that belong to ``first`` so far."""
    members = [np.flatnonzero(owner == first) for first, _ in groups]
    reach = np.full((len(groups), 6), -np.inf)
    for g, chosen in enumerate(members):
        if len(chosen):
            reach[g] = np.concatenate([points[chosen].max(axis=0), -points[chosen].min(axis=0)])
    reach = np.where(np.isinf(found := comm.maximum(reach)), 0.0, found)
    axes = np.argmax(reach[:, :3] + reach[:, 3:], axis=1)
    cuts = [
        Cut(first, parts, int(axis), float(-r[3 + axis]), float(r[axis]), 0)
        for (first, parts), axis, r in zip(groups, axes, reach, strict=True)
    ]
    keys = [cut.keys(points[chosen], ids[chosen]) for cut, chosen in zip(cuts, members, strict=True)]
    _search(cuts, keys, [quanta[chosen] for chosen in members], comm)
    return cuts


def _search(cuts: list[Cut], keys: list[Ints], quanta: list[Ints], comm: Comm) -> None:
    """Sets the key of every cut: the smallest up to which there is more than the left side's share."""
    alive: list[Flags] = [np.ones(len(k), bool) for k in keys]
    total = comm.sum(np.array([q.sum() for q in quanta], np.int64))
    wanted = [int(t) * cut.left // cut.parts for t, cut in zip(total, cuts, strict=True)]
    for shift in range(64 - _DIGIT, -1, -_DIGIT):
        sums = np.zeros((len(cuts), 1 << _DIGIT))
        digits = [(k >> shift) & ((1 << _DIGIT) - 1) for k in keys]
        for g, own in enumerate(digits):
            sums[g] = np.bincount(own[alive[g]], quanta[g][alive[g]], 1 << _DIGIT)
        every = comm.sum(sums.astype(np.int64))
        for g, cut in enumerate(cuts):
            upto = np.cumsum(every[g])
            digit = min(int(np.searchsorted(upto, wanted[g], side="right")), (1 << _DIGIT) - 1)
            wanted[g] -= int(upto[digit] - every[g, digit])
            cut.key |= digit << shift
            alive[g] &= digits[g] == digit
    for cut in cuts:
        cut.key = min(cut.key, np.iinfo(np.int64).max)
