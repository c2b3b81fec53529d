"""Faces of a mesh file that lie on each other without common nodes are reported."""

import numpy as np
import pytest

from conoid.worker.mesh import unjoined
from conoid.worker.mesh.faces import boundary_faces
from conoid.worker.mesh.model import Floats, Ints

CUTS = ((0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7))
"""Six tets of a cube whose corner number is x + 2 y + 4 z."""


def cubes(low: tuple[float, float, float], size: float, n: int) -> tuple[Floats, Ints]:
    """Returns nodes and tets of n x n x n cubes that fill a cube of the given size."""
    at = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    number = {tuple(each): k for k, each in enumerate(at.tolist())}
    corners = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]
    tets = [
        [number[i + corners[c][0], j + corners[c][1], k + corners[c][2]] for c in cut]
        for i in range(n) for j in range(n) for k in range(n) for cut in CUTS
    ]  # fmt: skip
    return np.array(low) + at * (size / n), np.array(tets, np.int32)


def together(*meshes: tuple[Floats, Ints], merged: bool) -> tuple[Floats, Ints]:
    """Returns one mesh of several; ``merged``: whether nodes at one place become one node."""
    before = np.cumsum([0, *(len(points) for points, _ in meshes)])
    points = np.concatenate([points for points, _ in meshes])
    tets = np.concatenate([tets + first for (_, tets), first in zip(meshes, before[:-1], strict=True)])
    if merged:
        points, of = np.unique(np.round(points, 9), axis=0, return_inverse=True)
        tets = of.reshape(-1)[tets]
    return points, tets.astype(np.int32)


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize(
    ("fine", "merged", "area"), [(1, True, 0), (1, False, 1), (2, True, 1), (3, False, 1), (4, True, 1)]
)
def test_blocks_that_are_not_joined_are_reported(turn: float, fine: int, merged: bool, area: int) -> None:
    points, tets = together(cubes((0, 0, 0), 1.0, 1), cubes((1, 0, 0), 1.0, fine), merged=merged)
    c, s = np.cos(turn), np.sin(turn)
    points = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    found = list(unjoined.notes(points, boundary_faces(tets)))
    assert len(found) == area
    if found:
        assert found[0].startswith("about 1e+06 mm^2 of its faces lie on other faces of the part")


def test_a_gap_and_a_step_are_not_reported() -> None:
    for low in ((1.001, 0.0, 0.0), (1.0, 1.0, 0.0)):
        points, tets = together(cubes((0, 0, 0), 1.0, 2), cubes(low, 1.0, 3), merged=False)
        assert list(unjoined.notes(points, boundary_faces(tets))) == []
