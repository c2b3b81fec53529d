"""Sums that do not depend on their order: integers in units of a power of two.

The scale of the nodal forces follows the largest contribution of the step before; when a step outgrows it, the sum is
repeated in a coarser quantum. A contribution has 51 bits; node 0 of a tet may get three of them, so a node could have
680 tets before its sum wraps: twenty times what a mesh has.
"""

import math
from typing import Protocol

import numpy as np

from ..jit import njit
from ..state import Floats, Indices, Ints
from .comm import Comm

CONTRIBUTION_BITS = 51
"""A contribution stays below 2^51 quanta, where a float64 beside 1.5 times 2^52 counts integers one by one
(elements/tet4.py)."""
HEADROOM_BITS = 5
"""The next step may grow 32-fold before its sum has to be repeated."""
_LIMB_BITS = 30
_LIMB = 2.0**_LIMB_BITS
"""Quanta of the low limb in one of the high: 60 bits in two limbs, each of which sums 2^32 values in an int64."""


def float_of(bits: int) -> float:
    """The float64 with these bits."""
    return float(np.int64(bits).view(np.float64))


def bits_of(value: float) -> int:
    """The bits of a float64."""
    return int(np.float64(value).view(np.int64))


def scale_for(largest: float) -> float:
    """Quanta per newton for contributions up to ``largest``, N, with room to grow."""
    return math.ldexp(1.0, CONTRIBUTION_BITS - HEADROOM_BITS - math.frexp(largest)[1])


def outgrown(largest: float, scale: float) -> bool:
    """Whether a contribution of ``largest``, N, does not fit the scale."""
    return not largest * scale < 2.0**CONTRIBUTION_BITS


@njit("float64(float64, float64)", cache=True)
def larger(largest, value):  # type: ignore[no-untyped-def]
    """The greater magnitude; infinite for what is not a number, which no maximum over ranks may drop."""
    return max(largest, abs(value)) if math.isfinite(value) else math.inf


@njit("float64[::1](float64[:, ::1])", cache=True)
def _largest(columns):  # type: ignore[no-untyped-def]
    """(k,) largest magnitude of each column, by ``larger``."""
    largest = np.zeros(columns.shape[1])
    for i in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            largest[j] = larger(largest[j], columns[i, j])
    return largest


