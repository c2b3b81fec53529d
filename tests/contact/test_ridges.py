"""Ridges that meet: bodies do not pass into each other where two edges cross, however small the angle."""

import numpy as np
import pytest

from conoid.worker.mesh.model import TetMesh

from ..worker.kernels import build, run
from ..worker.meshes import Floats, positive
from .bodies import meeting_of, rotation

SIZE = 1e-3
ROOF = SIZE * np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, -0.6], [0.0, -0.5, -0.6]])
"""A tet with an edge along x on its top, whose faces fall by 50 degrees."""
TET = np.array([[0, 1, 2, 3]])


def tet(points: Floats) -> TetMesh:
    return TetMesh(points, positive(points, TET))


def deep(x: Floats, y: Floats) -> float:
    """How far two tets (4, 3) overlap along the way on which they do least, m; negative when they are apart."""
    sides = [np.array([p[j] - p[i] for i in range(4) for j in range(i + 1, 4)]) for p in (x, y)]
    axes = [np.cross(p[[1, 0, 0, 0]] - p[[2, 3, 1, 2]], p[[3, 2, 3, 1]] - p[[2, 3, 1, 2]]) for p in (x, y)]
    every = np.concatenate([*axes, np.cross(sides[0][:, None], sides[1][None]).reshape(-1, 3)])
    length = np.linalg.norm(every, axis=1)
    every = every[length > 1e-9 * length.max()]
    one, two = x @ every.T, y @ every.T
    overlap = np.minimum(one.max(axis=0) - two.min(axis=0), two.max(axis=0) - one.min(axis=0))
    return float((overlap / np.linalg.norm(every, axis=1)).min())


@pytest.mark.parametrize("angle", [0.5, 3.0, 30.0])
def test_tets_that_come_ridge_on_ridge_do_not_pass_into_each_other(angle: float) -> None:
    """Degrees between the ridges: at 2.9 and less they met as nodes and faces only, of which none is in the way."""
    over = ROOF @ rotation((1, 0, 0), np.pi).T @ rotation((0, 0, 1), np.radians(angle)).T + [0.0, 0.0, 0.01 * SIZE]
    motions = [{"velocity": (0.0, 0.0, 30.0)}, {"velocity": (0.0, 0.0, -30.0)}]
    sim = build(meeting_of(motions, end=4e-6), [tet(ROOF), tet(over)])
    most = [0.0]
    run(sim, lambda sim, _: most.append(deep(sim.model.nodes.x[:4], sim.model.nodes.x[4:])))
    assert sim.contact is not None
    assert sim.contact.last_push > 0.0
    assert max(most) < 0.005 * SIZE
