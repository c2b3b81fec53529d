"""Node sets, surfaces and sets of surface elements of an Abaqus input file, to which the key ``on`` of a case may
refer.
"""

from array import array
from collections.abc import Iterator

import numpy as np

from conoid.cases.reading.inp import is_whole

from ...errors import MeshError
from ..model import Ids
from ..omitted import undefined
from ..sets import Named, joined, surface
from .deck import Deck
from .labels import label
from .placed import Placed
from .scopes import OWN, ElementSet, Instance, Scope, Surface

_NONE = np.zeros(0, np.int64)


def named_sets(model: Placed) -> tuple[list[Named], list[str]]:
    """Return the sets. Also return remarks on the sets that are not read.

    The set ``CLAMP`` of the part ``Bar`` has the name ``Bar.CLAMP``, or ``Bar-1.CLAMP`` in an instance. The set also
    has the name ``CLAMP`` if the assembly has no set of this name.
    """
    remarks, lost = nodes_of_elements(model.deck), dict[str, Ids]()
    found = list(_sets(model, model.deck.root, None, remarks, lost))
    outer = {each.names[0].casefold() for each in found}
    of_parts: dict[tuple[int, str, bool], list[Named]] = {}
    for place, piece in enumerate(model.pieces):
        scope = piece.scope
        owners: list[Scope] = [] if not scope.line else [scope, scope.part] if isinstance(scope, Instance) else [scope]
        for owner in owners:
            for each in _sets(model, owner, place, remarks, lost):
                name = each.names[0]
                of_parts.setdefault((id(owner), f"{owner.name.text}.{name}", each.faces is None), []).append(each)
                if owner is not scope:
                    found.append(joined((f"{scope.name.text}.{name}",), [each]))
    for (_, name, _), several in of_parts.items():
        alone = several[0].names[0]
        found.append(joined((name, *([] if alone.casefold() in outer else [alone])), several))
    return found, [*dict.fromkeys(remarks), *undefined(lost)]


def _sets(model: Placed, scope: Scope, place: int | None, remarks: list[str], lost: dict[str, Ids]) -> Iterator[Named]:
    """Yield the sets of a scope for the piece ``place``. ``place`` is None for the model outside of parts, or for the
    assembly. The undefined members are added to ``lost``.
    """
    for name, one in scope.node_sets:
        owners = list(_owners(model, scope, one, place))
        nodes = [model.nodes(at, _ids(one, owner)) for owner, at in owners]
        lost[f"the node set {name.text!r}"] = np.concatenate(
            [_NONE, *(model.undefined(at, _ids(one, owner)) for owner, at in owners)]
        )
        yield Named((name.text,), np.unique(np.concatenate([_NONE, *nodes])))
    for each in scope.surfaces:
        try:
            yield _surface(model, scope, each, place)
        except MeshError as error:
            remarks.append(f"the surface {each.name.text!r} is not read: {error}")
    for name, one in scope.sets:
        faces = [face for owner, at in _owners(model, scope, one, place) for face in model.plates(at, _ids(one, owner))]
        if any(map(len, faces)):
            yield surface((name.text,), faces)


def _surface(model: Placed, scope: Scope, given: Surface, place: int | None) -> Named:
    nodes, faces = [_NONE], list[Ids]()
    for line, (item, side, *_) in given.rows:
        sets = scope.node_sets if given.of_nodes else scope.sets
        one = ElementSet() if is_whole(item) else sets.get(label(item))
        if one is None:
            raise MeshError(f"line {line}: the set {item!r} is not defined")
        if is_whole(item):
            one.add(OWN, array("q", [int(item)]))
        for owner, at in _owners(model, scope, one, place):
            numbers = _ids(one, owner)
            if given.of_nodes:
                nodes.append(model.nodes(at, numbers))
            else:
                faces += model.faces(at, numbers, side.upper())
    if given.of_nodes:
        return Named((given.name.text,), np.unique(np.concatenate(nodes)))
    return surface((given.name.text,), faces, free=not all(side for _, (_, side, *_) in given.rows))


def _owners(model: Placed, scope: Scope, one: ElementSet, place: int | None) -> Iterator[tuple[str, int]]:
    """Yield the scopes that contain members of a set, and the pieces of the model in each scope."""
    for owner in one.members:
        if owner == OWN and place is not None:
            yield owner, place
            continue
        key = scope.name.key if owner == OWN else owner
        yield from ((owner, at) for at, piece in enumerate(model.pieces) if piece.scope.name.key == key)


def _ids(one: ElementSet, owner: str) -> Ids:
    return np.unique(np.array(one.members[owner], np.int64))


def nodes_of_elements(deck: Deck) -> list[str]:
    """Fill each set of nodes that the file defines by a set of elements. Return remarks on undefined sets of
    elements.
    """
    remarks = []
    for scope in (deck.root, *(part for _, part in deck.parts), *(each for _, each in deck.instances)):
        for one, name, line in scope.node_sets_of:
            elements = scope.sets.get(name)
            if elements is None:
                remarks.append(f"line {line}: the set of elements {name.text!r} is not defined; its nodes are left out")
                continue
            for owner, numbers in elements.members.items():
                mesh = scope if owner == OWN else next(each for _, each in deck.instances if each.name.key == owner)
                one.add(owner, _nodes_of(mesh.mesh if isinstance(mesh, Instance) else mesh, np.array(numbers)))
    return remarks


def _nodes_of(mesh: Scope, numbers: Ids) -> "array[int]":
    found = array("q")
    for rows in (*mesh.solids.values(), *mesh.plates.values()):
        chosen = np.isin(np.array(rows.numbers), numbers)
        found.extend(np.array(rows.nodes).reshape(len(chosen), -1)[chosen].ravel().tolist())
    return found
