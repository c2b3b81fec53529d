"""Degenerate hexahedra: hexahedra with repeated nodes, which represent wedges, pyramids and tets in decks."""

import numpy as np
from numpy.typing import NDArray

from .cells import Form
from .model import Ids
from .patterns import EDGES, QUADS

_TET = Form.TET.inside


def folded(nodes: Ids) -> tuple[Ids, NDArray[np.bool_]]:
    """Return three arrays: the hexahedra (m, 8); the tets, which are hexahedra with only four different nodes; and
    flags of the elements that can have a volume.

    An element can have a volume only if repeated nodes are connected by edges, and if no face has two equal opposite
    corners.
    """
    first = (nodes[:, :, None] == nodes[:, None, :]).argmax(axis=2)
    kinds, of = np.unique(first, axis=0, return_inverse=True)
    of = of.reshape(-1)
    found, good = nodes.copy(), np.ones(len(nodes), bool)
    for k, kind in enumerate(kinds):
        chosen, different = of == k, np.unique(kind)
        if len(different) == Form.TET.corners:
            found[chosen] = nodes[chosen][:, different][:, _TET]
        elif len(different) < 8:
            good[chosen] = len(different) > Form.TET.corners and _folds(kind)
    return found, good


def _folds(first: Ids) -> bool:
    """Return flags of the elements: True if the repeated nodes of the element are allowed (``folded``). ``first``
    gives, for each node, the first position of that node in the element.
    """
    reached = np.arange(8)
    for _ in range(8):
        for a, b in EDGES:
            if first[a] == first[b]:
                reached[a] = reached[b] = min(reached[a], reached[b])
    crossed = [
        first[a] == first[c] and len(np.unique(first[[a, b, c, d]])) > 2
        for a, b, c, d in [*QUADS.tolist(), *np.roll(QUADS, 1, axis=1).tolist()]
    ]
    return bool((first[reached] == first).all() and len(np.unique(reached)) == len(np.unique(first))) and not any(
        crossed
    )
