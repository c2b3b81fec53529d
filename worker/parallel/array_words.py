"""Kernels that write arrays into tables of arguments (arguments.py). They read the address and the shape of an array
from the array object itself.

The layout of the objects is part of the binary interface of CPython and numpy: ``PyTupleObject`` and
``PyArrayObject_fields`` (https://numpy.org/doc/stable/reference/c-api/types-and-structures.html). One call writes all
arrays of a table. In Python, each changed array would need eight calls of numpy.
"""

import ctypes
from typing import Any

from ..kernels.jit import njit
from .words import set_word, word_at

_WORD, _HALF = 8, 0xFFFFFFFF
"""Size of a word, bytes; mask of the 32-bit integer at the beginning of a word."""
_word = ctypes.c_int64.from_address
_TYPE, _SIZE, _ITEMS = 1, 2, 3
"""Words of a tuple: type, number of items, first item."""
_DATA, _NDIM, _SHAPE, _STRIDES, _DTYPE, _FLAGS = 2, 3, 4, 5, 7, 8
"""Words of an array: address of the data, number of axes, address of the shape and of the strides, dtype, flags."""
_NAME = 3
"""Word of a dtype that contains its kind, byte order and type number (``PyArray_Descr``)."""
_C_ORDER = 1
"""Flag of an array in C order (NPY_ARRAY_C_CONTIGUOUS)."""
LEAF = 5
"""Number of words that describe a leaf of a table: address of the words of the table; number of axes, -1 for a number;
1 for strides; word _NAME of the dtype; address of the array that was written last."""
_AT, _AXES, _STRIDED, _KIND, LAST = range(LEAF)
NUMBER = -1
"""Number of axes in the description of a number or a flag."""
ALONE = -1
"""Number of leaves of a value that is no record."""


@njit("boolean(int64, int64, int64)", cache=True)
def _write_leaf(leaf, item, array_type):  # type: ignore[no-untyped-def]
    """Writes the array object at the address ``item`` to its words. Returns False if it is no array as declared."""
    axes = word_at(leaf, _AXES)
    if axes == NUMBER or item == word_at(leaf, LAST):
        return True
    strided = word_at(leaf, _STRIDED) == 1
    if word_at(item, _TYPE) != array_type or word_at(word_at(item, _DTYPE), _NAME) != word_at(leaf, _KIND):
        return False
    if word_at(item, _NDIM) & _HALF != axes or not (strided or word_at(item, _FLAGS) & _C_ORDER):
        return False
    at, shape = word_at(leaf, _AT), word_at(item, _SHAPE)
    set_word(at, 0, word_at(item, _DATA))
    for k in range(axes):
        set_word(at, 1 + k, word_at(shape, k))
        if strided:
            set_word(at, 1 + axes + k, word_at(word_at(item, _STRIDES), k))
    set_word(leaf, LAST, item)
    return True


@njit("boolean(int64, int64, int64, int64)", cache=True)
def _write_leaves(leaves, items, n, array_type):  # type: ignore[no-untyped-def]
    """Writes ``n`` values from the address ``items`` on. Returns False if one of them is no array as declared."""
    for k in range(n):  # noqa: SIM110 - a kernel has no generators
        if not _write_leaf(leaves + _WORD * LEAF * k, word_at(items, k), array_type):
            return False
    return True


@njit("boolean(int64, int64, int64, int64, int64)", cache=True)
def write_leaves(leaves, values, first, n, array_type):  # type: ignore[no-untyped-def]
    """Writes the arrays of the tuple ``values`` of ``n`` leaves to a table from leaf number ``first`` on. Returns False
    if one of the values is no array as declared. ``leaves``: address of the descriptions of the leaves; ``array_type``:
    address of the type numpy.ndarray.
    """
    return _write_leaves(leaves + _WORD * LEAF * first, values + _WORD * _ITEMS, n, array_type)


@njit("boolean(int64, int64, int64, int64, int64)", cache=True)
def write_values(leaves, sizes, values, n, array_type):  # type: ignore[no-untyped-def]
    """Does the same as ``write_leaves`` for a tuple of ``n`` arrays and records. ``sizes``: address of the number of
    leaves of each value, ALONE if the value is no record.
    """
    at, items = leaves, values + _WORD * _ITEMS
    for k in range(n):
        size, item = word_at(sizes, k), word_at(items, k)
        if size == ALONE:
            if not _write_leaf(at, item, array_type):
                return False
            at += _WORD * LEAF
        else:
            if word_at(item, _SIZE) != size or not _write_leaves(at, item + _WORD * _ITEMS, size, array_type):
                return False
            at += _WORD * LEAF * size
    return True


def name_of(dtype: Any) -> int:
    """Returns the word of a dtype that contains its kind, byte order and type number."""
    return int(_word(id(dtype) + _WORD * _NAME).value)
