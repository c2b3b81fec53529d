"""Rigid bodies that each wall stops, and the nodes of their surfaces."""

import numpy as np

from conoid.cases.model.schema import Case, Symmetry, Wall

from ..model.state import Flags, Floats, Indices, Ints, Nodes
from ..parallel.comm import Comm
from .bodies import Bodies, of_nodes


def stopped(case: Case, nodes: Nodes, bodies: Bodies, beside: Ints, comm: Comm) -> tuple[Flags, Floats, Indices]:
    """Returns (walls, b) flags: True if the wall stops the body. The walls of the case are followed by the two sides of
    each symmetry plane. Also returns, for all nodes of stopped bodies on all ranks, ordered by id, the initial arm, m,
    and the body. ``beside`` (planes, parts): side on which a body starts, 1 or -1. Collective.
    """
    held = np.concatenate([_by_walls(case, bodies), _by_planes(case, bodies, beside)])
    held &= np.array([not each.prescribed for each in bodies.held], bool)
    of = of_nodes(case, nodes)
    some = np.asarray(held.any(axis=0))[of] & (of >= 0) & nodes.owned
    mine = np.column_stack([nodes.id[some], of[some], nodes.x0[some].view(np.int64)])
    gathered = comm.join(mine.reshape(-1)).reshape(-1, 5)
    gathered = gathered[np.argsort(gathered[:, 0])]
    body = np.ascontiguousarray(gathered[:, 1].astype(np.int32))
    arms = np.ascontiguousarray(gathered[:, 2:]).view(np.float64) - bodies.origin[body]
    return held, np.ascontiguousarray(arms), body


def _by_walls(case: Case, bodies: Bodies) -> Flags:
    specs = [spec for _, spec in case.boundaries_of(Wall)]
    names = [case.parts[index].name for index in bodies.part.tolist()]
    held = np.array([[not spec.parts or name in spec.parts for name in names] for spec in specs], bool)
    return held.reshape(len(specs), bodies.n)


def _by_planes(case: Case, bodies: Bodies, beside: Ints) -> Flags:
    """Returns (2 planes, b) flags, two rows for each symmetry plane: the first row marks the bodies that start above
    the plane, the second row those that start below.
    """
    side = beside[:, bodies.part]
    return np.stack([side > 0, side < 0], axis=1).reshape(2 * len(case.boundaries_of(Symmetry)), bodies.n)
