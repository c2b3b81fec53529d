"""Sums that do not depend on their order: integers in units of a power of two.

The scale of the nodal forces follows the largest contribution of the step before; when a step outgrows it, the sum is
repeated in a coarser quantum. A contribution has 51 bits; node 0 of a tet may get three of them, so a node could have
680 tets before its sum wraps: twenty times what a mesh has.
"""

import math
import struct
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..kernels.jit import njit
from ..materials.elementary import NEAREST
from ..model.state import Floats, Indices, Ints
from .comm import Comm

CONTRIBUTION_BITS = 51
"""A contribution stays below 2^51 quanta, where a float64 beside 1.5 times 2^52 counts integers one by one
(elements/tet4.py)."""
HEADROOM_BITS = 5
"""The next step may grow 32-fold before its sum has to be repeated."""
_NEAREST_BITS = 0x4338000000000000
"""Bits of NEAREST."""
_MAGNITUDE, _INFINITE = 0x7FFFFFFFFFFFFFFF, 0x7FF0000000000000
"""All bits of a float64 but its sign; those of infinity."""
_LIMB_BITS = 30
_LIMB = 2.0**_LIMB_BITS
"""Quanta of the low limb in one of the high: 60 bits in two limbs, each of which sums 2^32 values in an int64."""
_WORD, _REAL = struct.Struct("=q"), struct.Struct("=d")
_SMALLEST = -993
"""Exponent of columns of smaller values: at a lower one the scale would have no bound."""


def float_of(bits: int) -> float:
    """The float64 with these bits."""
    return float(_REAL.unpack(_WORD.pack(bits))[0])


def bits_of(value: float) -> int:
    """The bits of a float64."""
    return int(_WORD.unpack(_REAL.pack(value))[0])


def scale_for(largest: float) -> float:
    """Quanta per newton for contributions up to ``largest``, N, with room to grow."""
    return math.ldexp(1.0, CONTRIBUTION_BITS - HEADROOM_BITS - math.frexp(largest)[1])


def outgrown(largest: float, scale: float) -> bool:
    """Whether a contribution of ``largest``, N, does not fit the scale."""
    return not largest * scale < 2.0**CONTRIBUTION_BITS


@njit("float64(int64)", cache=True)
def magnitude(bits):  # type: ignore[no-untyped-def]
    """What ``most`` has found; infinite where that is not finite."""
    return np.int64(bits).view(np.float64) if bits < _INFINITE else math.inf


@njit("int64(float64[::1])", cache=True, error_model="numpy")
def most(values):  # type: ignore[no-untyped-def]
    """The largest magnitude, as bits: they have the order of the floats, and what is not finite is above all that are,
    which no maximum over ranks may drop.
    """
    found = np.int64(0)
    for i in range(len(values)):
        found = max(found, np.float64(values[i]).view(np.int64) & _MAGNITUDE)
    return found


@njit("UniTuple(int64, 2)(float64[::1], float64)", cache=True, error_model="numpy")
def limbs(values, scale):  # type: ignore[no-untyped-def]
    """Sums of the high and of the low limbs of ``values``, in quanta of one over ``scale`` and 2^-30 of it: any where
    these reach 2^51 of them. A number beside NEAREST has the nearest integer in its last bits, the even one of two.
    """
    highs, lows = np.int64(0), np.int64(0)
    for i in range(len(values)):
        scaled = values[i] * scale
        shifted = scaled + NEAREST
        highs += np.float64(shifted).view(np.int64) - _NEAREST_BITS
        lows += np.float64((scaled - (shifted - NEAREST)) * _LIMB + NEAREST).view(np.int64) - _NEAREST_BITS
    return highs, lows


@njit("void(float64[::1], float64[::1], int64[::1])", cache=True, error_model="numpy")
def _largest(largest, values, starts):  # type: ignore[no-untyped-def]
    """Sets the ``largest`` (k,) magnitude of each column, see ``Columns``."""
    for j in range(len(largest)):
        largest[j] = magnitude(most(values[starts[j] : starts[j + 1]]))


@njit("void(int64[:, ::1], float64[::1], int64[::1], float64[::1])", cache=True, error_model="numpy")
def _limbs(words, values, starts, scale):  # type: ignore[no-untyped-def]
    """Sets the sums of the high and of the low limbs of each column, ``words`` (2, k)."""
    for j in range(len(scale)):
        words[0, j], words[1, j] = limbs(values[starts[j] : starts[j + 1]], scale[j])


@njit("void(int64[:, :, ::1], float64[:, ::1], int32[::1], float64[::1])", cache=True, error_model="numpy")
def _limbs_by_group(words, columns, group, scale):  # type: ignore[no-untyped-def]
    """Adds the same of each ``group`` (n,) of ``columns`` (k, n) to ``words`` (groups, 2, k), run by run."""
    begin = 0
    while begin < len(group):
        end = begin + 1
        while end < len(group) and group[end] == group[begin]:
            end += 1
        for j in range(len(scale)):
            high, low = limbs(columns[j, begin:end], scale[j])
            words[group[begin], 0, j] += high
            words[group[begin], 1, j] += low
        begin = end


