"""Mean normals of surface nodes, and mean directions of the faces of these nodes. The means determine with which faces
a node may be in contact (facing.facing).

The normals are recomputed at every ``EVERY``-th step and after erosion. A face that a crack exposes between two
computations adds its contribution to the sums of its nodes. Therefore the normals do not depend on the steps in which
searches take place.
"""

import numpy as np

from ...elements.colours import TetPass
from ...kernels.jit import njit, types
from ...mesh.faces import FACES
from ...model.state import CHUNK, WIDE, Flags, Floats, Indices, Ints, Model
from ...parallel.arguments import reader
from ...parallel.comm import Comm
from ...parallel.ownership import Neighbour, complete
from ...parallel.passes import Pass
from ...parallel.tags import Tag
from ...parallel.team import TASK, Team
from ..solver.loading import SHARES

EVERY = 16
"""Number of steps between two computations of the mean normals. Between two computations a fragment that rotates at 1e5
rad/s (100 m/s over 1 mm) rotates by 3 degrees."""
COLUMNS, SHARE = 12, 18
"""Number of sums at a node; and number of words that a face adds to the sums of its three nodes."""
_NOTHING = 1e-300
"""Smallest area, m^2; it prevents a division by zero for a degenerate face."""
_I2, _F2, _N1, _N2 = types.int64[:, ::1], types.float64[:, ::1], types.int32[::1], types.int32[:, ::1]
_EXPOSED = (
    _I2, _F2, types.uint32[:, ::1], _N2, types.uint8[:, ::1], types.boolean[:, ::1], types.float64,
)  # fmt: skip
_MEANS = _F2, _N1, _I2, _N1
_read_exposed, _read_means = reader(*_EXPOSED), reader(*_MEANS)


class MeanNormals:
    """Passes over tets and nodes that compute mean normals. The threads of a team run the passes."""

    def __init__(self, team: Team) -> None:
        self._exposed, self._means = TetPass(team, _add_exposed, *_EXPOSED), Pass(team, _mean, *_MEANS)

    def moments(self, model: Model, planes: Flags, size: float, neighbours: list[Neighbour], comm: Comm) -> Ints:
        """(nodes, COLUMNS) sums at each node over the exposed faces of all ranks, in quanta of ``size``^2 / SHARES m^2.
        The terms are area times n, area times n n (xx, yy, zz, yz, zx, xy), and area times the unit vector from the
        node to the midpoint of the opposite edge. ``planes``: see SurfaceBuilder.build. Collective.
        """
        nodes, scale = model.nodes, SHARES / size**2
        sums = np.zeros((nodes.n + nodes.n // 2, COLUMNS), np.int64)[: nodes.n]  # the array has spare rows
        for block in model.blocks:
            self._exposed.run(block, nodes.n, sums, nodes.x, block.tets, block.across, block.bond, planes, scale)
        complete(comm, neighbours, sums, Tag.NORMAL)
        return sums

    def means(self, out: Floats, place: Indices, sums: Ints, nodes: Indices) -> None:
        """Sets the rows ``place`` (k,) of ``out`` (slots, COLUMNS) to means for the ``nodes`` (k,), computed from their
        ``sums`` (nodes, COLUMNS). The area-weighted means are those of the normal n, of n n, and of the directions to
        the faces. The row of a node without faces is zero.
        """
        self._means.run(len(nodes), out, place, sums, nodes)


@njit(TASK, cache=True)
def _mean(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: computes the means of ``MeanNormals.means`` for a range of nodes."""
    out, place, sums, nodes = _read_means(table)
    for k in range(first, stop):
        a, s = nodes[k], place[k]
        area = sums[a, 3] + sums[a, 4] + sums[a, 5]
        area = area if area > 0 else 1
        for i in range(COLUMNS):
            out[s, i] = sums[a, i] / area


def shares(x: Floats, faces: Indices, size: float) -> Ints:
    """(f, SHARE) contributions of the ``faces`` (f, 3) to the ``moments`` of their nodes. A contribution has 9 words
    for all three nodes, and 3 further words for each node.
    """
    out = np.empty((len(faces), SHARE), np.int64)
    for f in range(len(faces)):
        a, b, c = faces[f]
        _share(out[f], x, a, b, c, SHARES / size**2)
    return out


@njit("void(int64[::1], float64[:, ::1], int64, int64, int64, float64)", cache=True, error_model="numpy")
def _share(out, x, a, b, c, scale):  # type: ignore[no-untyped-def]
    ways = np.empty((3, 3))
    ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    fx, fy, fz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    size = max(np.sqrt(nx * nx + ny * ny + nz * nz), _NOTHING)
    moments = nx, ny, nz, nx * nx / size, ny * ny / size, nz * nz / size, ny * nz / size, nz * nx / size, nx * ny / size
    for i in range(9):
        out[i] = np.int64(np.rint(moments[i] * scale))
    for i in range(3):
        to, fro = x[b, i] - x[a, i], x[c, i] - x[a, i]
        ways[0, i], ways[1, i], ways[2, i] = to + fro, fro - 2.0 * to, to - 2.0 * fro
    for m in range(3):
        length = np.sqrt(ways[m, 0] ** 2 + ways[m, 1] ** 2 + ways[m, 2] ** 2)
        for i in range(3):
            out[9 + 3 * m + i] = np.int64(np.rint(ways[m, i] * (size / max(length, _NOTHING)) * scale))


@njit("void(int64[:, ::1], int64, int64[::1], int64)", cache=True)
def _add(sums, node, share, corner):  # type: ignore[no-untyped-def]
    """Adds the contribution ``share`` of a face to the sums of the node at its ``corner``."""
    for i in range(9):
        sums[node, i] += share[i]
    for i in range(3):
        sums[node, 9 + i] += share[9 + 3 * corner + i]


@njit(TASK, cache=True)
def _add_exposed(table, first, stop, thread):  # type: ignore[no-untyped-def]
    """Task: adds the contributions of the exposed faces of the tets in some chunks."""
    sums, x, tets, across, bond, planes, scale = _read_exposed(table)
    share = np.empty(SHARE, np.int64)
    for e in range(first * CHUNK, min(stop * CHUNK, len(tets))):
        for k in range(4):
            if across[e, k] >= 0 and not (len(bond) > 0 and bond[e, k] == WIDE):
                continue
            a, b, c = tets[e, FACES[k, 0]], tets[e, FACES[k, 1]], tets[e, FACES[k, 2]]
            mirrored = False
            for i in range(planes.shape[1]):
                mirrored |= planes[a, i] and planes[b, i] and planes[c, i]
            if mirrored:
                continue
            _share(share, x, a, b, c, scale)
            _add(sums, a, share, 0)
            _add(sums, b, share, 1)
            _add(sums, c, share, 2)


@njit("void(int64[:, ::1], int64[:, ::1], int32[:, ::1])", cache=True)
def add(sums, some, faces):  # type: ignore[no-untyped-def]
    """Adds contributions ``some`` (f, SHARE) to the sums of the nodes of ``faces`` (f, 3). A node that is not on this
    rank has the value -1 in ``faces``.
    """
    for f in range(len(faces)):
        for m in range(3):
            if faces[f, m] >= 0:
                _add(sums, faces[f, m], some[f], m)
