"""Regular meshes for verification: hexahedra cut into 5 or 6 tets, in plain numpy.

A block is cut into cells by planes. The cells of a solid cylinder are made from a square grid, which is mapped to the
disk, and from planes across the axis. The cells of a tube are made from rings, sectors and planes. ``element_size`` is
rounded to a whole number of divisions, at least one.
"""

import itertools

import numpy as np
from numpy.typing import NDArray

from conoid.cases.model.bodies import Box, Cylinder, Plate, Shards, Tube, TwoTets
from conoid.cases.shapes.geometry import Generated

from ..errors import MeshError
from ..materials.turning import sines_and_cosines
from .frame import block, refuse_impossible, to_space
from .loose import shards, two_tets
from .model import Floats, Ints, TetMesh
from .slit import opened

Cells = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Numbers of the near node and the far node of each cell along one direction."""

Lines = NDArray[np.int64]


def structured(body: Generated, key: str = "mesh") -> TetMesh:
    """Return the regular mesh of a body. Raises MeshError, whose message contains ``key``; a sphere has no regular
    mesh.
    """
    refuse_impossible(body, key)
    if body.grading is not None:
        raise MeshError(f"{key}.grading: the structured generator has one element size; remove it, or use gmsh")
    if isinstance(body, Shards):
        return shards(body)
    if isinstance(body, TwoTets):
        corners, pair = two_tets(body)
        return TetMesh(to_space(body, corners), pair)
    if isinstance(body, Box | Plate):
        points, shape, cells = _block(body)
    elif isinstance(body, Cylinder):
        points, shape, cells = _cylinder(body)
    elif isinstance(body, Tube):
        points, shape, cells = _tube(body)
    else:
        raise MeshError(f"{key}.generator = 'structured': there is no regular mesh of a {body.shape}; use gmsh")
    mesh = TetMesh(to_space(body, points), _cut(shape, cells, body.split))
    return opened(body, mesh) if isinstance(body, Box | Plate) else mesh


def divisions(length: float, size: float) -> int:
    """Return the number of cells of about the size ``size`` along ``length``."""
    return max(1, round(length / size))


def disk(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Return points of the square [-1, 1]^2 mapped to the unit disk. Concentric squares become circles with equal
    angles between points (Shirley and Chiu 1997).

    The ratio of areas is the same everywhere. A corner of the square lies on the smooth circle, so the cell at this
    corner must have its diagonal through the corner; ``_mirrored`` numbers the nodes accordingly.
    """
    x, y = np.abs(u), np.abs(v)
    radius, less = np.maximum(x, y), np.minimum(x, y)
    angle = np.pi / 4 * np.divide(less, radius, out=np.zeros_like(radius), where=radius > 0)
    sine, cosine = sines_and_cosines(angle)
    near, side = radius * cosine, radius * sine
    return np.copysign(np.where(x >= y, near, side), u), np.copysign(np.where(x >= y, side, near), v)


def _block(body: Box | Plate) -> tuple[Floats, list[int], list[Cells]]:
    low, high = block(body)
    counts = [divisions(b - a, body.element_size) for a, b in zip(low, high, strict=True)]
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, [n + 1 for n in counts], [_plain(n) for n in counts]


def _cylinder(body: Cylinder) -> tuple[Floats, list[int], list[Cells]]:
    n, layers = divisions(body.radius, body.element_size), divisions(body.length, body.element_size)
    a = np.arange(0 if body.sector != "full" else -n, n + 1)
    b = np.arange(0 if body.sector == "quarter" else -n, n + 1)
    x, y = disk(*np.meshgrid(a / n, b / n, indexing="ij"))
    points = _extruded(body.radius * x, body.radius * y, body.length, layers)
    return points, [len(a), len(b), layers + 1], [_mirrored(a), _mirrored(b), _plain(layers)]


