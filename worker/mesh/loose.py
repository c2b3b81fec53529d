"""Generated meshes of separate tets (shards), or of two tets with a common face."""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from conoid.cases.model.bodies import Shards, TwoTets
from conoid.cases.shapes.geometry import altitude, pitch

from ..materials.turning import sine_and_cosine, sines_and_cosines
from ..model.hashing import uniform
from .model import Floats, TetMesh

_CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, -1, 1], [-1, 1, -1]]) / math.sqrt(8.0)
"""Corners of the regular tet of edge 1, relative to its centre; in this order the volume is positive."""

_RANDOM = 15
"""Number of random numbers for a shard: 3 for its rotation, 12 for shifts of its nodes."""


def shards(body: Shards) -> TetMesh:
    """Return a mesh of shards. Each shard is in the middle of its own cube. A shard gets a uniformly random rotation,
    and then random shifts of its nodes.
    """
    cubes = np.array(list(itertools.product(*map(range, body.count))), np.float64)
    random = uniform(np.arange(_RANDOM * len(cubes)), body.seed).reshape(-1, _RANDOM)
    turned = (rotations(random[:, :3])[:, None] * _CORNERS[:, None]).sum(axis=3)
    moved = turned + body.perturbation * (2.0 * random[:, 3:].reshape(-1, 4, 3) - 1.0)
    points = np.array(body.base) + pitch(body) * (cubes + 0.5)[:, None, :] + body.element_size * moved
    return TetMesh(points.reshape(-1, 3), np.arange(4 * len(cubes), dtype=np.int32).reshape(-1, 4))


def rotations(random: Floats) -> Floats:
    """Return (n, 3, 3) uniformly distributed rotations, made from random numbers (n, 3) in [0, 1). Source: Shoemake
    1992.
    """
    one, two = np.sqrt(1.0 - random[:, 0]), np.sqrt(random[:, 0])
    a, b = 2.0 * math.pi * random[:, 1], 2.0 * math.pi * random[:, 2]
    (sine_a, cosine_a), (sine_b, cosine_b) = sines_and_cosines(a), sines_and_cosines(b)
    x, y, z, w = one * sine_a, one * cosine_a, two * sine_b, two * cosine_b
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def two_tets(body: TwoTets) -> tuple[Floats, NDArray[np.int32]]:
    """Return two tets with a common face: their points in the frame of the body, m, and their node indices. The common
    face is at the origin, normal to the third direction.
    """
    edge = body.element_size
    sine, cosine = sines_and_cosines(2.0 * math.pi / 3.0 * np.arange(3.0))
    face = edge / math.sqrt(3.0) * np.stack([cosine, sine, np.zeros(3)], axis=1)
    leaning, upright = sine_and_cosine(body.lean)
    top = altitude(body) * np.array([leaning / upright, 0.0, 1.0])
    return np.concatenate([face, [top, -top]]), np.array([[0, 1, 2, 3], [0, 2, 1, 4]], np.int32)
