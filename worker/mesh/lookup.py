"""Search in a mesh file for the set to which a name in a case refers."""

from collections.abc import Sequence

import numpy as np

from ..errors import MeshError
from .model import NodeSet

_KINDS = {"nodes": False, "surface": True}
"""Words before a colon, in a name such as ``nodes:NAME``, that select the kind of a set."""
_SHOWN = 20
"""Largest number of names in a message. Chosen value: they fill three lines of a terminal."""


def meant(sets: Sequence[NodeSet], name: str) -> NodeSet | None:
    """Return the set of a name; None if no set has this name.

    Several sets with equal contents count as one set. Sets without a node of the mesh are ignored. Raises MeshError for
    an ambiguous name.
    """
    found = _called(sets, name)
    if not found and (kind := name.partition(":"))[0] in _KINDS:
        found = [each for each in _called(sets, kind[2]) if (each.faces is not None) == _KINDS[kind[0]]]
    here = sorted((each for each in found if len(each.nodes)), key=lambda each: each.faces is None)
    for other in here[1:]:
        if not _same(here[0], other):
            kinds = {each.faces is None for each in here}
            way = (
                f"write 'nodes:{name}' or 'surface:{name}'"
                if len(kinds) == 2
                else "write OWNER.NAME, where OWNER is its part or instance"
            )
            raise MeshError(f"means {len(here)} sets that differ; {way}")
    return next(iter(here or found), None)


def _called(sets: Sequence[NodeSet], name: str) -> list[NodeSet]:
    """Return the sets with the given name. If no set of a kind has exactly this name, return the sets of that kind
    whose names differ from it only in the case of letters.
    """
    found = list[NodeSet]()
    for surfaces in (True, False):
        kind = [each for each in sets if (each.faces is not None) == surfaces]
        exact = [each for each in kind if name in each.names]
        found += exact or [each for each in kind if name.casefold() in (word.casefold() for word in each.names)]
    return found


def _same(one: NodeSet, other: NodeSet) -> bool:
    if not np.array_equal(one.nodes, other.nodes):
        return False
    if one.faces is None or other.faces is None:
        return True
    ours, theirs = (np.unique(np.sort(each, axis=1), axis=0) for each in (one.faces, other.faces))
    return np.array_equal(ours, theirs)


def known(sets: Sequence[NodeSet]) -> str:
    """Return the names of all sets as a text for messages."""
    names = list(dict.fromkeys(each.names[0] for each in sets))
    return ", ".join([*names[:_SHOWN], *(["..."] if len(names) > _SHOWN else [])]) or "none"
