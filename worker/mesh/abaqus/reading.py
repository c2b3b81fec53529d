"""The mesh that a case takes from an Abaqus input file: all of its tets, or those of a set, an instance or a part."""

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from conoid.cases.inp import InpError

from ...errors import MeshError
from ...turning import sine_and_cosine
from ..model import Floats, Ids, Names
from ..named import NamedMesh, gathered
from .choosing import Chosen, everything, grouped
from .deck import Deck
from .elements import ElementType, Kind
from .keywords import JOINING
from .scopes import Piece, Scope


def read_inp(path: Path, group: str | None, key: str) -> NamedMesh:
    """The tets of an .inp file, all or those that ``group`` names, in the unit of the file.

    ``group`` is an element set of the model or of the assembly, ``Bar-1.Set-1`` (a set of an instance or of a part), an
    instance, a part, or a set that one part alone has. Raises MeshError, with the number of the line where there is
    one. Node and tet names are the numbers in the file.
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
    found = _taken(pieces, chosen)
    return NamedMesh(found.mesh, found.names, found.places, tuple(_notes(deck, pieces, group)))


def _pieces(deck: Deck) -> Iterator[Piece]:
    """What stands in the model. A file without instances has each part where it is."""
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
    """Points turned about a line (Rodrigues)."""
    start, end = np.array(axis[:3]), np.array(axis[3:6])
    along, arm = (end - start) / math.sqrt(((end - start) ** 2).sum()), points - start
    sine, cosine = sine_and_cosine(math.radians(axis[6]))
    straight = (arm * along).sum(axis=1)[:, None] * along
    turned: Floats = start + straight + cosine * (arm - straight) + sine * np.cross(along, arm)
    return turned


# What is taken --------------------------------------------------------------------------------------------------------


def _refuse_volumes(pieces: list[Piece], chosen: Chosen) -> None:
    """MeshError where elements are chosen that have a volume and are no tets."""
    for place, wanted in chosen.items():
        for kind, numbers in pieces[place].mesh.others.items():
            if kind.kind is Kind.EMPTY:
                continue
            among = np.intersect1d(np.array(numbers, np.int64), wanted)
            if len(among):
                strange = ", a type that is not known" if kind.kind is Kind.UNKNOWN else ""
                raise MeshError(
                    f"{len(among)} elements of the type {kind.name}{strange} (the first is {among[0]}); only C3D4, "
                    "4-node tets, can be used"
                )


def _taken(pieces: list[Piece], chosen: Chosen) -> NamedMesh:
    nodes, points, numbers, corners, first = [], [], [], [], 0
    for place, piece in enumerate(pieces):
        keep = np.isin(piece.numbers, chosen.get(place, np.zeros(0, np.int64)))
        tags = np.array(piece.mesh.nodes, np.int64)
        nodes.append(tags)
        points.append(piece.points)
        numbers.append(piece.numbers[keep])
        corners.append(_placed(tags, np.array(piece.mesh.corners, np.int64).reshape(-1, 4)[keep], numbers[-1]) + first)
        first += len(tags)
    found = gathered(np.arange(first), np.concatenate(points), np.concatenate(numbers), np.concatenate(corners))
    names = Names(np.concatenate(nodes)[found.places], found.names.tets)
    return NamedMesh(found.mesh, names, found.places)


def _placed(tags: Ids, corners: Ids, numbers: Ids) -> Ids:
    """Node numbers of the file as places in ``tags``."""
    order = np.argsort(tags, kind="stable")
    found = np.searchsorted(tags, corners, sorter=order)
    good: NDArray[np.bool_] = found < len(tags)
    good[good] = tags[order[found[good]]] == corners[good]
    if not good.all():
        tet = np.flatnonzero(~good.all(axis=1))[0]
        raise MeshError(f"tet {numbers[tet]} uses node {corners[tet][~good[tet]][0]}, which is not defined")
    return np.asarray(order[found], np.int64)


def _notes(deck: Deck, pieces: list[Piece], group: str | None) -> Iterator[str]:
    """What of the file is not in the mesh, in a line each."""
    scopes = {id(scope): scope for scope in (deck.root, *(part for _, part in deck.parts))}
    scopes |= {id(piece.mesh): piece.mesh for piece in pieces}
    counts: Counter[ElementType] = Counter()
    for scope in scopes.values():
        counts.update({kind: len(numbers) for kind, numbers in scope.others.items()})
    if empty := _counted(counts, Kind.EMPTY):
        yield f"elements that carry no volume are skipped: {empty}"
    if solid := ", ".join(filter(None, (_counted(counts, kind) for kind in (Kind.VOLUME, Kind.UNKNOWN)))):
        yield f"elements that are no 4-node tets are outside of the group: {solid}"
    if deck.joining:
        words = ", ".join(f"{n} *{JOINING[word]}" for word, n in sorted(deck.joining.items()))
        yield f"keywords that join, hold or remove bodies are passed over: {words}"
    placed = {id(piece.mesh) for piece in pieces}
    left = [part for _, part in deck.parts if id(part) not in placed and part.tets]
    if left:
        names = ", ".join(f"{part.name.text!r} ({len(part.tets)} tets)" for part in left)
        yield f"parts without an instance are left out: {names}"
    hidden = (
        []
        if group is None or not deck.root.sets.meant(group)
        else [part.name.text for _, part in deck.parts if part.sets.meant(group)]
    )
    if hidden:
        yield f"the set {group!r} is that of the assembly; another one is {hidden[0]}.{group}"


def _counted(counts: "Counter[ElementType]", kind: Kind) -> str:
    """``12 S6, 1 CONN3D2``."""
    return ", ".join(f"{n} {each.name}" for each, n in sorted(counts.items(), key=_by_name) if each.kind is kind)


def _by_name(entry: tuple[ElementType, int]) -> str:
    return entry[0].name
