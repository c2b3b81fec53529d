"""Irregular tets for the tests: blocks with randomly moved nodes, and sets of free tets of all sizes and shapes."""

import itertools

import numpy as np
import numpy.typing as npt

from conoid.worker.mesh.model import TetMesh

Floats = npt.NDArray[np.float64]

REGULAR = np.array(
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.75**0.5, 0.0], [0.5, 0.75**0.5 / 3.0, (2.0 / 3.0) ** 0.5]]
)
"""Nodes of the regular tet with edge 1."""


def block(
    cells: tuple[int, int, int], size: float = 1.0, shake: float = 0.2, seed: int = 1, mirrored: bool = False
) -> TetMesh:
    """Returns a block of cubes of edge ``size``, m, each cut into six tets. The nodes are moved by up to ``shake`` of
    the edge. Nodes on a face of the block stay in the plane of the face, so that the block keeps its shape. With
    ``mirrored`` every cube is cut as the mirror image of its neighbours, so that the block is symmetric about its
    planes of symmetry.
    """
    steps = [np.arange(n + 1) for n in cells]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    move = np.random.default_rng(seed).uniform(-shake, shake, grid.shape)
    move[(grid == 0.0) | (grid == np.array(cells))] = 0.0
    strides = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    cubes = np.stack(np.meshgrid(*[np.arange(n) for n in cells], indexing="ij"), axis=-1).reshape(-1, 3)
    turned = cubes % 2 if mirrored else np.zeros_like(cubes)
    corner = (cubes + turned) @ strides
    ways = strides * (1 - 2 * turned)
    tets = np.concatenate([corner[:, None] + path for path in _paths(ways)])
    return TetMesh((grid + move) * size, positive(grid, tets))


def ring(radial: int, around: int, inner: float, outer: float, width: float) -> TetMesh:
    """Returns a quarter of a ring round z: a bent block of cubes with one layer along z."""
    flat = block((radial, around, 1), shake=0.0)
    r = inner + (outer - inner) * flat.points[:, 0] / radial
    angle = 0.5 * np.pi * flat.points[:, 1] / around
    x, y = r * np.cos(angle), r * np.sin(angle)
    x[flat.points[:, 1] == around], y[flat.points[:, 1] == 0] = 0.0, 0.0
    points = np.column_stack([x, y, width * flat.points[:, 2]])
    return TetMesh(points, positive(points, flat.tets))


def _paths(ways: npt.NDArray[np.int64]) -> list[npt.NDArray[np.int64]]:
    """Returns (cubes, 4) six paths from the first corner of a cube to the opposite corner; ``ways`` (cubes, 3) are the
    strides of the edges of the cube."""
    start, end = np.zeros(len(ways), np.int64), ways.sum(axis=1)
    return [
        np.stack([start, ways[:, a], ways[:, a] + ways[:, b], end], axis=1)
        for a, b, _ in itertools.permutations(range(3))
    ]


def positive(points: Floats, tets: npt.NDArray[np.integer]) -> npt.NDArray[np.int32]:
    """Returns the tets with two nodes exchanged where the volume was negative."""
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    wrong = np.linalg.det(edges) < 0.0
    turned = tets.astype(np.int32)
    turned[wrong] = turned[wrong][:, [0, 1, 3, 2]]
    return turned


def free_tets(n: int, seed: int, flattest: float = 0.05) -> TetMesh:
    """Returns ``n`` tets without common nodes, with edges from 0.1 to 10 mm in random directions and a flatness of at
    least ``flattest``. Flatness is the volume of a tet over the volume of a regular tet with the same root mean square
    of the edges.
    """
    random = np.random.default_rng(seed)
    kept: list[Floats] = []
    while sum(map(len, kept)) < n:
        corners = random.normal(size=(2 * n, 4, 3))
        edges = corners[:, 1:] - corners[:, :1]
        size = np.sqrt(((corners[:, :, None] - corners[:, None]) ** 2).sum(axis=(1, 2, 3)) / 12.0)
        good = np.abs(np.linalg.det(edges)) / 6.0 > flattest * size**3 / (6.0 * 2.0**0.5)
        kept.append((corners / size[:, None, None])[good])
    scale = 10.0 ** random.uniform(-4.0, -2.0, n)
    points = (np.concatenate(kept)[:n] * scale[:, None, None]).reshape(-1, 3)
    return TetMesh(points, positive(points, np.arange(4 * n).reshape(n, 4)))
