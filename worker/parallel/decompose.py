"""Domain decomposition by recursive bisection (Berger and Bokhari 1987). The cuts halve the load of every phase of the
step.

No rank has the points of another rank. Therefore the position of a cut is found digit by digit, from sums of weights
over all ranks.

Ranks wait for each other within a step, after contact and after the elements. Therefore it is not sufficient to halve
the sum of the loads. For example, if one rank has all contact, another rank has all tets, and their sums are equal,
each rank waits for the other. In three dimensions some plane halves any three measures at once (the ham sandwich
theorem). If a point has several weights, one for each phase, planes of many directions are tried. Each tried plane
halves the sum of the weights; the plane that divides the phases most evenly is chosen.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from ..kernels.jit import njit
from ..model.hashing import splitmix64
from ..model.state import Flags, Floats, Indices, Ints
from .comm import Comm

_LEVELS = 2.0**31 - 1.0
"""Number of distinct positions along a normal. Points at equal positions are ordered by their global ids."""
_ID_BITS = 32
"""Number of bits for the id in a sorting key of 63 bits. The 31 higher bits have the position; ids are below 2^32."""
_DIGIT = 8
"""Number of bits of a sorting key that are determined by one sum over the ranks. Chosen value: a sum has 256 counts for
each box, and eight sums are needed for a key."""
_FINEST = 2.0**30
"""Value of the largest weight in quanta; with this value sums of four billion weights are exact."""
_BINS = 128
"""Number of slices along a direction. The weights of the points are summed in the slices when directions are
compared."""
_SHORT = 0.2
"""Smallest ratio of an extent of a box to the longest extent of the box. A box is cut across an extent only if the
ratio of that extent is not smaller (with extents scaled by ``run.cut_scale``)."""
_SURFACE = 0.05
"""Penalty for a cut that goes through twice as much weight as the cut in the direction with the least weight. The
penalty is a fraction of the time of a step."""
_TOGETHER = 8
"""Number of boxes whose slices are summed over the ranks in one call. The number of boxes is fixed, so that the memory
does not increase with the number of ranks."""
_THICK = 2
"""Number of slices on each side of a cut from which the weight at the cut is computed."""
_SAMPLE = 4096
"""Number of sampled points in a box by which directions are compared. Only points that have a weight in the first phase
alone are sampled; all other points are used. Chosen value: with 4,000 points in 128 slices the position of the middle
has an error below a hundredth of the box."""


def _directions() -> Floats:
    """Return (49, 3) unit normals of possible cuts. If two directions are opposite, only one of them is returned.

    The axes come first, then all directions whose components have the ratios 0, 1 and 2.
    """
    found = [v for v in product(range(-2, 3), repeat=3) if v > (0, 0, 0) and np.gcd.reduce(v) == 1]
    found.sort(key=lambda v: (sum(map(abs, v)), [-c for c in v]))
    return np.asarray(np.array(found) / np.linalg.norm(found, axis=1)[:, None])


DIRECTIONS = _directions()
_AXES = 3
"""Number of normals that are the axes x, y and z; the axes are the first normals."""


@dataclass
class Cut:
    """A cut between ranks; it divides the ranks from ``first`` to ``first + parts - 1``. Points whose key along a
    normal is below ``key`` are on the lower side.
    """

    first: int
    parts: int
    direction: int
    """Index of the normal in DIRECTIONS."""
    low: float
    high: float
    key: int

    @property
    def left(self) -> int:
        """Number of ranks on the lower side of the cut."""
        return self.parts // 2

    def keys(self, points: Floats, ids: Ints) -> Ints:
        """Return (n,) sorting keys. A key consists of the position of the point (n, 3) along the normal and of its id
        (n,).
        """
        (x, y, z), extent = DIRECTIONS[self.direction], self.high - self.low
        along = (
            points[:, 0] * x + points[:, 1] * y + points[:, 2] * z
        )  # the result does not depend on the length of the array
        share = (along - self.low) / (extent if extent > 0.0 else 1.0)
        return np.asarray((np.clip(share, 0.0, 1.0) * _LEVELS).astype(np.int64) << _ID_BITS | ids)


def bisect(
    points: Floats, ids: Ints, weights: Floats, parts: int, comm: Comm
) -> tuple[Indices, list[Cut]]:  # fmt: skip
    """Return (n,) the part of each of this rank's points (n, 3), and the cuts. Collective.

    Boxes are cut so that the sums of ``weights``, (n,) or (n, phases), are equal. With one phase a box is cut across
    its longest axis. Points at equal positions are ordered by their ``ids`` (n,), below 2^32, so the parts do not
    depend on the distribution of the points over the ranks. An odd number of parts k is divided into (k - 1) / 2 and (k
    + 1) / 2 parts.
    """
    owner, cuts = np.zeros(len(points), np.int32), []
    phases = weights if weights.ndim == 2 else weights[:, None]
    each = comm.maximum(phases.max(axis=0, initial=0.0))
    largest = float(each.max())
    quanta = np.rint(phases * (_FINEST / largest if largest > 0.0 else 1.0)).astype(np.int64)
    tried = len(DIRECTIONS) if np.count_nonzero(each) > 1 else _AXES
    quanta[:, 0] = np.maximum(quanta[:, 0], 1)
    groups = [(0, parts)]
    while groups := [(first, size) for first, size in groups if size > 1]:
        now = _level(points, ids, quanta, owner, groups, tried, comm)
        cuts += now
        groups = [g for c in now for g in ((c.first, c.left), (c.first + c.left, c.parts - c.left))]
    return owner, cuts


def place(cuts: list[Cut], points: Floats) -> Indices:
    """Return (n,) the part to which each of the points (n, 3) belongs. The points need not be those from which the
    cuts were made.
    """
    owner, none = np.zeros(len(points), np.int32), np.zeros(len(points), np.int64)
    for cut in cuts:
        inside = np.flatnonzero(owner == cut.first)
        owner[inside[cut.keys(points[inside], none[inside]) >= cut.key]] += cut.left
    return owner


def _level(
    points: Floats, ids: Ints, quanta: Ints, owner: Indices, groups: list[tuple[int, int]], tried: int, comm: Comm
) -> list[Cut]:  # fmt: skip
    """Return the cuts of the ``groups`` (first, parts). Each cut is across one of the first ``tried`` directions.

    A point belongs to the group whose ``first`` equals its ``owner``. Points on the upper side of the cut get the first
    rank of the upper side as owner.
    """
    members = [np.flatnonzero(owner == first) for first, _ in groups]
    if tried > _AXES:
        across = _most_even(points, ids, quanta, members, groups, comm)
    else:
        across = np.argmax(_extents(points, members, [DIRECTIONS[:_AXES]] * len(groups), comm).sum(axis=1), axis=1)
    reach = _extents(points, members, [DIRECTIONS[k : k + 1] for k in across], comm)[:, :, 0]
    cuts = [
        Cut(first, parts, int(k), float(-low), float(high), 0)
        for (first, parts), k, (high, low) in zip(groups, across, reach, strict=True)
    ]
    keys = [cut.keys(points[chosen], ids[chosen]) for cut, chosen in zip(cuts, members, strict=True)]
    _search(cuts, keys, [quanta[chosen].sum(axis=1) for chosen in members], comm)
    for cut, chosen, key in zip(cuts, members, keys, strict=True):
        owner[chosen[key >= cut.key]] += cut.left
    return cuts


def _extents(points: Floats, members: list[Ints], directions: list[Floats], comm: Comm) -> Floats:
    """Return (groups, 2, k) extreme positions of the members of each group along each direction: the largest position,
    and the negative of the smallest position. ``directions`` (k, 3). If no rank has members, the values are zeros.

    Collective.
    """
    reach = np.full((len(members), 2, len(directions[0])), -np.inf)
    for own, chosen, normals in zip(reach, members, directions, strict=True):
        _reach(own, points, chosen, normals)
    return np.where(np.isinf(found := comm.maximum(reach)), 0.0, found)


def _most_even(
    points: Floats, ids: Ints, quanta: Ints, members: list[Ints], groups: list[tuple[int, int]], comm: Comm
) -> Ints:  # fmt: skip
    """Return (groups,) the best direction of the cut of each group. The cut halves the sum and divides the phases most
    evenly, judged by a sample of the points. A cut through more weight has a penalty (_SURFACE). Collective.
    """
    luck, many = splitmix64(ids, 0), comm.sum(np.array([len(chosen) for chosen in members], np.int64))
    samples = [_drawn(chosen, luck, quanta, max(int(n) // _SAMPLE, 1)) for chosen, n in zip(members, many, strict=True)]
    reach = _extents(points, [some for some, _ in samples], [DIRECTIONS] * len(groups), comm)
    extent, across = reach.sum(axis=1), np.empty(len(groups), np.int64)
    scale = _BINS / np.where(extent > 0.0, extent, 1.0)
    for g, (_, parts) in enumerate(groups):
        if g % _TOGETHER == 0:
            now = samples[g : g + _TOGETHER]
            sums = np.zeros((len(now), len(DIRECTIONS), _BINS, quanta.shape[1]), np.int64)
            for k, (own, (some, weights)) in enumerate(zip(sums, now, strict=True), g):
                _slice(own, points, weights, some, DIRECTIONS, -reach[k, 1], scale[k])
            sums = comm.sum(sums)
        loss, through = _unevenness(np.asarray(sums[g % _TOGETHER], np.float64), parts)
        long = extent[g] >= _SHORT * extent[g].max()
        through *= scale[g]
        least = through[long].min()
        if least > 0.0:
            loss += _SURFACE * (through / least - 1.0)
        across[g] = np.argmin(np.where(long, loss, np.inf))
    return across


def _unevenness(slices: Floats, parts: int) -> tuple[Floats, Floats]:
    """Return two values for each direction, both (directions,): the loss of a cut that halves the sum of ``slices``
    (directions, bins, phases) for ``parts`` ranks, and the mean weight of the slices near the cut.

    The loss is the waiting time after the phases, divided by the whole time.
    """
    every, bins = np.arange(len(slices)), slices.shape[1]
    left, upto = parts // 2, np.cumsum(slices, axis=1)
    total, both = upto[:, -1], upto.sum(axis=2)
    wanted = both[:, -1] * left / parts
    k = np.minimum((both < wanted[:, None]).sum(axis=1), bins - 1)
    inside = slices[every, k].sum(axis=1)
    beyond = (both[every, k] - wanted) / np.where(inside > 0.0, inside, 1.0)
    below = upto[every, k] - beyond[:, None] * slices[every, k]
    slower = np.maximum(below / left, (total - below) / (parts - left)).sum(axis=1)
    whole = both[:, -1]
    loss = np.where(whole > 0.0, slower * parts / np.where(whole > 0.0, whole, 1.0) - 1.0, 0.0)
    first, last = np.maximum(k - _THICK, 0), np.minimum(k + _THICK, bins - 1)
    through = both[every, last] - both[every, first] + slices[every, first].sum(axis=1)
    return loss, through / (2 * _THICK + 1)


@njit("Tuple((int64[::1], int64[:, ::1]))(int64[::1], uint64[::1], int64[:, ::1], int64)", cache=True)
def _drawn(chosen, luck, quanta, stride):  # type: ignore[no-untyped-def]
    """Return the indices of a sample of the ``chosen`` points, and their ``quanta`` (n, phases).

    The sample has all points with a weight in a later phase. From the other points, one in ``stride`` points is
    selected by the hash ``luck`` (n,). Its weight is multiplied by ``stride``.
    """
    some, weights, n = np.empty(len(chosen), np.int64), np.empty((len(chosen), quanta.shape[1]), np.int64), 0
    for a in chosen:
        alone = True
        for p in range(1, quanta.shape[1]):
            alone &= quanta[a, p] == 0
        if alone and luck[a] % np.uint64(stride) != 0:
            continue
        some[n] = a
        for p in range(quanta.shape[1]):
            weights[n, p] = quanta[a, p] * (stride if alone else 1)
        n += 1
    return some[:n].copy(), weights[:n].copy()


@njit("void(float64[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1])", cache=True)
def _reach(reach, points, chosen, directions):  # type: ignore[no-untyped-def]
    """Raise ``reach`` (2, directions) to the largest position of the ``chosen`` points along each direction, and to the
    negative of the smallest position.
    """
    for a in chosen:
        for k in range(len(directions)):
            along = points[a, 0] * directions[k, 0] + points[a, 1] * directions[k, 1] + points[a, 2] * directions[k, 2]
            reach[0, k], reach[1, k] = max(reach[0, k], along), max(reach[1, k], -along)


@njit(
    "void(int64[:, :, ::1], float64[:, ::1], int64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
)
def _slice(sums, points, quanta, chosen, directions, low, scale):  # type: ignore[no-untyped-def]
    """Add the ``quanta`` (m, phases) of each of the ``chosen`` (m,) points to its slice along each direction."""
    for k in range(len(directions)):
        x, y, z = directions[k, 0] * scale[k], directions[k, 1] * scale[k], directions[k, 2] * scale[k]
        start, slices = low[k] * scale[k], sums[k]
        for m in range(len(chosen)):
            a = chosen[m]
            along = points[a, 0] * x + points[a, 1] * y + points[a, 2] * z - start
            b = min(max(np.int64(along), 0), slices.shape[0] - 1)
            for p in range(quanta.shape[1]):
                slices[b, p] += quanta[m, p]


def _search(cuts: list[Cut], keys: list[Ints], quanta: list[Ints], comm: Comm) -> None:
    """Set the key of every cut to the smallest key at which the weight below the cut exceeds the weight that the lower
    side must have.

    Collective.
    """
    alive: list[Flags] = [np.ones(len(k), bool) for k in keys]
    total = comm.sum(np.array([q.sum() for q in quanta], np.int64))
    wanted = [int(t) * cut.left // cut.parts for t, cut in zip(total, cuts, strict=True)]
    for shift in range(64 - _DIGIT, -1, -_DIGIT):
        sums = np.zeros((len(cuts), 1 << _DIGIT), np.int64)
        digits = [(k >> shift) & ((1 << _DIGIT) - 1) for k in keys]
        for g, own in enumerate(digits):
            np.add.at(sums[g], own[alive[g]], quanta[g][alive[g]])
        every = comm.sum(sums)
        for g, cut in enumerate(cuts):
            upto = np.cumsum(every[g])
            digit = min(int(np.searchsorted(upto, wanted[g], side="right")), (1 << _DIGIT) - 1)
            wanted[g] -= int(upto[digit] - every[g, digit])
            cut.key |= digit << shift
            alive[g] &= digits[g] == digit
    for cut in cuts:
        cut.key = min(cut.key, np.iinfo(np.int64).max)
