"""Reads the mesh of an Abaqus input file: *NODE, *ELEMENT (C3D4), *ELSET, parts and instances.

A reader of its own, because gmsh writes .inp but does not read it, and meshio ends the process on an element type that
it does not know, does not place instances and cannot say which line is wrong. The file is only text here: nothing in it
makes this reader open another file. Everything that is not mesh (materials, steps, node sets) is passed over.
"""

import math
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from ..turning import sine_and_cosine
from .gmsh_session import NamedMesh, gathered
from .model import Floats, Ids

_REFUSED = ("include", "ngen", "nfill", "ncopy", "elgen", "elcopy", "system", "import")
"""Keywords that make or move nodes and elements in ways that are not followed here."""

_SKIN = ("T3D", "B3", "S3", "S4", "SFM", "M3D", "CPS", "CPE", "CAX", "MASS", "STRI", "DC2", "R3D")
"""Beginnings of the element types that only clothe or line a body."""


@dataclass
class _Card:
    """A keyword line: lower-case name, parameters (lower-case key, text), its line number, and its data lines."""

    name: str
    options: dict[str, str]
    line: int
    data: list[tuple[int, str]] = field(default_factory=list)


@dataclass
class _Set:
    """Element numbers of a set: one by one, as ranges (first, last, step), and by the names of other sets."""

    numbers: list[int] = field(default_factory=list)
    ranges: list[tuple[int, int, int]] = field(default_factory=list)
    others: list[str] = field(default_factory=list)


@dataclass
class _Body:
    """A part, or the nodes, tets and sets that a file or an instance has of its own."""

    nodes: "array[int]" = field(default_factory=lambda: array("q"))
    points: "array[float]" = field(default_factory=lambda: array("d"))
    numbers: "array[int]" = field(default_factory=lambda: array("q"))
    tets: "array[int]" = field(default_factory=lambda: array("q"))
    sets: dict[str, _Set] = field(default_factory=dict)

    def chosen(self, group: str) -> NDArray[np.bool_]:
        """Which tets belong to a set; all names are lower case."""
        numbers, mask = np.array(self.numbers, np.int64), np.zeros(len(self.numbers), bool)
        waiting, seen = [group], set[str]()
        while waiting:
            name = waiting.pop()
            if name in seen or name not in self.sets:
                continue
            seen.add(name)
            one = self.sets[name]
            mask |= np.isin(numbers, one.numbers)
            for first, last, step in one.ranges:
                mask |= (numbers >= first) & (numbers <= last) & ((numbers - first) % step == 0)
            waiting += one.others
        return mask


@dataclass
class _Instance:
    """A part in its place: ``body`` turned and moved as ``lines`` say."""

    name: str
    body: _Body
    lines: list[tuple[int, str]]

    def points(self) -> Floats:
        """(n, 3) in the file's unit: first moved by the first line, then turned about the axis of the second."""
        points = np.array(self.body.points, np.float64).reshape(-1, 3)
        if self.lines:
            points = points + _numbers(*self.lines[0], 3)[:3]
        if len(self.lines) > 1:
            line = np.array(_numbers(*self.lines[1], 7))
            points = _turned(points, line[:3], line[3:6], float(line[6]))
        return points


def read_inp(path: Path, group: str | None, key: str) -> NamedMesh:
    """The tets of an .inp file, all or those of the element set or instance ``group``, in the file's unit.

    Raises MeshError, with the line number, for what cannot be read. Node and tet names are the numbers in the file.
    """
    deck = _Deck()
    with path.open("rb") as file:
        for card in _cards(line.decode("utf-8", "replace") for line in file):
            deck.take(card)
    return _assembled(deck, group, key)


def _cards(lines: Iterator[str]) -> Iterator[_Card]:
    card: _Card | None = None
    for number, text in enumerate(lines, 1):
        line = text.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*"):
            if card is not None:
                yield card
            name, *options = (item.strip() for item in line[1:].split(","))
            pairs = (option.partition("=") for option in options if option)
            card = _Card(name.lower(), {k.strip().lower(): v.strip().strip('"') for k, _, v in pairs}, number)
        elif card is None:
            raise MeshError(f"line {number}: data before the first keyword; this is not an .inp file")
        else:
            card.data.append((number, line))
    if card is None:
        raise MeshError("the file has no keyword; this is not an .inp file")
    yield card


