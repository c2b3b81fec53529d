"""Tables of kernel arguments. A table consists of 64-bit words at one address, and a kernel takes this address as
argument instead of records of arrays.

A call with records as arguments costs 4 us or more, because numba unpacks each array of each record. A call with an
address as argument costs 0.2 us, and any thread can make such a call. An array takes 1 + ndim words, its address and
its shape. If the array is not in C order, ndim further words contain its strides. A number or a flag takes one word.
Arrays that a kernel reads from the table have no owner and no reference counts. Therefore ``Arguments`` holds
references to these arrays.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir

from ..kernels.jit import intrinsic, packed, several, types
from ..model.growing import address_of
from .array_words import ALONE, AXES, FLAG, INTEGER, LAST, OBJECTS, REAL, name_of, write_leaves, write_values

_WORD, _BIT = ir.IntType(64), ir.IntType(1)
"""LLVM types: a word of a table, and a flag."""
_OBJECTS = address_of(OBJECTS)
"""Address of the types and constants that the kernels of array_words.py know."""


_NUMBERS = {types.float64: REAL, types.boolean: FLAG}
"""Kinds of leaves that are numbers, except integers."""


class Follow(NamedTuple):
    """A number in the argument table of a stage that changes during a program: the product of a number of the program
    and a constant factor.
    """

    number: int
    """Index of the number of the program."""
    factor: float = 1.0


class Tie(NamedTuple):
    """A word of an argument table that changes with a number of the program."""

    number: int
    factor: float
    address: int
    """Address of the word."""


class Arguments:
    """A table for arguments of the numba types ``kinds``. A record counts as one argument."""

    def __init__(self, *kinds: Any) -> None:
        self._kinds = list(_leaves(several(*kinds)))
        leaves = [_words(kind) for kind in self._kinds]
        self._places = np.cumsum([0, *leaves])[:-1].tolist()
        words = np.zeros(sum(leaves), np.int64)
        self._words = words.data
        self._reals = self._words.cast("B").cast("d")
        self.address = address_of(words)
        """Address of the table, which kernels take as argument."""
        self._leaves = np.array([self._leaf(k, kind) for k, kind in enumerate(self._kinds)], np.int64)
        self._leaves_at = address_of(self._leaves)
        self._kept: list[Any] = [None] * len(leaves)
        """Leaves of the table that ``put`` has written; the references keep their memory."""
        self._values: tuple[Any, ...] = ()
        """Values of the last call of ``set``."""
        self._sizes, self._sizes_at = np.zeros(0, np.int64), 0
        self._all_integers = np.flatnonzero(self._leaves[:, AXES] == INTEGER).tolist()
        self._integers: list[tuple[int, int, int]] = []
        """Integers among the values of ``set``: number of the leaf; number of the value; number of the field, -1 if the
        value is no record."""

    def _leaf(self, k: int, kind: Any) -> tuple[int, ...]:
        """Return the description of leaf number ``k``; see array_words.py."""
        if not isinstance(kind, types.Array):
            return self.place(k), _NUMBERS.get(kind, INTEGER), 0, 0, 0
        return self.place(k), kind.ndim, int(_is_strided(kind)), name_of(_dtype(kind)), 0

    def set(self, *values: Any) -> int:
        """Write the arguments into the table and return its address. Arrays that are already in the table are not
        written again.

        Records are tuples, and must be at the same positions in every call. Raises ValueError if an array does not have
        the declared type, or is not in C order although the declared type is in C order.
        """
        if len(values) != len(self._values):
            self._divide(values)
        if not write_values(self._leaves_at, self._sizes_at, id(values), len(values), _OBJECTS):
            self._write_all(values)
        for k, of, field in self._integers:
            self._words[self._places[k]] = int(values[of] if field < 0 else values[of][field])
        self._values = values
        return self.address

    def _divide(self, values: tuple[Any, ...]) -> None:
        """Divide the leaves of the table among the ``values`` of ``set``."""
        sizes = [len(value) if isinstance(value, tuple) else ALONE for value in values]
        self._sizes = np.array(sizes, np.int64)
        self._sizes_at = address_of(self._sizes)
        fields = [(of, field) for of, size in enumerate(sizes) for field in (range(size) if size >= 0 else (-1,))]
        self._integers = [(k, *at) for k, at in enumerate(fields) if k in self._all_integers]

    def _write_all(self, values: tuple[Any, ...]) -> None:
        """Write all leaves in Python. ``set`` calls this method if an array is of a subclass, or of a type that equals
        the declared one but has another number in numpy, or if a number must be converted. Raises ValueError if the
        type of an array differs.
        """
        self._leaves[:, LAST] = 0
        leaves = [leaf for value in values for leaf in (value if isinstance(value, tuple) else (value,))]
        for k, leaf in enumerate(leaves):
            self._put(k, leaf)

    def bind(self, *values: Any) -> tuple[int, tuple[Tie, ...]]:
        """Write the arguments as ``set`` does, but some of the numbers are ``Follow`` objects. Return the address of
        the table, and the words that the program writes. The next call of ``set`` writes these words again.
        """
        address = self.set(*(0.0 if isinstance(value, Follow) else value for value in values))
        begins = np.cumsum([0, *np.abs(self._sizes)]).tolist()
        ties = [
            Tie(*value, self.place(begin)) for begin, value in zip(begins, values, strict=False)
            if isinstance(value, Follow)
        ]  # fmt: skip
        return address, tuple(ties)

    def place(self, k: int) -> int:
        """Return the address of leaf number ``k``. A leaf is an array, a number or a flag."""
        return int(self.address + self._words.itemsize * self._places[k])

    def put(self, first: int, leaves: tuple[Any, ...]) -> None:
        """Write the leaves (arrays, numbers and flags) from number ``first`` on. Arrays that are already in the table
        are not written again.
        """
        end = first + len(leaves)
        if not write_leaves(self._leaves_at, id(leaves), first, len(leaves), _OBJECTS):
            self._leaves[first:end, LAST] = 0
            for k, leaf in enumerate(leaves, first):
                self._put(k, leaf)
        for k in self._all_integers:
            if first <= k < end:
                self._words[self._places[k]] = int(leaves[k - first])
        self._kept[first:end] = leaves

    def _put(self, k: int, value: Any) -> None:
        """Write a leaf in Python. The description of the leaf does not change, so the next call writes it again."""
        kind, at = self._kinds[k], self._places[k]
        if isinstance(kind, types.Array):
            self._put_array(kind, at, value)
        elif kind == types.float64:
            self._reals[at] = value
        else:
            self._words[at] = int(value)

    def _put_array(self, kind: Any, at: int, value: Any) -> None:
        strided = _is_strided(kind)
        if not (strided or value.flags.c_contiguous):
            raise ValueError("an array of a table must be in C order")
        if value.ndim != kind.ndim or value.dtype != _dtype(kind):
            raise ValueError(f"an array of a table is {value.dtype} with {value.ndim} axes instead of {kind}")
        for word in (address_of(value), *value.shape, *(value.strides if strided else ())):
            self._words[at] = word
            at += 1


class Handle:
    """Tables of arguments for the stages of a program, under one address; a kernel reads the tables that it needs."""

    def __init__(self, *kinds: tuple[Any, ...]) -> None:
        """``kinds``: numba types of the arguments of each table."""
        self._every = Arguments(*(kind for each in kinds for kind in each))
        sizes = [sum(1 for kind in each for _ in _leaves(kind)) for each in kinds]
        self._first = np.cumsum([0, *sizes])[:-1].tolist()
        self._words = np.array([self._every.place(first) for first in self._first])
        self.address = address_of(self._words)

    def set(self, k: int, *leaves: Any) -> None:
        """Write the arguments of the tables from number ``k`` on, one table after the other. A record is replaced by
        its fields. Arguments that are already in the tables are not written again.
        """
        self._every.put(self._first[k], leaves)


def _dtype(kind: Any) -> np.dtype[Any]:
    return np.dtype(str(kind.dtype).replace("boolean", "bool"))


def _leaves(kind: Any) -> Iterator[Any]:
    if isinstance(kind, types.BaseTuple):
        for each in kind.types:  # type: ignore[attr-defined]
            yield from _leaves(each)
    else:
        yield kind


def _is_strided(kind: Any) -> bool:
    return isinstance(kind, types.Array) and kind.layout == "A"


def _words(kind: Any) -> int:
    if not isinstance(kind, types.Array):
        return 1
    return 1 + (2 if _is_strided(kind) else 1) * kind.ndim


def reader(*kinds: Any) -> Any:
    """Return a function for kernels; the function reads arguments of the given types at an address, and returns them as
    a tuple.
    """
    kind = several(*kinds)

    def read(_: Any, address: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return _read(context, builder, kind, builder.inttoptr(args[0], _WORD.as_pointer()), 0)[0]

        return kind(address), emit

    return intrinsic(read)


def table_of(k: int, *kinds: Any) -> Any:
    """Return a function for kernels; the function reads the arguments of table ``k`` of a ``Handle``, and returns them
    as a tuple. The arguments have the given types; the function takes the address of the handle.
    """
    kind = several(*kinds)

    def read(_: Any, address: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            tables = builder.inttoptr(args[0], _WORD.as_pointer())
            base = builder.inttoptr(builder.load(builder.gep(tables, [_WORD(k)])), _WORD.as_pointer())
            return _read(context, builder, kind, base, 0)[0]

        return kind(address), emit

    return intrinsic(read)


def _read(context: Any, builder: Any, kind: Any, base: Any, at: int) -> tuple[Any, int]:
    """Return the value of type ``kind`` that begins at word ``at`` of the table ``base``, and the index of the first
    word after the value.
    """
    if isinstance(kind, types.BaseTuple):
        values = []
        for each in kind.types:  # type: ignore[attr-defined]
            value, at = _read(context, builder, each, base, at)
            values.append(value)
        return context.make_tuple(builder, kind, values), at
    words = [builder.load(builder.gep(base, [_WORD(at + k)])) for k in range(_words(kind))]
    return _value(context, builder, kind, words), at + len(words)


def _value(context: Any, builder: Any, kind: Any, words: list[Any]) -> Any:
    if isinstance(kind, types.Array):
        return _array(context, builder, kind, words[0], words[1 : 1 + kind.ndim], words[1 + kind.ndim :])
    if kind == types.float64:
        return builder.bitcast(words[0], ir.DoubleType())
    return builder.trunc(words[0], _BIT) if kind == types.boolean else words[0]


def _array(context: Any, builder: Any, kind: Any, address: Any, shape: list[Any], strides: list[Any]) -> Any:
    item = context.get_data_type(kind.dtype)
    size = _WORD(context.get_abi_sizeof(item))
    strides, step = list(strides), size
    for length in [] if strides else reversed(shape):
        strides.insert(0, step)
        step = builder.mul(step, length)
    array = context.make_array(kind)(context, builder)
    context.populate_array(
        array, data=builder.inttoptr(address, item.as_pointer()), shape=packed(builder, shape),
        strides=packed(builder, strides), itemsize=size, meminfo=None, parent=None,
    )  # fmt: skip
    return array._getvalue()
