"""Elements of an Abaqus input file in their position in the model, with global indices of their nodes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...errors import MeshError
from ..cells import Cells, Form, cells
from ..model import Ids
from ..named import placed
from .deck import Deck
from .elements import FACES, FORMS, ElementType
from .scopes import Piece


@dataclass(frozen=True, eq=False)
class Tags:
    """Nodes of a piece of the model: their numbers, ascending, and the index of its first node among all nodes."""

    numbers: Ids
    first: int


@dataclass(frozen=True, eq=False)
class Placed:
    """The pieces of a model, and the indices of their nodes among all nodes of the model."""

    deck: Deck
    pieces: list[Piece]
    tags: list[Tags]

    def solids(self, place: int, wanted: Ids | None = None) -> Iterator[Cells]:
        """Return the volume elements of a piece: the elements with the numbers ``wanted``, or all elements. Raises
        MeshError.
        """
        tags = self.tags[place]
        for kind, rows in self.pieces[place].mesh.solids.items():
            made = cells(FORMS[kind.nodes or 0], _ids(rows.numbers), _ids(rows.nodes), _ids(rows.lines))
            made = made if wanted is None else made.of(np.isin(made.numbers, wanted))
            if len(made.numbers):
                nodes = placed(tags.numbers, made.nodes, made.called) + tags.first
                yield cells(made.kind, made.numbers, nodes, made.lines)

    def faces(self, place: int, wanted: Ids, side: str) -> Iterator[Ids]:
        """Return the corners (n, 3) or (n, 4) of the faces ``side`` of elements, such as ``S3``. If ``side`` is empty,
        return all faces.

        The face of a surface element is the element itself. Raises MeshError for a face that an element does not have.
        """
        for each in self.solids(place, wanted):
            known = FACES[each.kind.form]
            for face in known if not side else (known[_number(side, each.kind.form)],):
                yield each.corners[:, face]
        yield from self.plates(place, wanted)

    def plates(self, place: int, wanted: Ids | None = None) -> Iterator[Ids]:
        """Return the corners of the surface elements of a piece."""
        tags = self.tags[place]
        for kind, rows in self.pieces[place].mesh.plates.items():
            numbers, nodes = _ids(rows.numbers), _ids(rows.nodes).reshape(-1, kind.corners or 1)
            chosen = np.ones(len(numbers), bool) if wanted is None else np.isin(numbers, wanted)
            yield placed(tags.numbers, nodes[chosen], _called(kind, numbers[chosen])) + tags.first

    def nodes(self, place: int, numbers: Ids) -> Ids:
        """Return the indices of the nodes ``numbers`` of a piece. Undefined nodes are omitted."""
        tags = self.tags[place]
        there = tags.numbers[np.isin(tags.numbers, numbers)]
        return np.asarray(np.searchsorted(tags.numbers, there) + tags.first, np.int64)

    def undefined(self, place: int, numbers: Ids) -> Ids:
        """Return those ``numbers`` that no node of a piece has."""
        return np.setdiff1d(numbers, self.tags[place].numbers)


def _called(kind: ElementType, numbers: Ids) -> Callable[[int], str]:
    return lambda k: f"{kind.name} {numbers[k]}"


def _number(side: str, form: Form) -> int:
    found = side[1:]
    if side[:1] != "S" or not found.isdigit() or not 0 < int(found) <= len(FACES[form]):
        raise MeshError(f"a {form.word} has no face {side!r}")
    return int(found) - 1


def _ids(numbers: object) -> Ids:
    return np.array(numbers, np.int64)