class _Deck:
    """What the cards so far have said."""

    def __init__(self) -> None:
        self.flat = _Body()
        self.parts: dict[str, _Body] = {}
        self.instances: list[_Instance] = []
        self.here = self.flat
        self.placed = self.flat

    def take(self, card: _Card) -> None:
        """Adds one card. MeshError when it is wrong, or of a kind that would change the mesh unseen."""
        if card.name in _REFUSED or "input" in card.options:
            word = f"*{card.name.upper()}" + (", INPUT" if "input" in card.options else "")
            raise MeshError(f"line {card.line}: {word} is not followed; write the nodes and elements out")
        reader = _READERS.get(card.name)
        if reader is not None:
            reader(self, card)

    def _part(self, card: _Card) -> None:
        self.here = self.parts.setdefault(_option(card, "name").lower(), _Body())

    def _end_part(self, card: _Card) -> None:
        self.here = self.flat

    def _instance(self, card: _Card) -> None:
        name, part = _option(card, "name"), _option(card, "part").lower()
        if part not in self.parts:
            known = ", ".join(self.parts) or "none"
            raise MeshError(f"line {card.line}: instance {name!r} of the unknown part {part!r}; known: {known}")
        self.here = _Body()
        self.instances.append(_Instance(name, self.here, card.data))
        self.placed = self.parts[part]

    def _end_instance(self, card: _Card) -> None:
        """An independent instance brings its own mesh, any other has that of its part."""
        if self.instances and not self.instances[-1].body.nodes:
            part = self.placed
            sets = {**part.sets, **self.here.sets}
            self.instances[-1].body = _Body(part.nodes, part.points, part.numbers, part.tets, sets)
        self.here = self.flat

    def _node(self, card: _Card) -> None:
        if "system" in card.options and card.options["system"].upper() != "R":
            raise MeshError(
                f"line {card.line}: *NODE, SYSTEM={card.options['system']} is not read; only Cartesian nodes"
            )
        for number, text in card.data:
            values = _numbers(number, text, 4)
            self.here.nodes.append(_whole(number, values[0]))
            self.here.points.extend(values[1:4])

    def _element(self, card: _Card) -> None:
        kind = _option(card, "type").upper()
        if not kind.startswith("C3D4"):
            if kind.startswith(_SKIN):
                return
            raise MeshError(f"line {card.line}: elements of the type {kind}; only C3D4, 4-node tets, can be used")
        for number, text in card.data:
            values = [_whole(number, value) for value in _numbers(number, text, 5)]
            self.here.numbers.append(values[0])
            self.here.tets.extend(values[1:5])
        if "elset" in card.options:
            named = self.here.sets.setdefault(card.options["elset"].lower(), _Set())
            named.numbers += self.here.numbers[len(self.here.numbers) - len(card.data) :]

    def _elset(self, card: _Card) -> None:
        name, instance = _option(card, "elset").lower(), card.options.get("instance")
        here = self.here
        if instance is not None:
            places = [one.body for one in self.instances if one.name.lower() == instance.lower()]
            if not places:
                raise MeshError(f"line {card.line}: *ELSET of the unknown instance {instance!r}")
            here = places[0]
        _fill(here.sets.setdefault(name, _Set()), card)


_READERS: dict[str, Callable[[_Deck, _Card], None]] = {
    "part": _Deck._part,
    "end part": _Deck._end_part,
    "instance": _Deck._instance,
    "end instance": _Deck._end_instance,
    "node": _Deck._node,
    "element": _Deck._element,
    "elset": _Deck._elset,
}


