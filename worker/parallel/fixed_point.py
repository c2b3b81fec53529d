"""Sums that do not depend on the order of their terms. The terms are integers in units of a power of two.

The scale of the nodal forces is computed from the largest contribution of the previous step. If a contribution is too
large for the scale, the sum is repeated in a larger quantum. A contribution has 51 bits, and node 0 of a tet may get
three contributions. Therefore the sum cannot overflow at a node with up to 680 tets, which is twenty times the number
of tets at a node of a usual mesh.
"""

import math
import struct
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..kernels.jit import njit
from ..materials.elementary import NEAREST
from ..model.state import Floats, Ints
from .comm import Comm

CONTRIBUTION_BITS = 51
"""Number of bits of a contribution. A contribution is below 2^51 quanta, because the sum of such a value and 1.5 * 2^52
in float64 is rounded to an integer (elements/forces.py)."""
HEADROOM_BITS = 5
"""Number of bits of headroom. Contributions may increase 32-fold in a step before the sum must be repeated."""
_NEAREST_BITS = 0x4338000000000000
"""Bit pattern of the float64 NEAREST."""
_MAGNITUDE, _INFINITE = 0x7FFFFFFFFFFFFFFF, 0x7FF0000000000000
"""Mask of all bits of a float64 except its sign; and bit pattern of infinity."""
_LIMB_BITS = 30
_LIMB = 2.0**_LIMB_BITS
"""Number of quanta of the low limb in a quantum of the high limb. Two limbs have 60 bits together; each limb can sum
2^32 values in an int64."""
_WORD, _REAL = struct.Struct("=q"), struct.Struct("=d")
_SMALLEST = -993
"""Smallest exponent of the largest magnitude in a column. With a smaller exponent the scale would overflow."""


def float_of(bits: int) -> float:
    """Return the float64 that has the bit pattern ``bits``."""
    return float(_REAL.unpack(_WORD.pack(bits))[0])


def bits_of(value: float) -> int:
    """Return the bit pattern of a float64 as an integer."""
    return int(_WORD.unpack(_REAL.pack(value))[0])


@njit("float64(float64)", cache=True)
def scale_for(largest):  # type: ignore[no-untyped-def]
    """Return the number of quanta per newton for contributions up to ``largest``, N; the result includes the
    headroom.
    """
    return math.ldexp(1.0, CONTRIBUTION_BITS - HEADROOM_BITS - math.frexp(largest)[1])


@njit("boolean(float64, float64)", cache=True)
def outgrown(largest, scale):  # type: ignore[no-untyped-def]
    """Return True if a contribution of ``largest``, N, exceeds the range of the scale."""
    return not largest * scale < 2.0**CONTRIBUTION_BITS


@njit("float64(int64)", cache=True)
def magnitude(bits):  # type: ignore[no-untyped-def]
    """Return the float64 with the bit pattern ``bits``, which is the result of ``most``; infinity if a value was not
    finite.
    """
    return np.int64(bits).view(np.float64) if bits < _INFINITE else math.inf


@njit("int64(float64[::1])", cache=True, error_model="numpy")
def most(values):  # type: ignore[no-untyped-def]
    """Return the largest magnitude as its bit pattern (integer). Bit patterns have the order of the floats. The bit
    pattern of a value that is not finite is larger than those of all finite values. Therefore a maximum over ranks
    keeps such a value.
    """
    found = np.int64(0)
    for i in range(len(values)):
        found = max(found, np.float64(values[i]).view(np.int64) & _MAGNITUDE)
    return found


