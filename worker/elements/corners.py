"""Nodal values at the corners of tets, read and added to as vectors of four numbers.

A row of scratch memory has one number of each tet, and a node has its components side by side. A loop that copies the
numbers one by one from nodes to rows took a third of the time of an elastic step (docs/performance/history.md). The
functions of this module treat four tets at once: one instruction reads the three components of a node, and the vectors
of four tets are transposed in registers::

    x of tet 0   a0 a1 a2  -          row 0   a0 b0 c0 d0
    x of tet 1   b0 b1 b2  -    -->   row 1   a1 b1 c1 d1
    x of tet 2   c0 c1 c2  -          row 2   a2 b2 c2 d2
    x of tet 3   d0 d1 d2  -

The results are bit-identical to those of scalar code. LLVM makes code from the vectors for every processor.
"""

from typing import Any

from llvmlite import ir

from ..kernels.jit import intrinsic, types
from ..model.state import CHUNK
from .scratch import EDGE, MOVED

FOUR = 4
"""Number of tets that a function treats."""
_AXES, _CORNERS = 3, 4
_WORD, _INDEX = ir.IntType(64), ir.IntType(32)
_VECTOR = ir.VectorType(ir.DoubleType(), FOUR)
_QUANTA = ir.VectorType(_WORD, FOUR)
_POINTER = _QUANTA.as_pointer()
_MASK = ir.VectorType(ir.IntType(1), FOUR)
_NUMBER = 8
"""Bytes of a number; vectors in memory need no larger alignment."""
Vectors = list[Any]
"""LLVM vectors, one for each tet, corner or row."""


def _shuffled(builder: Any, one: Any, two: Any, *places: int) -> Any:
    """Returns the vector of the numbers at ``places`` of two vectors, one after the other."""
    return builder.shuffle_vector(one, two, ir.Constant(ir.VectorType(_INDEX, len(places)), places))


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _corner(builder: Any, tets: Any, tet: Any, corner: int) -> Any:
    """Returns the local index of the node at a corner of ``tet``."""
    place = builder.add(builder.mul(tet, _WORD(_CORNERS)), _WORD(corner))
    return builder.zext(builder.load(builder.gep(tets, [place])), _WORD)


def _at_node(builder: Any, values: Any, node: Any) -> Any:
    """Returns the vector of the three components of a node, and zero. The memory after the components is not read."""
    kind = _VECTOR.as_pointer()
    read = builder.module.globals.get("llvm.masked.load.v4f64.p0") or ir.Function(
        builder.module, ir.FunctionType(_VECTOR, [kind, _INDEX, _MASK, _VECTOR]), "llvm.masked.load.v4f64.p0"
    )
    place = builder.bitcast(builder.gep(values, [builder.mul(node, _WORD(_AXES))]), kind)
    mask, zeros = ir.Constant(_MASK, [1, 1, 1, 0]), ir.Constant(_VECTOR, [0.0] * FOUR)
    return builder.call(read, [place, _INDEX(_NUMBER), mask, zeros])


def _differences(builder: Any, values: Any, tets: Any, tet: Any) -> Vectors:
    """Returns the values at corners 1, 2, 3 less the value at corner 0 of ``tet``."""
    origin, *others = (_at_node(builder, values, _corner(builder, tets, tet, j)) for j in range(_CORNERS))
    return [builder.fsub(each, origin) for each in others]


def _rows(builder: Any, tets: Vectors) -> Vectors:
    """Returns the rows x, y, z of four vectors (x, y, z, 0)."""
    low = [_shuffled(builder, tets[k], tets[k + 1], 0, 4, 2, 6) for k in (0, 2)]
    high = [_shuffled(builder, tets[k], tets[k + 1], 1, 5, 3, 7) for k in (0, 2)]
    first, third = (_shuffled(builder, low[0], low[1], *places) for places in ((0, 1, 4, 5), (2, 3, 6, 7)))
    return [first, _shuffled(builder, high[0], high[1], 0, 1, 4, 5), third]


