"""Nodes of the parts and sets of an Abaqus input file. The import reads the file a second time if keywords need the
nodes.
"""

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases.reading.inp import Block, InpError, Source, fields, is_whole, numbers

from ..topology import Point
from .keyword import joined
from .words import spelt

_SHIFT = 40
"""Number of bits for a node or element number; the bits above contain the index of the instance."""
_MOST = 20_000_000
"""Largest number of members of one line of GENERATE (chosen value: more than the nodes of any mesh that is run)."""


@dataclass
class Scope:
    """Nodes, elements and sets of a part, of an instance, or of the deck outside of parts and instances."""

    place: int
    points: dict[int, Point] = field(default_factory=dict)
    elements: "list[tuple[array[int], array[int], int]]" = field(default_factory=list)
    """Blocks of elements: element numbers, nodes of all elements one after another, and nodes per element."""
    node_sets: dict[str, set[int]] = field(default_factory=dict)
    element_sets: dict[str, set[int]] = field(default_factory=dict)
    """Sets of the scope outside of parts and instances contain numbers with the index of the instance in their upper
    bits."""
    part: str = ""
    move: tuple[float, ...] = ()
    axis: tuple[float, ...] = ()


class AbaqusMesh:
    """Nodes, elements and sets of an input file, by scope."""

    def __init__(self, path: Path) -> None:
        """Reads all of ``path``. Raises InpError."""
        self.root = Scope(0)
        self.parts: dict[str, Scope] = {}
        self.instances: dict[str, Scope] = {}
        self._here = self.root
        self._source = Source(path)
        for block in self._source.blocks():
            self._take(block)

    def _take(self, block: Block) -> None:
        word, given = spelt(block.word), {name: (value or "").strip('"') for name, value in block.parameters}
        if word == "PART":
            self._here = self.parts.setdefault(joined(given.get("NAME", "")), Scope(len(self.parts) + 1))
        elif word == "INSTANCE":
            rows = [numbers(line, text) for line, text in self._source.filled()]
            place = len(self.parts) + len(self.instances) + 1
            made = Scope(place, part=joined(given.get("PART", "")))
            for row in rows[:2]:
                made.axis, made.move = (tuple(row), made.move) if len(row) == 7 else (made.axis, tuple(row))
            self._here = self.instances.setdefault(joined(given.get("NAME", "")), made)
        elif word in ("END PART", "END INSTANCE"):
            self._here = self.root
        elif word == "NODE":
            self._nodes(given)
        elif word == "ELEMENT":
            self._elements(given)
        elif word in ("NSET", "ELSET"):
            self._set(word, given)

    def _nodes(self, given: dict[str, str]) -> None:
        here = self._here
        numbered = here.node_sets.setdefault(joined(given["NSET"]), set()) if "NSET" in given else set[int]()
        for line, text in self._source.filled():
            first, _, rest = text.partition(",")
            x, y, z, *_ = [*numbers(line, rest), 0.0, 0.0, 0.0]
            number = _number(line, first)
            here.points[number] = (x, y, z)
            numbered.add(self._own(number))

    def _elements(self, given: dict[str, str]) -> None:
        here, ids, corners, width = self._here, array("q"), array("q"), 0
        row: list[str] = []
        for line, text in self._source.filled():
            items = fields(text)
            row += [item for item in items if item]
            if not items[-1]:
                continue
            width = width or len(row) - 1
            if len(row) - 1 != width:
                raise InpError(
                    f"line {line}: an element with {len(row) - 1} nodes in a block of elements with {width} nodes"
                )
            ids.append(_number(line, row[0]))
            corners.extend(_number(line, item) for item in row[1:])
            row = []
        here.elements.append((ids, corners, width))
        if "ELSET" in given:
            here.element_sets.setdefault(joined(given["ELSET"]), set()).update(map(self._own, ids))

    def _own(self, number: int) -> int:
        """Returns a number of a node or element of this scope in the form that sets contain."""
        return number

    def _set(self, word: str, given: dict[str, str]) -> None:
        here, kind = self._here, "node_sets" if word == "NSET" else "element_sets"
        made = getattr(here, kind).setdefault(joined(given.get(word, "")), set())
        owner = self.instances.get(joined(given["INSTANCE"])) if "INSTANCE" in given else None
        shift = owner.place << _SHIFT if owner is not None else 0
        for line, text in self._source.filled():
            items = [item for item in fields(text) if item]
            if "GENERATE" in given:
                made.update(shift + n for n in _generated(line, items))
                continue
            for item in items:
                made.update(self._members(line, item, owner, kind))

    def _members(self, line: int, item: str, owner: Scope | None, kind: str) -> Iterator[int]:
        if is_whole(item):
            yield (owner.place << _SHIFT if owner is not None else 0) + int(item)
            return
        if owner is None and (found := getattr(self._here, kind).get(joined(item))) is not None:
            yield from found
            return
        name, _, rest = item.rpartition(".")
        scope = owner or self.instances.get(joined(name))
        if scope is None:
            raise InpError(f"line {line}: {item[:60]!r} is not defined above")
        yield from self.members(scope, rest or item, kind)

    def members(self, scope: Scope, name: str, kind: str) -> Iterator[int]:
        """Yields the members of a set of an instance or of its part; each number contains the index of the instance."""
        if is_whole(name):
            yield (scope.place << _SHIFT) + int(name)
            return
        own = getattr(scope, kind).get(joined(name))
        found = own if own is not None else getattr(self.parts.get(scope.part, scope), kind).get(joined(name), ())
        yield from ((scope.place << _SHIFT) + number for number in found)

    # What others ask --------------------------------------------------------------------------------------------------

    def named(self, name: str, kind: str) -> set[int] | None:
        """Returns the members of a set by its name in a data line: ``Set-1``, ``Bar-1.Set-1``, ``17``, ``Bar-1.17``."""
        if is_whole(name):
            return {int(name)}
        if (found := getattr(self.root, kind).get(joined(name))) is not None:
            return set(found)
        owner, dot, rest = name.rpartition(".")
        scope = self.instances.get(joined(owner))
        if dot and scope is not None:
            return set(self.members(scope, rest, kind))
        for scope in () if self.instances else self.parts.values():
            if (found := getattr(scope, kind).get(joined(name))) is not None:
                return {(scope.place << _SHIFT) + number for number in found}
        return None

    def body(self, scope: str, elset: str) -> tuple[set[int], set[int]]:
        """Returns the elements of a set and the nodes of these elements; the set belongs to an instance, a part or
        neither.
        """
        made = self.instances.get(scope) or self.parts.get(scope) or self.root
        holder = made if made.elements else self.parts.get(made.part, made)
        wanted = made.element_sets.get(elset) or holder.element_sets.get(elset) or set()
        shift = made.place << _SHIFT
        elements, nodes = set[int](), set[int]()
        for ids, corners, width in holder.elements:
            for k, number in enumerate(ids):
                if number in wanted:
                    elements.add(shift + number)
                    nodes.update(shift + corner for corner in corners[k * width : (k + 1) * width])
        return elements, nodes

    def points(self) -> dict[int, Point]:
        """Returns the positions of nodes; the keys are node numbers with the index of the instance."""
        made: dict[int, Point] = dict(self.root.points)
        scopes = self.instances.values() if self.instances else self.parts.values()
        for scope in scopes:
            holder = scope if scope.points else self.parts.get(scope.part, scope)
            for number, point in holder.points.items():
                made[(scope.place << _SHIFT) + number] = _placed(point, scope)
        return made