def _fill(one: _Set, card: _Card) -> None:
    for number, text in card.data:
        items = [item.strip() for item in text.split(",") if item.strip()]
        if "generate" in card.options:
            first, last, *step = (_whole(number, value) for value in _numbers(number, text, 2))
            one.ranges.append((first, last, max(1, step[0]) if step else 1))
            continue
        one.numbers += [int(item) for item in items if item.isdigit()]
        one.others += [item.strip('"').lower() for item in items if not item.isdigit()]


def _assembled(deck: _Deck, group: str | None, key: str) -> NamedMesh:
    bodies = deck.instances or [_Instance(name, body, []) for name, body in deck.parts.items()]
    pieces = [_Instance("", deck.flat, []), *bodies] if deck.flat.nodes else bodies
    wanted, nodes, points, numbers, corners, first = (group or "").lower(), [], [], [], [], 0
    known = {one.name for one in pieces if one.name}.union(*(one.body.sets for one in pieces))
    if group is not None and wanted not in {name.lower() for name in known}:
        raise MeshError(f"{key}.group = {group!r}: no such element set; known: {', '.join(sorted(known)) or 'none'}")
    for piece in pieces:
        body = piece.body
        keep = np.ones(len(body.numbers), bool)
        if group is not None and piece.name.lower() != wanted:
            keep = body.chosen(wanted)
        tags = np.array(body.nodes, np.int64)
        nodes.append(tags)
        points.append(piece.points())
        numbers.append(np.array(body.numbers, np.int64)[keep])
        corners.append(_placed(tags, np.array(body.tets, np.int64).reshape(-1, 4)[keep], numbers[-1]) + first)
        first += len(tags)
    if not nodes:
        raise MeshError("the file has no nodes")
    found = gathered(np.arange(first), np.concatenate(points), np.concatenate(numbers), np.concatenate(corners))
    return _renamed(found, np.concatenate(nodes))


def _placed(tags: Ids, corners: Ids, numbers: Ids) -> Ids:
    """Node numbers of the file as places in ``tags``."""
    unique, place = np.unique(tags, return_index=True)
    if len(unique) < len(tags):
        again = np.setdiff1d(np.arange(len(tags)), place)[0]
        raise MeshError(f"node {tags[again]} is defined twice")
    found = np.searchsorted(unique, corners)
    good = found < len(unique)
    good[good] = unique[found[good]] == corners[good]
    if not good.all():
        tet = np.flatnonzero(~good.all(axis=1))[0]
        raise MeshError(f"tet {numbers[tet]} uses node {corners[tet][~good[tet]][0]}, which is not defined")
    return np.asarray(place[found], np.int64)


def _renamed(found: NamedMesh, nodes: Ids) -> NamedMesh:
    names = type(found.names)(nodes[found.names.nodes], found.names.tets)
    return NamedMesh(found.mesh, names)


def _option(card: _Card, name: str) -> str:
    if not card.options.get(name):
        raise MeshError(f"line {card.line}: *{card.name.upper()} needs {name.upper()}=")
    return card.options[name]


def _numbers(line: int, text: str, least: int) -> list[float]:
    try:
        values = [float(item) for item in text.rstrip(", ").split(",")]
    except ValueError:
        raise MeshError(f"line {line}: {text[:60]!r} is not a list of numbers") from None
    if len(values) < least:
        raise MeshError(f"line {line}: expected {least} numbers, found {len(values)}")
    return values


def _whole(line: int, value: float) -> int:
    if not value.is_integer() or not 0 <= value < 2**53:
        raise MeshError(f"line {line}: {value:g} is not a number of a node or element")
    return int(value)


def _turned(points: Floats, start: Floats, end: Floats, degrees: float) -> Floats:
    """Points turned by ``degrees`` about the line from ``start`` to ``end`` (Rodrigues)."""
    axis, arm = (end - start) / math.sqrt(((end - start) ** 2).sum()), points - start
    sine, cosine = sine_and_cosine(math.radians(degrees))
    along = (arm * axis).sum(axis=1)[:, None] * axis
    turned: Floats = start + along + cosine * (arm - along) + sine * np.cross(axis, arm)
    return turned