@njit("UniTuple(int64, 2)(float64[::1], float64)", cache=True, error_model="numpy")
def limbs(values, scale):  # type: ignore[no-untyped-def]
    """Return the sums of the high and of the low limbs of ``values``, in quanta of 1 / ``scale`` and 2^-30 / ``scale``;
    undefined if a value reaches 2^51 quanta.

    The last bits of x + NEAREST are the integer nearest to x; if two integers are equally near, the even one.
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
    """Set ``largest`` (k,) to the largest magnitude of each column (``Columns.largest``)."""
    for j in range(len(largest)):
        largest[j] = magnitude(most(values[starts[j] : starts[j + 1]]))


@njit("void(int64[:, ::1], float64[::1], int64[::1], float64[::1])", cache=True, error_model="numpy")
def _limbs(words, values, starts, scale):  # type: ignore[no-untyped-def]
    """Set ``words`` (2, k) to the sums of the high limbs and of the low limbs of each column."""
    for j in range(len(scale)):
        words[0, j], words[1, j] = limbs(values[starts[j] : starts[j + 1]], scale[j])


def _whole(words: Ints) -> Floats:
    """Return (..., k) the values of the sums of limbs (..., 2, k), in quanta of the low limb; the result is rounded
    once.
    """
    high, low = words[..., 0, :], words[..., 1, :]
    over = high + (low >> _LIMB_BITS)
    if over.size and max(int(over.max()), -int(over.min())) < 2**53:  # two exact terms, so only one rounding
        return np.asarray(over * _LIMB + (low & ((1 << _LIMB_BITS) - 1)))
    pairs = zip(high.reshape(-1).tolist(), low.reshape(-1).tolist(), strict=True)
    return np.array([float((a << _LIMB_BITS) + b) for a, b in pairs]).reshape(high.shape)


@njit("void(int64[:, ::1])", cache=True)
def _carry(words):  # type: ignore[no-untyped-def]
    """Move the overflow of the low limbs to the high limbs (``Tally.carry``)."""
    for j in range(words.shape[1]):
        over = (words[1, j] + (1 << (_LIMB_BITS - 1))) >> _LIMB_BITS
        words[0, j] += over
        words[1, j] -= over << _LIMB_BITS


class Tally:
    """Sums that are accumulated over a whole run. The sums are integers in two limbs, and do not depend on the order of
    the terms and on the ranks.
    """

    def __init__(self, largest: Floats) -> None:
        """``largest`` (k,): order of magnitude of the values that are added to each sum; the quantum is 2^-60 of
        ``largest``.
        """
        self.scale = np.ldexp(1.0, 30 - np.frexp(largest)[1])
        """(k,) number of quanta of the high limb per unit."""
        self.words = np.zeros((2, len(largest)), np.int64)
        """(2, k) sums of the high limbs and of the low limbs."""

    def quanta(self, values: Floats) -> Ints:
        """Return (2, k) the limbs of the sum of the rows of ``values`` (n, k)."""
        scaled = values * self.scale
        high = np.rint(scaled)
        low = np.rint((scaled - high) * _LIMB)
        return np.array([high.astype(np.int64).sum(axis=0), low.astype(np.int64).sum(axis=0)])

    def add(self, values: Floats) -> None:
        """Add every row of ``values`` (n, k)."""
        self.words += self.quanta(values)
        self.carry()

    def carry(self) -> None:
        """Move the overflow of the low limbs to the high limbs; the values of the sums do not change.

        Each value adds at most 2^29 quanta to a low limb. Without ``carry`` the limb would overflow after 2^34 values,
        and contact may add so many values in a long run.
        """
        _carry(self.words)

    def total(self, comm: Comm) -> Floats:
        """Return (k,) the sums over all ranks. Collective."""
        return self.valued(comm.sum(self.words))

    def valued(self, words: Ints) -> Floats:
        """Return (k,) the values from the limbs ``words`` (2, k), summed over all ranks."""
        return np.asarray(_whole(words) / _LIMB / self.scale)


class Columns(Protocol):
    """Interface of columns of values. The rows need not be contiguous in memory."""

    def largest(self) -> Floats:
        """Return (k,) the largest magnitude in each column; infinite if a value is not finite."""

    def limbs(self, scale: Floats) -> Ints:
        """Return (groups, 2, k) the sums of the high limbs and of the low limbs of each column, for each group of rows,
        in quanta of 1 / ``scale`` (k,).
        """


class Ragged:
    """Columns of different lengths in one array ``values``. Column k begins at ``starts`` (k + 1,).

    All rows belong to the first group.
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
    """The columns of an array (n, k). If the array is the transpose of a C-ordered array, no copy is made."""

    def __init__(self, values: Floats, groups: int = 1) -> None:
        self._columns = np.ascontiguousarray(values.T)
        n, k = values.shape
        super().__init__(self._columns.reshape(-1), np.arange(k + 1) * n, groups)


def exact_sums(comm: Comm, *tables: Floats) -> Floats:
    """Return (k,) the sums of the columns of the ``tables`` (n, .) over all ranks (``exact_totals``)."""
    return exact_totals(comm, *map(Table, tables))[0] if tables else np.zeros(0)


def exact_totals(comm: Comm, *tables: Columns) -> tuple[Floats, Floats]:
    """Return (k,) the sums of the columns of ``tables`` over all ranks, and (groups, k) the sums of each group of rows.
    The results are bit-identical for any order and partition. All tables must have the same number of groups.
    Collective.

    Each value is split into two integer limbs of a common quantum, 2^-60 of the column's largest magnitude; the error
    of the result is at most n quanta. If a column has a value that is not finite, its sum is NaN.
    """
    return totals_and_words(comm, tables, np.zeros(0, np.int64))[:2]


def totals_and_words(comm: Comm, tables: Sequence[Columns], more: Ints) -> tuple[Floats, Floats, Ints]:
    """Return the result of ``exact_totals``. Also return the sums of the integers ``more`` (m,) over all ranks, from
    the same reduction.

    Collective.
    """
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
