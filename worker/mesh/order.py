"""Order of nodes and tets along the Morton curve: neighbours in space become neighbours in memory.

A kernel over tets reads and writes values of nodes, so the order determines the rate of cache hits. On unstructured
meshes kernels run 1.3 to 1.6 times as fast with nodes and tets along the Morton curve as without this order. In
addition, the numbering does not depend on the generator or the file of the mesh.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .model import Floats, TetMesh

_BITS = 21
"""Number of bits of a coordinate in a Morton code; three coordinates need 63 bits."""
_SPREAD = [
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
]
"""Shifts and masks that insert two zero bits after each of 21 bits. Each step moves the two halves of a block of bits
apart."""


def morton_codes(points: Floats, low: Floats, edge: float) -> NDArray[np.uint64]:
    """Return (n,) positions of ``points``, (n, 3), along the Z-curve through a cube. ``low`` (3,): low corner of the
    cube; ``edge``: length of its edge, m.

    Each coordinate has 21 bits in the code; x varies fastest.
    """
    cells = 2**_BITS
    scale = cells / edge if edge > 0 else 0.0
    box = np.clip((points - low) * scale, 0, cells - 1).astype(np.uint64)
    x, y, z = (_spread(box[:, i]) for i in range(3))
    codes: NDArray[np.uint64] = x | y << np.uint64(1) | z << np.uint64(2)
    return codes


def _spread(bits: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return the numbers with two zero bits between any two bits."""
    for shift, mask in _SPREAD:
        bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
    return bits


def morton_ordered(mesh: TetMesh) -> TetMesh:
    """Return the mesh with its nodes and tets ordered along the Morton curve of the bounding cube of the mesh. A tet
    has the position of its centroid.

    Nodes or tets at equal positions keep their order. The order of the nodes within a tet does not change.
    """
    low = mesh.points.min(axis=0)
    edge = float((mesh.points.max(axis=0) - low).max())
    by_node = np.argsort(morton_codes(mesh.points, low, edge), kind="stable")
    place = np.empty(len(by_node), np.int32)
    place[by_node] = np.arange(len(by_node), dtype=np.int32)
    centroids = np.stack([column[mesh.tets].sum(axis=1) / 4 for column in mesh.points.T], axis=1)
    by_tet = np.argsort(morton_codes(centroids, low, edge), kind="stable")
    origin = mesh.origin and replace(mesh.origin, nodes=mesh.origin.nodes[by_node])
    sets = tuple(
        replace(each, nodes=np.sort(place[each.nodes]), faces=None if each.faces is None else place[each.faces])
        for each in mesh.sets
    )
    return TetMesh(mesh.points[by_node], place[mesh.tets[by_tet]], origin, sets)