@njit("void(int64[::1], int64, float64, float64)", cache=True)
def add_limbs(words, j, value, scale):  # type: ignore[no-untyped-def]
    """Adds a ``value`` of column ``j`` to the sums of the high and of the low limbs, ``words`` (2k,)."""
    scaled = value * scale
    high = np.rint(scaled)
    words[j] += np.int64(high)
    words[len(words) // 2 + j] += np.int64(np.rint((scaled - high) * _LIMB))


@njit("int64[::1](float64[:, ::1], float64[::1])", cache=True)
def _limbs(columns, scale):  # type: ignore[no-untyped-def]
    """(2k,) sums of the high and of the low limbs of each column."""
    words = np.zeros(2 * columns.shape[1], np.int64)
    for i in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            add_limbs(words, j, columns[i, j], scale[j])
    return words


@njit("int64[:, ::1](float64[:, ::1], int32[::1], int64, float64[::1])", cache=True)
def _limbs_by_group(columns, group, groups, scale):  # type: ignore[no-untyped-def]
    """(groups, 2k) what ``_limbs`` gives, of the rows of each ``group`` (n,)."""
    words = np.zeros((groups, 2 * columns.shape[1]), np.int64)
    for i in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            add_limbs(words[group[i]], j, columns[i, j], scale[j])
    return words


class Tally:
    """Sums that grow through a whole run: integers in two limbs, so that neither order nor ranks matter."""

    def __init__(self, largest: Floats) -> None:
        """``largest`` (k,): the order of magnitude of what is added to each sum; 2^-60 of it is the quantum."""
        self.scale = np.ldexp(1.0, 30 - np.frexp(largest)[1])
        """(k,) quanta of the high limb per unit."""
        self.words = np.zeros((2, len(largest)), np.int64)
        """(2, k) high and low limbs."""

    def quanta(self, values: Floats) -> Ints:
        """(2, k) what every row of ``values`` (n, k) would add to the words."""
        scaled = values * self.scale
        high = np.rint(scaled)
        low = np.rint((scaled - high) * _LIMB)
        return np.array([high.astype(np.int64).sum(axis=0), low.astype(np.int64).sum(axis=0)])

    def add(self, values: Floats) -> None:
        """Adds every row of ``values`` (n, k)."""
        self.words += self.quanta(values)
        self.carry()

    def carry(self) -> None:
        """Carries what the low limbs have over into the high ones, which leaves the sums as they are, to the bit.

        A low limb has 2^29 quanta for each value at most, and values far below a quantum of the high limb are in the
        low one alone: without this it would wrap after 2^34 of them, as contact may add in a long run.
        """
        high, low = self.words
        over = (low + (1 << (_LIMB_BITS - 1))) >> _LIMB_BITS
        high += over
        low -= over << _LIMB_BITS

    def total(self, comm: Comm) -> Floats:
        """(k,) sums over all ranks; all ranks take part."""
        return self.valued(comm.sum(self.words))

    def valued(self, words: Ints) -> Floats:
        """(k,) what ``words`` (2, k) of all ranks together are."""
        high, low = words
        whole = [math.ldexp(int(a) * 2**30 + int(b), -30) for a, b in zip(high, low, strict=True)]
        return np.asarray(np.array(whole) / self.scale)


class Columns(Protocol):
    """Columns of values that are somewhere, not necessarily side by side."""

    def largest(self) -> Floats:
        """(k,) largest magnitude of each column, by ``larger``."""

    def limbs(self, scale: Floats) -> Ints:
        """(groups, 2k) sums of the high limbs of each column, in quanta of one over ``scale`` (k,), and of the low
        ones; of each group of rows.
        """


class Table:
    """The columns of an array, all rows in one group."""

    def __init__(self, values: Floats) -> None:
        self._values = values

    def largest(self) -> Floats:
        return np.asarray(_largest(self._values))

    def limbs(self, scale: Floats) -> Ints:
        return np.asarray(_limbs(self._values, scale))[None]


class Grouped(Table):
    """The columns of an array whose row i belongs to ``group`` i, (n,), of so many."""

    def __init__(self, values: Floats, group: Indices, groups: int) -> None:
        super().__init__(values)
        self._group, self._groups = group, groups

    def limbs(self, scale: Floats) -> Ints:
        return np.asarray(_limbs_by_group(self._values, self._group, self._groups, scale))


def exact_sums(comm: Comm, *tables: Floats) -> Floats:
    """(k,) sums of the columns of ``tables`` (n, .) over all ranks, see ``exact_totals``."""
    return exact_totals(comm, *map(Table, tables))[0] if tables else np.zeros(0)


def exact_totals(comm: Comm, *tables: Columns) -> tuple[Floats, Floats]:
    """(k,) sums of the columns of ``tables`` over all ranks, and (groups, k) of each group of rows: the same bits for
    any order and partition. All tables have as many groups.

    Each value is split into two integer limbs of a common quantum, 2^-60 of the column's largest magnitude; the
    result is off by at most n times that quantum. The sum of a column with a value that is not finite is not a number.
    """
    mine = [table.largest() for table in tables]
    largest = comm.maximum(np.concatenate(mine))
    valued = np.isfinite(largest)
    exponent = np.frexp(np.where(valued, largest, 0.0))[1]
    scales = np.split(np.ldexp(1.0, 30 - exponent), np.cumsum([len(each) for each in mine])[:-1])
    limbs = [table.limbs(scale).reshape(-1, 2, len(scale)) for table, scale in zip(tables, scales, strict=True)]
    words = comm.sum(np.concatenate(limbs, axis=2))
    totals = np.array([_valued(group, exponent) for group in (words.sum(axis=0), *words)])
    totals[:, ~valued] = math.nan
    return totals[0], totals[1:]


def _valued(words: Ints, exponent: Indices) -> Floats:
    """(k,) what sums of limbs (2, k) are."""
    high, low = words
    whole = zip(high, low, exponent, strict=True)
    return np.array([math.ldexp(int(a) * 2**30 + int(b), int(e) - 60) for a, b, e in whole])