def _tube(body: Tube) -> tuple[Floats, list[int], list[Cells]]:
    rings = divisions(body.radius - body.inner_radius, body.element_size)
    n = divisions(np.pi / 4 * (body.radius + body.inner_radius), body.element_size)
    layers = divisions(body.length, body.element_size)
    start, quarters = {"full": (0, 4), "half": (-n, 2), "quarter": (0, 1)}[body.sector]
    steps = start + np.arange(quarters * n + (body.sector != "full"))
    near, far = _plain(quarters * n)
    radius = np.linspace(body.inner_radius, body.radius, rings + 1)[:, None]
    cosine, sine = _circle(steps, n), _circle(steps - n, n)
    points = _extruded(radius * cosine, radius * sine, body.length, layers)
    return points, [rings + 1, len(steps), layers + 1], [_plain(rings), (near, far % len(steps)), _plain(layers)]


def _circle(step: Lines, n: int) -> Floats:
    """Return the cosine of ``step`` / n quarter turns, with exact values 0 and 1."""
    turn, rest = np.divmod(step, n)
    sine, cosine = sines_and_cosines(np.pi / 2 * rest / n)
    return np.choose(turn % 4, [cosine, -sine, -cosine, sine]) + 0.0


def _extruded(x: Floats, y: Floats, length: float, layers: int) -> Floats:
    z = np.linspace(0.0, length, layers + 1)
    return np.stack(np.broadcast_arrays(x[..., None], y[..., None], z), axis=-1).reshape(-1, 3)


def _plain(count: int) -> Cells:
    return np.arange(count), np.arange(1, count + 1)


def _mirrored(line: Lines) -> Cells:
    """Return the cells between successive nodes of ``line``, which is centred at 0. The near node of a cell is the node
    closer to 0. Therefore the two sides are mirror images.
    """
    low, high = np.arange(len(line) - 1), np.arange(1, len(line))
    inside = line[:-1] >= 0
    return np.where(inside, low, high), np.where(inside, high, low)


def _cut(shape: list[int], cells: list[Cells], split: int) -> Ints:
    """Return (m, 4) tets of all cells.

    Corner p + 2 q + 4 r of a cell is at the far end along a if p is 1, along b if q is 1, and along c if r is 1.
    """
    strides = (shape[1] * shape[2], shape[2], 1)
    ends = [[end * stride for end in cell] for cell, stride in zip(cells, strides, strict=True)]
    corner = [
        (ends[0][p][:, None, None] + ends[1][q][:, None] + ends[2][r]).astype(np.int32).ravel()
        for r, q, p in itertools.product((0, 1), repeat=3)
    ]
    mirror = _odd([(far == near - 1).astype(int) for near, far in cells])
    if split == 6:
        tets = np.stack([np.stack([corner[i] for i in tet], axis=1) for tet in _SIX], axis=1)
    else:
        odd = _odd([near for near, far in cells])
        tets = np.stack(
            [np.stack([np.where(odd, corner[7 - i], corner[i]) for i in tet], axis=1) for tet in _FIVE], axis=1
        )
        mirror = mirror != odd
    tets[mirror] = tets[mirror][..., [0, 2, 1, 3]]
    return tets.reshape(-1, 4)


def _odd(numbers: list[Lines]) -> NDArray[np.bool_]:
    """Return flags of the cells: True if the sum of the three cell numbers (one for each direction) is odd."""
    a, b, c = np.ix_(*numbers)
    return np.asarray((a + b + c) % 2 == 1).ravel()


def _six() -> list[tuple[int, int, int, int]]:
    """Return the six paths along edges from corner 0 to corner 7 (Kuhn). Each path gives a tet; all six tets share the
    long diagonal.
    """
    tets = []
    for first, second, third in itertools.permutations((1, 2, 4)):
        even = (first, second, third) in ((1, 2, 4), (2, 4, 1), (4, 1, 2))
        middle = (first, first + second) if even else (first + second, first)
        tets.append((0, *middle, 7))
    return tets


_SIX = _six()
_FIVE = [(0, 5, 3, 6), (0, 1, 3, 5), (0, 3, 2, 6), (0, 5, 6, 4), (3, 6, 5, 7)]
"""Nodes of the five tets of a cell: the middle tet, and one tet at each of the corners 1, 2, 4, 7. In each neighbouring
cell the mirror image is used: corner i is replaced by corner 7 - i."""
