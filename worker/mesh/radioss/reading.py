"""Selection from a Radioss starter deck: all volume elements, or the elements of a part or a subset."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import MeshError
from .. import omitted
from ..cells import HEX8, TET4, TET10, WEDGE6, Cells, Form, Kind, cells, sides
from ..model import Ids
from ..named import placed, refuse_repeated
from ..sets import Named, surface
from ..solid import Content
from .deck import KNOWN, Deck, Group

_KINDS = {"BRICK": HEX8, "TETRA4": TET4, "TETRA10": TET10, "PENTA6": WEDGE6, "BRIC20": Kind(Form.HEXAHEDRON, 20)}
_DEEPEST = 20
"""Largest depth of groups within groups, and of subsets within subsets. Chosen value: above the five levels that decks
have."""


def read_radioss(path: Path, group: str | None, key: str) -> Content:
    """Return the volume elements of ``group``, or all volume elements of a starter deck. The groups of nodes and the
    surfaces of the deck are returned as sets.

    ``group`` is a part, or a subset with its inner subsets, by title or number. A group that is a number is the number
    of a part, if a part with this number exists. Raises MeshError with the number of the line, if one line has the
    error.
    """
    deck = Deck(path)
    numbers = np.array(deck.nodes, np.int64)
    order = np.argsort(numbers, kind="stable")
    reader = _Reader(deck, numbers[order])
    refuse_repeated("node", reader.tags)
    refuse_repeated("element", np.concatenate([_NONE, *(each.numbers for each in reader.cells)]))
    wanted = None if group is None else reader.parts(group, key)
    chosen = [each.of(np.isin(of, wanted)) if wanted is not None else each for each, of in reader.both()]
    if group is None and deck.volumes:
        word, many = deck.volumes.most_common(1)[0]
        raise MeshError(f"{many} lines of /{word}, whose elements are not read; select another part by group")
    named, remarks = reader.named()
    points = np.array(deck.points).reshape(-1, 3)[order]
    notes = (*_notes(deck, chosen), *remarks, *omitted.undefined(reader.lost))
    return Content(reader.tags, points, chosen, named, notes, tuple(deck.included.files[1:]), deck.length)


_NONE = np.zeros(0, np.int64)


class _Reader:
    """Arrays of a deck, and the contents of its groups."""

    def __init__(self, deck: Deck, tags: Ids) -> None:
        self.deck, self.tags = deck, tags
        self.cells = [self._cells(word) for word in deck.solids]
        self.of = [np.array(rows.parts, np.int64) for rows in deck.solids.values()]
        self.lost = dict[str, Ids]()
        """Undefined nodes in groups of nodes; the keys are the groups."""

    def _cells(self, word: str) -> Cells:
        rows = self.deck.solids[word]
        arrays = (np.array(each, np.int64) for each in (rows.numbers, rows.nodes, rows.lines))
        made = cells(_KINDS[word], *arrays)
        return cells(made.kind, made.numbers, placed(self.tags, made.nodes, made.called), made.lines)

    def both(self) -> Iterator[tuple[Cells, Ids]]:
        """Return the nodes of the elements, and the part of each element."""
        return zip(self.cells, self.of, strict=True)

    def parts(self, group: str, key: str) -> Ids:
        """Return the parts to which the name ``group`` refers. Raises MeshError if the name is unknown or ambiguous."""
        word, colon, name = group.partition(":")
        kinds = [word] if colon and word in ("part", "subset") else ["part", "subset"]
        name = name if len(kinds) == 1 and colon else group
        found = [each for kind in kinds for each in self._called(kind, name)]
        if name.isdecimal() and found:
            found = found[:1]
        if not found:
            known = [title or str(n) for n, title in self.deck.titles.items()]
            known += [f"subset:{title or n}" for n, (title, _) in self.deck.subsets.items()]
            raise MeshError(f"{key}.group = {group!r}: no such part or subset; known: {', '.join(known) or 'none'}")
        if any(set(each) != set(found[0]) for each in found[1:]):
            way = f"write 'part:{name}' or 'subset:{name}', or its number"
            raise MeshError(f"{key}.group = {group!r}: several different parts or subsets have this title; {way}")
        return np.array(sorted(found[0]), np.int64)

    def _called(self, kind: str, name: str) -> list[set[int]]:
        if kind == "part":
            known = {int(each): "" for of in self.of for each in np.unique(of)} | self.deck.titles
            return [{number} for number in _named(known, name)]
        titles = {number: title for number, (title, _) in self.deck.subsets.items()}
        return [self.within(number) for number in _named(titles, name)]

    def within(self, subset: int, depth: int = 0) -> set[int]:
        """Return the parts of a subset and of all subsets inside of it. Raises MeshError."""
        if subset not in self.deck.subsets or depth > _DEEPEST:
            raise MeshError(f"the subset {subset} {'is not defined' if depth <= _DEEPEST else 'contains itself'}")
        own = {part for part, of in self.deck.subset_of.items() if of == subset}
        return own.union(*(self.within(each, depth + 1) for each in self.deck.subsets[subset][1]))

    def named(self) -> tuple[list[Named], list[str]]:
        """Return the groups of nodes and the surfaces, and remarks on those groups and surfaces that cannot be read."""
        found, remarks = list[Named](), list[str]()
        for (word, number), group in self.deck.groups.items():
            names = tuple(filter(None, (group.title, str(number))))
            try:
                if word == "GRNOD":
                    found.append(Named(names, self._nodes(number)))
                else:
                    found.append(surface(names, self._faces(number), free="SEG" not in group.kind))
            except MeshError as error:
                remarks.append(f"a group is not read: {error}")
        return found, remarks

    def _group(self, word: str, number: int, depth: int) -> Group:
        group = self.deck.groups.get((word, number))
        if group is None or depth > _DEEPEST:
            raise MeshError(f"/{word} {number} {'is not defined' if group is None else 'contains itself'}")
        if group.kind not in KNOWN:
            raise MeshError(f"/{group.kind}/{number} is a kind that is not supported")
        return group

    def _nodes(self, number: int, depth: int = 0) -> Ids:
        """Return the indices of the nodes of a group; a negative number removes a node."""
        group, found = self._group("GRNOD", number, depth), np.zeros(len(self.tags), bool)
        for _, row in group.rows:
            if group.kind == "GRNOD/GENE":
                for first, last in zip(row[::2], row[1::2], strict=False):
                    found |= (self.tags >= first) & (self.tags <= last) & (first > 0)
                continue
            if group.kind in ("GRNOD/NODE", "GRNOD/NODENS"):
                name = f"/GRNOD {group.title or number}"
                some = np.setdiff1d(np.abs(row), np.append(self.tags, 0))
                self.lost[name] = np.union1d(self.lost.get(name, _NONE), some)
            for each in filter(None, row):
                found[self._some(group.kind.partition("/")[2], abs(each), depth)] = each > 0
        return np.flatnonzero(found).astype(np.int64)

    def _some(self, kind: str, number: int, depth: int) -> Ids:
        if kind in ("NODE", "NODENS"):
            return np.flatnonzero(self.tags == number)
        if kind == "GRNOD":
            return self._nodes(number, depth + 1)
        if kind == "SURF":
            return np.concatenate([_NONE, *(each.ravel() for each in self._faces(number, depth + 1))])
        parts = sorted({number} if kind == "PART" else self.within(number))
        return np.concatenate([_NONE, *(each.nodes[np.isin(of, parts)].ravel() for each, of in self.both())])

    def _faces(self, number: int, depth: int = 0) -> list[Ids]:
        """Return corners (n, 3) and (n, 4) of the faces of a surface. A surface that is defined by parts has all faces
        of their elements.
        """
        group, found = self._group("SURF", number, depth), list[Ids]()
        if group.kind == "SURF/SEG":
            rows = [(line, [*row[1:], 0, 0, 0, 0][:4]) for line, row in group.rows]
            corners = np.array([row for _, row in rows], np.int64).reshape(-1, 4)
            corners[:, 3] = np.where(corners[:, 3] == 0, corners[:, 2], corners[:, 3])
            return [placed(self.tags, corners, lambda k: f"line {rows[k][0]}: a segment")]
        for each in (each for _, row in group.rows for each in row if each):
            if each < 0:
                raise MeshError(f"/{group.kind}/{number} removes a part, which is not supported")
            if group.kind == "SURF/SURF":
                found += self._faces(each, depth + 1)
                continue
            parts = sorted({each} if "PART" in group.kind else self.within(each))
            for some, of in self.both():
                chosen = some.corners[np.isin(of, parts)]
                found += [chosen[:, side] for side in sides(some.kind.form)]
        return found


def _named(titles: dict[int, str], name: str) -> list[int]:
    exact = [number for number in titles if str(number) == name]
    exact = exact or [number for number, title in titles.items() if title == name]
    return exact or [number for number, title in titles.items() if title.casefold() == name.casefold()]


def _notes(deck: Deck, chosen: list[Cells]) -> Iterator[str]:
    """Return remarks on contents of the deck that are not in the mesh, or that the reader interprets in an unexpected
    way.
    """
    yield from omitted.notes(deck.passed, deck.volumes, deck.joining, "/")
    yield from omitted.by_corners(chosen)
