"""Transfer of nodal forces, as integers, from separated nodes to their copies: the forces of tets and of cohesive
facets.
"""

from typing import NamedTuple

import numpy as np

from ..elements.forces import internal_forces
from ..elements.scratch import EDGE, SCRATCH
from ..elements.tet4 import end_gradients, gather
from ..kernels.jit import njit, record, types
from ..model.rows import VISCOUS
from ..model.state import CHUNK, Floats, Ints, Model, Tets
from ..model.topology import Split
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from .cohesive import Cohesion
from .columns import Facets
from .law import scatter_copies
from .records import MESH, POINTS, Mesh
from .separation import common

_ROWS = VISCOUS + 1
"""Rows of the element state from which the forces are computed."""
_I1, _I2, _N1 = types.int64[::1], types.int64[:, ::1], types.int32[::1]


class Room(NamedTuple):
    """Scratch memory for a chunk of tets (elements/scratch.py)."""

    w: Floats
    """(SCRATCH,) scratch rows of the element kernels."""
    forces: Ints
    """(9 * CHUNK,) forces on nodes 1, 2, 3, quanta."""
    state: Floats
    """(_ROWS * CHUNK,) state of the tets of the chunk."""
    tets: Tets
    """(CHUNK, 4) local nodes of the tets of the chunk."""


_ROOM = record(Room, types.float64[::1], _I1, types.float64[::1], types.uint32[:, ::1])


class Handover:
    """Transfer of forces to the copies of separated nodes, on one rank."""

    def __init__(self, model: Model, meshes: dict[int, Mesh], neighbours: list[Neighbour], comm: Comm) -> None:
        """``meshes``: meshes of the parts that fracture; the keys are the indices of the blocks of tets."""
        self._model, self._meshes, self._neighbours, self._comm = model, meshes, neighbours, comm
        self._room = Room(
            np.zeros(SCRATCH), np.zeros(9 * CHUNK, np.int64), np.zeros(_ROWS * CHUNK), np.zeros((CHUNK, 4), np.uint32)
        )

    def hand_over(self, split: Split, cohesion: Cohesion | None, fresh: list[Facets]) -> None:
        """Moves the forces of the tets and facets of each copy from the parent node to the copy; ``fresh``: new
        cohesive facets. Collective among the ranks that share copies.

        The force that a copy receives is subtracted exactly from its parent, because copy and parent were one node
        before the separation.
        """
        nodes, copies = self._model.nodes, split.copies
        change = np.zeros((copies.n, 3), np.int64)
        for b, mesh in self._meshes.items():
            _of_tets(
                change, split.node, split.place, split.corner, split.block, b, split.first, mesh, nodes.x, self._room,
                nodes.scale,
            )  # fmt: skip
        if cohesion is not None:
            moved = cohesion.follow(split, nodes.id)
            held = cohesion.facets
            scatter_copies(change, split.first, held.nodes[moved], held.state.pull[moved], nodes.scale)
            for new in fresh:
                scatter_copies(change, split.first, new.nodes, new.state.pull, nodes.scale)
        self._complete(change, copies.parents)
        _apply(nodes.force, change, copies.parents, split.first)

    def _complete(self, change: Ints, parents: Ints) -> None:
        """Adds the force changes that other ranks computed for shared copies to ``change``."""
        shared = {o.rank: at for o in self._neighbours if len(at := common(parents, o.nodes))}
        if shared:
            received = self._comm.trade({rank: change[at] for rank, at in shared.items()}, shared)
            for rank, at in shared.items():
                change[at] += received[rank].reshape(-1, 3)


@njit(types.void(_I2, _I2, _I1, types.int64), cache=True)
def _apply(force, change, parents, first):  # type: ignore[no-untyped-def]
    """Adds ``change`` (copies, 3) to the forces of the copies, and subtracts it from the forces of the ``parents``."""
    for c in range(len(parents)):
        for k in range(3):
            force[first + c, k] += change[c, k]
            force[parents[c], k] -= change[c, k]


@njit(types.void(_ROOM, _N1, _I1, types.int64, MESH, POINTS, types.float64), cache=True, error_model="numpy")
def _forces(room, place, chosen, n, mesh, x, scale):  # type: ignore[no-untyped-def]
    """Computes the forces of the chosen tets on their nodes 1, 2, 3 from the present stress of the tets
    (elements/forces.py), and stores these forces in ``room.forces``. ``n``: number of tets.
    """
    for i in range(n):
        e = place[chosen[i]]
        at = e // CHUNK * mesh.columns * CHUNK + e % CHUNK
        for k in range(4):
            room.tets[i, k] = mesh.tets[e, k]
        for row in range(_ROWS):
            room.state[row * CHUNK + i] = mesh.state[at + row * CHUNK]
    gather(room.w[EDGE:], x, room.tets, room.w[:0], n)
    end_gradients(room.w, n)
    internal_forces(room.forces, room.w, room.state, n, scale)


@njit(
    types.void(_I2, _N1, _N1, _N1, _N1, types.int64, types.int64, MESH, POINTS, _ROOM, types.float64),
    cache=True,
    error_model="numpy",
)
def _of_tets(change, node, place, corner, blocks, block, first, mesh, x, room, scale):  # type: ignore[no-untyped-def]
    """Adds forces of tets to the forces of the copies. The tets are the tets of one ``block`` whose ``node`` (r,) is
    now a copy. ``first``: local index of the first copy.
    """
    chosen, n = np.empty(CHUNK, np.int64), 0
    for r in range(len(node)):
        if blocks[r] == block:
            chosen[n] = r
            n += 1
        if n == CHUNK or (n and r == len(node) - 1):
            _forces(room, place, chosen, n, mesh, x, scale)
            for i in range(n):
                to, c = node[chosen[i]] - first, 3 * (corner[chosen[i]] - 1)
                for k in range(3):
                    if c >= 0:
                        change[to, k] += room.forces[(c + k) * CHUNK + i]
                    else:
                        for m in range(3):
                            change[to, k] -= room.forces[(3 * m + k) * CHUNK + i]
            n = 0
