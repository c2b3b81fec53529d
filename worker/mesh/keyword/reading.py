"""Selection from an LS-DYNA keyword deck: all solid elements, or the elements of a part or a set."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from conoid.cases.reading.cards import CardError

from ...errors import MeshError
from .. import omitted, solid
from ..cells import HEX8, TET4, TET10, Cells, Form, Kind, cells
from ..model import Ids
from ..named import placed, refuse_repeated
from ..sets import Named, surface
from .choosing import DEEPEST, Content
from .deck import Deck, Solids

_KINDS = {4: TET4, 8: HEX8, 10: TET10, 20: Kind(Form.HEXAHEDRON, 20), 27: Kind(Form.HEXAHEDRON, 27)}
"""Kinds of elements; the keys are the numbers of nodes. The first eight nodes of a hexahedron of second order are its
corners."""


def read_keyword(path: Path, group: str | None, key: str) -> solid.Content:
    """Return the solid elements of ``group``, or all solid elements of a deck; also return the sets of nodes and
    segments of the deck.

    ``group`` is a part, a ``*SET_PART`` or a ``*SET_SOLID``, by its title or id. A group that is a number is the id of
    a part, if a part with this id exists. Raises MeshError with the number of the line, if one line has the error.
    """
    try:
        deck = Deck(path)
    except CardError as error:
        raise MeshError(str(error)) from None
    numbers = np.array(deck.nodes, np.int64)
    order = np.argsort(numbers, kind="stable")
    tags, points = numbers[order], np.array(deck.points).reshape(-1, 3)[order]
    refuse_repeated("node", tags)
    every = [_cells(rows, many, tags) for many, rows in deck.solids.items()]
    content = _content(deck, tags, every)
    refuse_repeated("element", content.numbers)
    wanted = np.ones(len(content.numbers), bool) if group is None else content.chosen(group, key)
    ends = np.cumsum([len(each.numbers) for each in every])
    chosen = [each.of(some) for each, some in zip(every, np.split(wanted, ends)[:-1], strict=True)]
    if group is None and deck.volumes:
        name, many = deck.volumes.most_common(1)[0]
        raise MeshError(f"{many} cards of *{name}, whose elements are not read; select another part by group")
    named, remarks = _named(content)
    notes = (*_notes(deck, chosen), *remarks, *omitted.undefined(content.undefined()))
    return solid.Content(tags, points, chosen, named, notes, tuple(deck.files[1:]), deck.length)


def _cells(rows: Solids, many: int, tags: Ids) -> Cells:
    made = cells(_KINDS[many], *(np.array(each, np.int64) for each in (rows.numbers, rows.nodes, rows.lines)))
    return cells(made.kind, made.numbers, placed(tags, made.nodes, made.called), made.lines)


def _content(deck: Deck, tags: Ids, every: list[Cells]) -> Content:
    none = np.zeros(0, np.int64)
    numbers = np.concatenate([none, *(each.numbers for each in every)])
    parts = np.concatenate([none, *(np.array(rows.parts, np.int64) for rows in deck.solids.values())])

    def of_part(wanted: Ids) -> Ids:
        found = [
            tags[each.nodes[np.isin(np.array(rows.parts), wanted)].ravel()]
            for each, rows in zip(every, deck.solids.values(), strict=True)
        ]
        return np.unique(np.concatenate([none, *found]))

    return Content(deck, tags, numbers, parts, of_part)


def _named(content: Content) -> tuple[list[Named], list[str]]:
    """Return the sets of nodes and of segments, each with its title and id. Also return remarks on the sets that cannot
    be read.
    """
    found, remarks = list[Named](), list[str]()
    for kind in ("NODE", "SEGMENT"):
        for number, one in content.deck.sets.found[kind].items():
            names = tuple(filter(None, (one.title, str(number))))
            try:
                if kind == "NODE":
                    nodes = np.searchsorted(content.tags, content.members("NODE", number))
                    found.append(Named(names, np.asarray(nodes, np.int64)))
                else:
                    found.append(surface(names, _segments(content, number)))
            except MeshError as error:
                remarks.append(f"a set is not read: {error}")
    return found, remarks


def _segments(content: Content, number: int, depth: int = 0) -> Iterator[Ids]:
    """Return the faces of a set of segments: one or several arrays of faces with 3 or 4 corners. A fourth node of 0
    repeats the third node.
    """
    one = content.deck.sets.found["SEGMENT"].get(number)
    if one is None or one.unread or depth > DEEPEST:
        why = "is not defined" if one is None else one.unread or "has itself among its members"
        raise MeshError(f"the set {number} of *SET_SEGMENT {why}")
    rows = [numbers for word, numbers in one.steps if word == "SEG"]
    if rows:
        corners = np.array(rows, np.int64).reshape(-1, 4)
        corners[:, 3] = np.where(corners[:, 3] == 0, corners[:, 2], corners[:, 3])
        yield placed(content.tags, corners, lambda k: f"segment {k + 1} of the set {number}")
    for word, numbers in one.steps:
        for other in numbers if word == "SET" else ():
            yield from _segments(content, other, depth + 1)


def _notes(deck: Deck, chosen: list[Cells]) -> Iterator[str]:
    """Return remarks on contents of the deck that are not in the mesh or are interpreted in an unexpected way."""
    yield from omitted.notes(deck.passed, deck.volumes, deck.joining, "*")
    if deck.held:
        yield f"constraints of nodes (TC, RC of *NODE) are ignored: {deck.held} nodes"
    yield from omitted.by_corners(chosen)
    if not deck.ended:
        yield "the deck has no *END: it may be cut off"
