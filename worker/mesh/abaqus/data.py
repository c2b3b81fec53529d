"""Data lines of an Abaqus input file: elements, ranges of numbers, positions and coordinates."""

import math
from array import array
from collections.abc import Iterator

from conoid.cases.reading.inp import fields, is_whole, numbers, whole, wholes

from ...errors import MeshError
from ...materials.turning import sine_and_cosine
from .elements import ElementType, Kind

_AXIS = 7
"""Number of values of a rotation: two points and an angle."""
_MOST_MADE = 20_000_000
"""Largest number of members that one GENERATE line may make. Chosen value: it is more than the number of elements of a
mesh that fits into about 100 GB of memory."""


def element_rows(lines: Iterator[tuple[int, str]], kind: ElementType) -> Iterator[tuple[int, list[str]]]:
    """Yield the first line and the fields of each element: the number of the element, then the numbers of its nodes. An
    element may take several lines.

    An omitted node represents the ground. Only elements without volume may have an omitted node. Raises MeshError.
    """
    row: list[str] = []
    first = 0
    for number, text in lines:
        items = fields(text)
        grounded = kind.kind is Kind.EMPTY and len(row) + len(items) == 1 + (kind.nodes or 0)
        goes_on = not items[-1]
        first = first if row else number
        row += items[:-1] if goes_on and not grounded else items
        if grounded or _complete(row, kind, goes_on, first):
            yield first, row
            row = []
    if row:
        raise MeshError(f"line {first}: an element of the type {kind.name} with {len(row) - 1} nodes{_expected(kind)}")


def _complete(row: list[str], kind: ElementType, goes_on: bool, line: int) -> bool:
    if kind.nodes is None:
        return not goes_on
    if kind.kind is Kind.SOLID and len(row) > 1 + kind.nodes:
        raise MeshError(f"line {line}: an element of the type {kind.name} with {len(row) - 1} nodes{_expected(kind)}")
    return len(row) >= 1 + kind.nodes


def _expected(kind: ElementType) -> str:
    return "" if kind.nodes is None else f"; expected {kind.nodes}"


def numbers_of(line: int, text: str) -> "array[int]":
    """Return the numbers that GENERATE makes from a first number, a last number and an increment. Raises MeshError."""
    items = fields(text)
    while len(items) > 2 and not items[-1]:
        items.pop()
    if not 2 <= len(items) <= 3:
        raise MeshError(
            f"line {line}: GENERATE takes a first number, a last one and a step; found {len(items)} numbers"
        )
    (first, last), step = wholes(line, items[:2]), _step(line, items)
    if step < 1 or last < first or (last - first) % step:
        raise MeshError(f"line {line}: no steps of {step} lead from {first} to {last}")
    made = range(first, last + 1, step)
    if made.stop - made.start > step * _MOST_MADE:
        raise MeshError(f"line {line}: GENERATE makes {(last - first) // step + 1} numbers; allowed are {_MOST_MADE}")
    return array("q", made)


def _step(line: int, items: list[str]) -> int:
    """Return the increment: the third number of the line, which may be 0, or 1 if the line has no third number. Raises
    MeshError.
    """
    if not items[2:]:
        return 1
    return int(items[2]) if is_whole(items[2]) else whole(line, items[2])


def translation(line: int, text: str) -> tuple[float, ...]:
    """Return the translation of an instance. Raises MeshError."""
    values = numbers(line, text)
    if len(values) > 3:
        raise MeshError(
            f"line {line}: the first data line of *INSTANCE is a translation, 3 numbers; found {len(values)} (a "
            "rotation alone has an empty line, or zeros, before it)"
        )
    return (*values, 0.0, 0.0, 0.0)[:3]


def axis(line: int, text: str) -> tuple[float, ...]:
    """Return two points of the axis of rotation of an instance, and the angle in degrees. Raises MeshError."""
    values = tuple(numbers(line, text))
    if len(values) != _AXIS:
        raise MeshError(f"line {line}: the second data line of *INSTANCE is a rotation, 7 numbers; found {len(values)}")
    if values[:3] == values[3:6]:
        raise MeshError(f"line {line}: the two points of the axis of rotation are the same")
    return values


def cylindrical(radius: float, angle: float, height: float) -> tuple[float, float, float]:
    """Return the Cartesian coordinates of a point in cylindrical coordinates. ``angle`` is in degrees."""
    sine, cosine = sine_and_cosine(math.radians(angle))
    return radius * cosine, radius * sine, height
