"""Kernels that write Python objects into tables of arguments (arguments.py): arrays, floating point numbers and flags.
They read the address and the shape of an array from the array object itself.

The layout of the objects is part of the binary interface of CPython and numpy: ``PyTupleObject``, ``PyFloatObject``
and ``PyArrayObject_fields`` (https://numpy.org/doc/stable/reference/c-api/types-and-structures.html). One call writes
all leaves of a table except integers. In Python, each changed array would need eight calls of numpy.
"""

import ctypes
from typing import Any

import numpy as np

from ..kernels.jit import njit
from .words import set_word, word_at

_WORD, _HALF = 8, 0xFFFFFFFF
"""Size of a word, bytes; mask of the 32-bit integer at the beginning of a word."""
_word = ctypes.c_int64.from_address
_TYPE, _SIZE, _ITEMS = 1, 2, 3
"""Words of an object: type; of a tuple: number of items, first item."""
_VALUE = 2
"""Word of a floating point number, also of type numpy.float64, that contains its value."""
_DATA, _NDIM, _SHAPE, _STRIDES, _DTYPE, _FLAGS = 2, 3, 4, 5, 7, 8
"""Words of an array: address of the data, number of axes, address of the shape and of the strides, dtype, flags."""
_NAME = 3
"""Word of a dtype that contains its kind, byte order and type number (``PyArray_Descr``)."""
_C_ORDER = 1
"""Flag of an array in C order (NPY_ARRAY_C_CONTIGUOUS)."""
LEAF = 5
"""Number of words that describe a leaf of a table: address of the words of the table; number of axes of an array, or
INTEGER, REAL or FLAG; 1 for strides; word _NAME of the dtype; address of the array that was written last."""
_AT, AXES, _STRIDED, _KIND, LAST = range(LEAF)
INTEGER, REAL, FLAG = -1, -2, -3
"""Kinds of leaves that are no arrays. The kernels omit integers, because CPython does not document their layout."""
_ARRAY, _FLOAT, _FLOAT64, _TRUE, _FALSE = range(5)
OBJECTS = np.array([id(np.ndarray), id(float), id(np.float64), id(True), id(False)])
"""Addresses of the types and constants that the kernels know."""
ALONE = -1
"""Number of leaves of a value that is no record."""


@njit("boolean(int64, int64, int64)", cache=True)
def _write_number(leaf, item, objects):  # type: ignore[no-untyped-def]
    """Writes a floating point number or a flag. Returns False if the object at the address ``item`` is none."""
    kind, at = word_at(leaf, AXES), word_at(leaf, _AT)
    if kind == REAL:
        of = word_at(item, _TYPE)
        set_word(at, 0, word_at(item, _VALUE))
        return of == word_at(objects, _FLOAT) or of == word_at(objects, _FLOAT64)
    set_word(at, 0, 1 if item == word_at(objects, _TRUE) else 0)
    return item == word_at(objects, _TRUE) or item == word_at(objects, _FALSE)


@njit("boolean(int64, int64, int64)", cache=True)
def _write_array(leaf, item, objects):  # type: ignore[no-untyped-def]
    """Writes the array at the address ``item``. Returns False if the object is no array as declared."""
    axes, strided = word_at(leaf, AXES), word_at(leaf, _STRIDED) == 1
    if word_at(item, _TYPE) != word_at(objects, _ARRAY):
        return False
    if word_at(word_at(item, _DTYPE), _NAME) != word_at(leaf, _KIND) or word_at(item, _NDIM) & _HALF != axes:
        return False
    if not (strided or word_at(item, _FLAGS) & _C_ORDER):
        return False
    at, shape = word_at(leaf, _AT), word_at(item, _SHAPE)
    set_word(at, 0, word_at(item, _DATA))
    for k in range(axes):
        set_word(at, 1 + k, word_at(shape, k))
        if strided:
            set_word(at, 1 + axes + k, word_at(word_at(item, _STRIDES), k))
    set_word(leaf, LAST, item)
    return True


@njit("boolean(int64, int64, int64)", cache=True)
def _write_leaf(leaf, item, objects):  # type: ignore[no-untyped-def]
    """Writes the object at the address ``item`` to the words of a leaf. Returns False if it has not the declared type.
    An array that was written last is not written again; a number is, because a program may have changed its word.
    """
    kind = word_at(leaf, AXES)
    if kind == INTEGER or (kind >= 0 and item == word_at(leaf, LAST)):
        return True
    return _write_array(leaf, item, objects) if kind >= 0 else _write_number(leaf, item, objects)


@njit("boolean(int64, int64, int64, int64)", cache=True)
def _write_leaves(leaves, items, n, objects):  # type: ignore[no-untyped-def]
    """Writes ``n`` values from the address ``items`` on. Returns False if one of them has not the declared type."""
    for k in range(n):  # noqa: SIM110 - a kernel has no generators
        if not _write_leaf(leaves + _WORD * LEAF * k, word_at(items, k), objects):
            return False
    return True


@njit("boolean(int64, int64, int64, int64, int64)", cache=True)
def write_leaves(leaves, values, first, n, objects):  # type: ignore[no-untyped-def]
    """Writes the tuple ``values`` of ``n`` leaves to a table from leaf number ``first`` on. Returns False if one of the
    values has not the declared type. ``leaves``: address of the descriptions of the leaves; ``objects``: address of
    OBJECTS.
    """
    return _write_leaves(leaves + _WORD * LEAF * first, values + _WORD * _ITEMS, n, objects)


@njit("boolean(int64, int64, int64, int64, int64)", cache=True)
def write_values(leaves, sizes, values, n, objects):  # type: ignore[no-untyped-def]
    """Does the same as ``write_leaves`` for a tuple of ``n`` leaves and records. ``sizes``: address of the number of
    leaves of each value, ALONE if the value is no record.
    """
    at, items = leaves, values + _WORD * _ITEMS
    for k in range(n):
        size, item = word_at(sizes, k), word_at(items, k)
        if size == ALONE:
            if not _write_leaf(at, item, objects):
                return False
            at += _WORD * LEAF
        else:
            if word_at(item, _SIZE) != size or not _write_leaves(at, item + _WORD * _ITEMS, size, objects):
                return False
            at += _WORD * LEAF * size
    return True


def name_of(dtype: Any) -> int:
    """Returns the word of a dtype that contains its kind, byte order and type number."""
    return int(_word(id(dtype) + _WORD * _NAME).value)
