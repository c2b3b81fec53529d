"""Cost of contact for each node, by which the load is balanced between ranks."""

import numpy as np

from ..model.state import Flags, Floats
from .scene.scene import Scene

_SURFACE, _LISTED, _TESTED, _ACTIVE = 9.0, 0.1, 3.0, 4.0
"""Costs of contact in a step, in units of 50 ns: of a surface node (average of searches and registrations), of a listed
pair, of a tested pair or crack, and of an active contact. The costs are 450, 3, 150 and 200 ns. The costs were measured
in the profile of the shattering bar to 40 us on one rank."""


def effort(now: Scene | None, on_surface: Flags) -> Floats:
    """(nodes, 2) cost of the scene ``now`` for each local node, in units of 50 ns: cost of searches, and cost of narrow
    phase and solver. ``on_surface`` (nodes,): surface nodes that this rank owns.
    """
    n = len(on_surface)
    search, push = _SURFACE * on_surface, np.zeros(n)
    if now is not None:
        nodes, firsts = now.node_face.rows[:, 0], now.edges.corners[now.edge_edge.rows[:, 0], 0]
        cracks = now.cracks[now.cracks[:, 0] >= 0, 0]
        tested = np.concatenate([nodes[now.node_face.tested], firsts[now.edge_edge.tested], cracks])
        for cost, weight, slots in (
            (search, _LISTED, np.concatenate([nodes, firsts])),
            (push, _TESTED, tested),
            (push, _ACTIVE, now.active.nodes[:, 0]),
        ):
            at = now.surface_nodes.local[slots]
            cost += weight * np.bincount(at[at >= 0], minlength=n)
    return np.column_stack([search, push])
