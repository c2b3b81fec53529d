"""Selection of the elements of an Abaqus input file by a name in a case."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ...errors import MeshError
from ..model import Ids
from .deck import Deck
from .labels import label
from .scopes import OWN, ElementSet, Instance, Piece, Scope

Chosen = dict[int, Ids]
"""Sorted numbers of the chosen elements, for each piece of the model."""


def everything(pieces: list[Piece]) -> Chosen:
    """Return all elements of the file."""
    return {place: _every(piece.mesh) for place, piece in enumerate(pieces)}


def _every(mesh: Scope) -> Ids:
    return np.sort(mesh.numbers())


def grouped(deck: Deck, pieces: list[Piece], group: str, key: str) -> Chosen:
    """Return the elements to which the name ``group`` refers. Raises MeshError if the name is unknown or ambiguous."""
    meant = list(_meant(deck, pieces, group))
    if not meant:
        known = ", ".join(sorted(_known(deck, pieces), key=str.casefold)) or "none"
        raise MeshError(f"{key}.group = {group!r}: no such element set, instance or part; known: {known}")
    what, chosen = meant[0]
    for other, again in meant[1:]:
        if not _same(chosen, again):
            raise MeshError(
                f"{key}.group = {group!r}: may be {what} or {other}, which differ; write OWNER.SET, where OWNER "
                "is the part or instance of the set"
            )
    return chosen


def _meant(deck: Deck, pieces: list[Piece], group: str) -> Iterator[tuple[str, Chosen]]:
    """Return the candidates for a name. As in Abaqus, a set of the model or of the assembly hides the sets of parts
    with an equal name.
    """
    outer = [(name.text, one) for name, one in deck.root.sets.meant(group)]
    for text, one in outer:
        yield (
            f"the set {text!r}" + (" of the assembly" if deck.instances else ""),
            _members(pieces, deck.root, one, text),
        )
    for place, piece in enumerate(pieces):
        if piece.scope.line and _called(piece.scope, group):
            yield _of(piece.scope), {place: _every(piece.mesh)}
    for name, _ in deck.parts.meant(group) if list(deck.instances) else []:
        places = [i for i, piece in enumerate(pieces) if _part(piece.scope).name.key == name.key]
        if places:
            yield f"the part {name.text!r}", {place: _every(pieces[place].mesh) for place in places}
    owner, dot, inner = group.rpartition(".")
    by_part: dict[str, Chosen] = {}
    for place, piece in enumerate(pieces):
        scope = piece.scope
        if not scope.line:
            continue
        called = dot and (_called(scope, owner) or _called(_part(scope), owner))
        for text, one in _sets(scope, inner) if called else []:
            by_part.setdefault(f"the set {text!r} of {owner!r}", {}).update(_members([piece], scope, one, text, place))
        for text, one in _sets(scope, group) if not outer else []:
            where = f"the set {text!r} of {_of(_part(scope))}"
            by_part.setdefault(where, {}).update(_members([piece], scope, one, text, place))
    yield from by_part.items()


def _called(scope: Scope, wanted: str) -> bool:
    return scope.name.key.casefold() in (wanted.casefold(), label(wanted).key.casefold())


def _of(scope: Scope) -> str:
    return f"the {'instance' if isinstance(scope, Instance) else 'part'} {scope.name.text!r}"


def _part(scope: Scope) -> Scope:
    return scope.part if isinstance(scope, Instance) else scope


def _sets(scope: Scope, wanted: str) -> list[tuple[str, ElementSet]]:
    """Return the sets to which ``wanted`` may refer in an instance or a part. A set of an instance hides a set of its
    part with an equal name.
    """
    for each in (scope, _part(scope)):
        if found := each.sets.meant(wanted):
            return [(name.text, one) for name, one in found]
    return []


def _members(pieces: list[Piece], scope: Scope, one: ElementSet, text: str, first: int = 0) -> Chosen:
    """Return the elements of a set for each piece of the model; the pieces are numbered from ``first``. Raises
    MeshError for an undefined element.
    """
    chosen: Chosen = {}
    places = {piece.scope.name.key: place for place, piece in enumerate(pieces)}
    for owner, numbers in one.members.items():
        place = places.get(scope.name.key if owner == OWN else owner)
        wanted = np.unique(np.array(numbers, np.int64))
        there = np.zeros(0, np.int64) if place is None else _every(pieces[place].mesh)
        lost = np.setdiff1d(wanted, there, assume_unique=True)
        if len(lost):
            where = "" if place is None or not pieces[place].scope.line else f" of {_of(pieces[place].scope)}"
            raise MeshError(f"the set {text!r} has the element {lost[0]}{where}, which is not defined")
        if place is not None:
            chosen[first + place] = wanted
    return chosen


def _same(one: Chosen, other: Chosen) -> bool:
    filled = [{place: ids for place, ids in each.items() if len(ids)} for each in (one, other)]
    return filled[0].keys() == filled[1].keys() and all(
        np.array_equal(ids, filled[1][place]) for place, ids in filled[0].items()
    )


def _known(deck: Deck, pieces: list[Piece]) -> set[str]:
    """Return every name that a group may have. If several parts have a set of one name, the name of the part is
    added.
    """
    names = {name.text for name, _ in deck.root.sets}
    owners = {_part(piece.scope).name.key: piece.scope for piece in pieces if piece.scope.line}
    sets = Counter(name.key for scope in owners.values() for name, _ in _part(scope).sets)
    for piece in pieces:
        scope = piece.scope
        if scope.line:
            names.add(scope.name.text)
        for name, _ in scope.sets if isinstance(scope, Instance) else ():
            names.add(f"{scope.name.text}.{name.text}")
    for scope in owners.values():
        for name, _ in _part(scope).sets:
            alone = sets[name.key] == 1 and deck.root.sets.get(name) is None
            names.add(name.text if alone else f"{_part(scope).name.text}.{name.text}")
    return names