def _whole(words: Ints) -> Floats:
    """(..., k) quanta of the low limb that sums of limbs (..., 2, k) are, rounded once."""
    high, low = words[..., 0, :], words[..., 1, :]
    over = high + (low >> _LIMB_BITS)
    if over.size and max(int(over.max()), -int(over.min())) < 2**53:  # exact, so that the sum is what rounds
        return np.asarray(over * _LIMB + (low & ((1 << _LIMB_BITS) - 1)))
    pairs = zip(high.reshape(-1).tolist(), low.reshape(-1).tolist(), strict=True)
    return np.array([float((a << _LIMB_BITS) + b) for a, b in pairs]).reshape(high.shape)


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
        return np.asarray(_whole(words) / _LIMB / self.scale)


class Columns(Protocol):
    """Columns of values that are somewhere, not necessarily side by side."""

    def largest(self) -> Floats:
        """(k,) largest magnitude of each column; infinite where a value is not finite."""

    def limbs(self, scale: Floats) -> Ints:
        """(groups, 2, k) sums of the high limbs of each column, in quanta of one over ``scale`` (k,), and of the low
        ones; of each group of rows.
        """


class Ragged:
    """Columns of any lengths, one after the other in ``values``, of which column k begins at ``starts`` (k + 1,); all
    rows are in the first of so many groups.
    """

    def __init__(self, values: Floats, starts: Ints, groups: int = 1) -> None:
        self._values, self._starts, self._groups = values, starts, groups

    def largest(self) -> Floats:
        found = np.empty(len(self._starts) - 1)
        _largest(found, self._values, self._starts)
        return found

    def limbs(self, scale: Floats) -> Ints:
        words = np.zeros((self._groups, 2, len(scale)), np.int64)
        _limbs(words[0], self._values, self._starts, scale)
        return words


class Table(Ragged):
    """The columns of an array (n, k); one that is the transpose of another is read where it is."""

    def __init__(self, values: Floats, groups: int = 1) -> None:
        self._columns = np.ascontiguousarray(values.T)
        n, k = values.shape
        super().__init__(self._columns.reshape(-1), np.arange(k + 1) * n, groups)


class Grouped(Table):
    """The columns of an array whose row i belongs to ``group`` i, (n,), of so many; quick where neighbours are in
    one."""

    def __init__(self, values: Floats, group: Indices, groups: int) -> None:
        super().__init__(values, groups)
        self._group = group

    def limbs(self, scale: Floats) -> Ints:
        words = np.zeros((self._groups, 2, len(scale)), np.int64)
        _limbs_by_group(words, self._columns, self._group, scale)
        return words


def exact_sums(comm: Comm, *tables: Floats) -> Floats:
    """(k,) sums of the columns of ``tables`` (n, .) over all ranks, see ``exact_totals``."""
    return exact_totals(comm, *map(Table, tables))[0] if tables else np.zeros(0)


def exact_totals(comm: Comm, *tables: Columns) -> tuple[Floats, Floats]:
    """(k,) sums of the columns of ``tables`` over all ranks, and (groups, k) of each group of rows: the same bits for
    any order and partition. All tables have as many groups.

    Each value is split into two integer limbs of a common quantum, 2^-60 of the column's largest magnitude; the
    result is off by at most n times that quantum. The sum of a column with a value that is not finite is not a number.
    """
    return totals_and_words(comm, tables, np.zeros(0, np.int64))[:2]


def totals_and_words(comm: Comm, tables: Sequence[Columns], more: Ints) -> tuple[Floats, Floats, Ints]:
    """What ``exact_totals`` gives, and the sums of integers ``more`` (m,) over all ranks, that go with them."""
    mine = [table.largest() for table in tables]
    largest = comm.maximum(np.concatenate(mine))
    valued = np.isfinite(largest)
    exponent = np.maximum(np.frexp(np.where(valued, largest, 0.0))[1], _SMALLEST)
    scale, end, found = np.ldexp(1.0, _LIMB_BITS - exponent), 0, []
    for table, each in zip(tables, mine, strict=True):
        begin, end = end, end + len(each)
        found.append(table.limbs(scale[begin:end]))
    words = np.concatenate(found, axis=2)
    flat = comm.sum(np.concatenate([words.reshape(-1), more]))
    words = flat[: words.size].reshape(words.shape)
    totals = np.ldexp(_whole(np.concatenate([words.sum(axis=0, keepdims=True), words])), exponent - 2 * _LIMB_BITS)
    totals[:, ~valued] = math.nan
    return totals[0], totals[1:], flat[words.size :]
