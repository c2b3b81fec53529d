"""Selection from an Abaqus input file: all elements of the file, or the elements of a set, an instance or a part."""

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from conoid.cases.reading.inp import InpError

from ...errors import MeshError
from ...materials.turning import sine_and_cosine
from ..model import Floats, Ids
from ..solid import Content
from .choosing import Chosen, everything, grouped
from .deck import Deck
from .elements import ElementType, Kind
from .keywords import JOINING
from .named_sets import named_sets
from .placed import Placed, Tags
from .scopes import Piece, Scope


def read_inp(path: Path, group: str | None, key: str) -> Content:
    """Return the elements of ``group`` in an .inp file, or all elements, in the unit of the file; also return the sets
    of the file.

    ``group`` is an element set of the model or of the assembly, ``Bar-1.Set-1`` (a set of an instance or of a part), an
    instance, a part, or a set that exactly one part has. Nodes and elements have the numbers of the file. Raises
    MeshError with the number of the line, if one line has the error.
    """
    try:
        deck = Deck(path)
    except InpError as error:
        raise MeshError(str(error)) from None
    pieces = list(_pieces(deck))
    if not any(piece.mesh.nodes for piece in pieces):
        raise MeshError("the file has no nodes")
    for piece in pieces:
        piece.mesh.check(f" in {piece.mesh.name.text!r}" if piece.mesh.line else "")
    chosen = everything(pieces) if group is None else grouped(deck, pieces, group, key)
    _refuse_volumes(pieces, chosen)
    tags, points, places = _nodes(pieces)
    model = Placed(deck, pieces, places)
    every = [each for place, numbers in chosen.items() for each in model.solids(place, numbers)]
    named, remarks = named_sets(model)
    return Content(tags, points, every, named, (*_notes(deck, pieces, group), *remarks), tuple(deck.files[1:]))


def _nodes(pieces: list[Piece]) -> tuple[Ids, Floats, list[Tags]]:
    """Return the nodes of all pieces of the model and their positions. The nodes of a piece are ordered by their
    numbers.
    """
    tags, points, places, first = [], [], list[Tags](), 0
    for piece in pieces:
        numbers = np.array(piece.mesh.nodes, np.int64)
        order = np.argsort(numbers, kind="stable")
        tags.append(numbers[order])
        points.append(piece.points[order])
        places.append(Tags(numbers[order], first))
        first += len(order)
    return np.concatenate(tags), np.concatenate(points), places


def _pieces(deck: Deck) -> Iterator[Piece]:
    """Return the pieces of the model. In a file without instances each part is a piece of the model."""
    if not deck.root.empty:
        yield Piece(deck.root, deck.root, _points(deck.root))
    for _, part in deck.parts if not list(deck.instances) else ():
        yield Piece(part, part, _points(part))
    for _, instance in deck.instances:
        points = _points(instance.mesh) + np.array(instance.move)
        yield Piece(instance, instance.mesh, _turned(points, instance.axis) if instance.axis else points)


def _points(scope: Scope) -> Floats:
    return np.array(scope.points, np.float64).reshape(-1, 3)


def _turned(points: Floats, axis: tuple[float, ...]) -> Floats:
    """Return points rotated about a line (formula of Rodrigues)."""
    start, end = np.array(axis[:3]), np.array(axis[3:6])
    along, arm = (end - start) / math.sqrt(((end - start) ** 2).sum()), points - start
    sine, cosine = sine_and_cosine(math.radians(axis[6]))
    straight = (arm * along).sum(axis=1)[:, None] * along
    turned: Floats = start + straight + cosine * (arm - straight) + sine * np.cross(along, arm)
    return turned


# Selection ------------------------------------------------------------------------------------------------------------


def _refuse_volumes(pieces: list[Piece], chosen: Chosen) -> None:
    """Raise MeshError if the chosen volume elements include an element that cannot be cut into tets."""
    for place, wanted in chosen.items():
        for kind, numbers in pieces[place].mesh.others.items():
            if kind.kind is Kind.EMPTY:
                continue
            among = np.intersect1d(np.array(numbers, np.int64), wanted)
            if len(among):
                strange = ", a type that is not known" if kind.kind is Kind.UNKNOWN else ""
                raise MeshError(
                    f"{len(among)} elements of the type {kind.name}{strange} (the first is {among[0]}); elements with "
                    "a volume can be C3D4, C3D5, C3D6, C3D8, C3D10, C3D15, C3D20 and their variants"
                )


def _notes(deck: Deck, pieces: list[Piece], group: str | None) -> Iterator[str]:
    """Return remarks on contents of the file that are not in the mesh."""
    scopes = {id(scope): scope for scope in (deck.root, *(part for _, part in deck.parts))}
    scopes |= {id(piece.mesh): piece.mesh for piece in pieces}
    counts: Counter[ElementType] = Counter()
    for scope in scopes.values():
        counts.update({kind: len(numbers) for kind, numbers in scope.others.items()})
    if empty := _counted(counts, Kind.EMPTY):
        yield f"elements that carry no volume are skipped: {empty}"
    if solid := ", ".join(filter(None, (_counted(counts, kind) for kind in (Kind.VOLUME, Kind.UNKNOWN)))):
        yield f"elements that cannot be read are outside of the group: {solid}"
    if deck.joining:
        words = ", ".join(f"{n} *{JOINING[word]}" for word, n in sorted(deck.joining.items()))
        yield f"keywords that join, hold or remove bodies are ignored: {words}"
    if deck.unread:
        yield f"surfaces that are not lists of elements or nodes are not read: {', '.join(map(repr, deck.unread))}"
    placed = {id(piece.mesh) for piece in pieces}
    left = [part for _, part in deck.parts if id(part) not in placed and part.volumes]
    if left:
        names = ", ".join(f"{part.name.text!r} ({part.volumes} elements)" for part in left)
        yield f"parts without an instance are left out: {names}"
    hidden = (
        []
        if group is None or not deck.root.sets.meant(group)
        else [part.name.text for _, part in deck.parts if part.sets.meant(group)]
    )
    if hidden:
        yield f"the set {group!r} is that of the assembly; another one is {hidden[0]}.{group}"


def _counted(counts: "Counter[ElementType]", kind: Kind) -> str:
    """Return the counts of the element types as text: ``12 S6, 1 CONN3D2``."""
    return ", ".join(f"{n} {each.name}" for each, n in sorted(counts.items(), key=_by_name) if each.kind is kind)


def _by_name(entry: tuple[ElementType, int]) -> str:
    return entry[0].name