def _store(builder: Any, rows: Any, first: int, i: Any, tets: list[Vectors]) -> None:
    """Stores three vectors of each of four tets in nine rows, from the row that begins at ``first`` on."""
    for corner in range(_CORNERS - 1):
        for axis, row in enumerate(_rows(builder, [each[corner] for each in tets])):
            at = builder.add(i, _WORD(first + (_AXES * corner + axis) * CHUNK))
            builder.store(row, builder.bitcast(builder.gep(rows, [at]), _VECTOR.as_pointer())).align = _NUMBER


def _gather(_: Any, rows: Any, values: Any, tets: Any, i: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        rows, values, tets = (_data(context, builder, signature.args[k], args[k]) for k in range(3))
        some = [_differences(builder, values, tets, builder.add(args[3], _WORD(k))) for k in range(FOUR)]
        _store(builder, rows, 0, args[3], some)
        return context.get_dummy_value()

    return types.void(rows, values, tets, i), emit


def _gather_moved(_: Any, w: Any, x0: Any, x: Any, tets: Any, i: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        w, x0, x, tets = (_data(context, builder, signature.args[k], args[k]) for k in range(4))
        places = [builder.add(args[4], _WORD(k)) for k in range(FOUR)]
        edges = [_differences(builder, x, tets, place) for place in places]
        before = [_differences(builder, x0, tets, place) for place in places]
        moved = [[builder.fsub(*pair) for pair in zip(*each, strict=True)] for each in zip(edges, before, strict=True)]
        _store(builder, w, EDGE, args[4], edges)
        _store(builder, w, MOVED, args[4], moved)
        return context.get_dummy_value()

    return types.void(w, x0, x, tets, i), emit


def _columns(builder: Any, rows: Any, first: int, i: Any) -> Vectors:
    """Returns the vectors (x, y, z, 0) of four tets, from three rows of integers; the first row begins at ``first``."""
    x, y, z = (
        builder.load(builder.bitcast(builder.gep(rows, [builder.add(i, _WORD(first + axis * CHUNK))]), _POINTER))
        for axis in range(_AXES)
    )
    for each in (x, y, z):
        each.align = _NUMBER
    zeros = ir.Constant(_QUANTA, [0] * FOUR)
    low = [_shuffled(builder, *pair, 0, 4, 2, 6) for pair in ((x, y), (z, zeros))]
    high = [_shuffled(builder, *pair, 1, 5, 3, 7) for pair in ((x, y), (z, zeros))]
    return [_shuffled(builder, *some, *places) for places in ((0, 1, 4, 5), (2, 3, 6, 7)) for some in (low, high)]


def _add(builder: Any, force: Any, node: Any, more: Any) -> None:
    """Adds a vector to the row of a node in a table (nodes, 4)."""
    place = builder.bitcast(builder.gep(force, [builder.mul(node, _WORD(FOUR))]), _POINTER)
    sums = builder.load(place)
    sums.align = _NUMBER
    builder.store(builder.add(sums, more), place).align = _NUMBER


def _add_forces(_: Any, force: Any, wi: Any, tets: Any, i: Any) -> Any:
    def emit(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        force, wi, tets = (_data(context, builder, signature.args[k], args[k]) for k in range(3))
        of_corners = [_columns(builder, wi, _AXES * corner * CHUNK, args[3]) for corner in range(_CORNERS - 1)]
        zeros = ir.Constant(_QUANTA, [0] * FOUR)
        for k, (first, second, third) in enumerate(zip(*of_corners, strict=True)):
            opposite = builder.sub(zeros, builder.add(builder.add(first, second), third))
            for corner, more in enumerate((opposite, first, second, third)):
                _add(builder, force, _corner(builder, tets, builder.add(args[3], _WORD(k)), corner), more)
        return context.get_dummy_value()

    return types.void(force, wi, tets, i), emit


gather: Any = intrinsic(_gather)
"""Function for kernels; it does for the four tets from ``i`` on what ``tet4.gather`` does for a chunk."""
gather_moved: Any = intrinsic(_gather_moved)
"""Function for kernels; it does for the four tets from ``i`` on what ``tet4.gather_moved`` does for a chunk."""
add_forces: Any = intrinsic(_add_forces)
"""Function for kernels; it does for the four tets from ``i`` on what ``forces.scatter_forces`` does for a chunk."""
