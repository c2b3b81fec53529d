"""Sets made from the physical groups of points, curves and surfaces."""

from collections.abc import Iterator, Mapping

import numpy as np

from ..model import Ids
from ..named import placed
from ..sets import Named, surface
from .blocks import QUADRILATERALS, TRIANGLES, VOLUME, Block

_SURFACE = 2
"""Number by which gmsh identifies a surface."""


def named_sets(blocks: list[Block], names: Mapping[tuple[int, int], str], tags: Ids) -> Iterator[Named]:
    """Yield each physical group as a set. The set of points or curves has their nodes, the set of a surface has its
    faces. If a group has no name, its number is used as the name.
    """
    groups = sorted({(each.dimension, tag) for each in blocks if each.dimension < VOLUME for tag in each.groups})
    called: dict[tuple[int, str], list[int]] = {}
    for dimension, tag in groups:
        called.setdefault((dimension, names.get((dimension, tag), str(tag))), []).append(tag)
    for (dimension, name), numbers in called.items():
        members = [each for each in blocks if each.dimension == dimension and each.groups & frozenset(numbers)]
        words = tuple(dict.fromkeys([name, *map(str, numbers if len(numbers) == 1 else ())]))
        if dimension < _SURFACE:
            every = np.unique(np.concatenate([each.nodes.ravel() for each in members]))
            yield Named(words, _places(tags, every[:, None], name).ravel())
        else:
            yield surface(words, (_faces(members, tags, 3, name), _faces(members, tags, 4, name)))


def _faces(members: list[Block], tags: Ids, corners: int, name: str) -> Ids:
    kinds = TRIANGLES if corners == 3 else QUADRILATERALS
    nodes = [each.nodes[:, :corners] for each in members if each.kind in kinds]
    return _places(tags, np.concatenate([np.zeros((0, corners), np.int64), *nodes]), name)


def _places(tags: Ids, nodes: Ids, name: str) -> Ids:
    return placed(tags, nodes, lambda k: f"the physical group {name!r}")