def _placed(point: Point, scope: Scope) -> Point:
    """Returns a point of a part in its instance: translated, then rotated about an axis (Rodrigues' formula)."""
    moved = [a + b for a, b in zip(point, (*scope.move, 0.0, 0.0, 0.0)[:3], strict=True)]
    if not scope.axis:
        return moved[0], moved[1], moved[2]
    start, end, angle = scope.axis[:3], scope.axis[3:6], math.radians(scope.axis[6])
    along = [b - a for a, b in zip(start, end, strict=True)]
    length = math.hypot(*along) or 1.0
    u, arm = [a / length for a in along], [m - s for m, s in zip(moved, start, strict=True)]
    dot = sum(a * b for a, b in zip(u, arm, strict=True))
    cross = (u[1] * arm[2] - u[2] * arm[1], u[2] * arm[0] - u[0] * arm[2], u[0] * arm[1] - u[1] * arm[0])
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = (start[i] + c * arm[i] + s * cross[i] + (1.0 - c) * dot * u[i] for i in range(3))
    return x, y, z


def _generated(line: int, items: list[str]) -> range:
    if not 2 <= len(items) <= 3:
        raise InpError(f"line {line}: GENERATE needs a first number, a last number and a step")
    first, last, step = (*(_number(line, item) for item in items), 1)[:3]
    if last < first or step < 1 or (last - first) // step > _MOST:
        raise InpError(
            f"line {line}: from {first} to {last} by {step} is not a range, or has more than {_MOST} numbers"
        )
    return range(first, last + 1, step)


def _number(line: int, item: str) -> int:
    if not is_whole(item):
        raise InpError(f"line {line}: {item.strip()[:60]!r} is not a number of a node or element")
    return int(item)
