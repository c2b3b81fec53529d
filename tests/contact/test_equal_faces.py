"""Bodies that collide with one face each; the two faces are equal or nearly equal.

All nodes of one face have their feet on the border of the other face. If a body becomes narrower behind its face, no
node is ever inside of it, so that contacts are not found later. The edges cross in the plane of both faces, at the
limit of their contacts.
"""

import numpy as np
import pytest

from conoid.worker.mesh.model import TetMesh

from ..worker.kernels import build, run
from ..worker.meshes import Floats
from .bodies import meeting_of

MANY = 25
"""Number of pairs of faces; each pair is computed separately."""
APART, MM = 8.0, 1e-3
CORNERS = np.array([[1.0, 0.0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]])
"""Corners of a triangular face of circumradius 1."""
POINTS = np.random.default_rng(7).dirichlet([0.6] * 4, 200)
"""Area coordinates of points of a tet, many of the points near its border."""


def turned(degrees: float) -> Floats:
    """Returns a (2, 2) rotation matrix."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s], [-s, c]])


def tets(corners: list[Floats], heights: float) -> TetMesh:
    """Returns a tet on each of the faces (3, 3), mm, with its tip ``heights`` above or below the middle of the face."""
    points = np.concatenate([np.vstack([face, face.mean(axis=0) + np.array([0.0, 0.0, heights])]) for face in corners])
    rows = np.arange(len(points), dtype=np.int32).reshape(-1, 4)
    return TetMesh(MM * points, rows if heights > 0.0 else rows[:, [0, 2, 1, 3]])


def common(one: Floats, two: Floats) -> float:
    """Returns the fraction of POINTS of a tet, corners (4, 3), that are inside of another tet by more than 0.01 of its
    size.
    """
    inside = np.linalg.solve((two[1:] - two[0]).T, (POINTS @ one - two[0]).T).T
    return float((np.column_stack([inside, 1.0 - inside.sum(axis=1)]).min(axis=1) > 0.01).mean())


@pytest.mark.parametrize(
    ("height", "shift", "turn"),
    [(2.0, 0.0, 0.0), (2.0, 0.05, 0.0), (2.0, 0.2, 0.0), (1.41, 0.1, 3.0), (6.0, 0.1, 3.0), (0.5, 0.2, 180.0)],
)
def test_equal_faces_do_not_pass_each_other(height: float, shift: float, turn: float) -> None:
    """The two faces are shifted by up to ``shift`` of their circumradius, and rotated by up to ``turn`` degrees."""
    random, upper, lower = np.random.default_rng(1), [], []
    for k in range(MANY):
        place = np.array([APART * (k % 5), APART * (k // 5), 0.0])
        face = CORNERS @ turned(random.uniform(-turn, turn)) + random.uniform(-shift, shift, 2)
        upper.append(np.column_stack([face, np.full(3, 0.01)]) + place)
        lower.append(np.column_stack([CORNERS, np.zeros(3)]) + place)
    case = meeting_of([{"velocity": (0.0, 0.0, -50.0)}, {}], end=30e-6)
    seen = np.zeros(MANY)

    def look(sim, _):  # type: ignore[no-untyped-def]
        nodes = sim.model.nodes
        corners = np.concatenate([nodes.x[block.tets] for block in sim.model.blocks])
        for k in range(MANY if sim.clock.step % 20 == 0 else 0):
            seen[k] = max(seen[k], common(corners[k], corners[MANY + k]))

    run(build(case, [tets(upper, height), tets(lower, -height)]), look)
    assert seen.max() < 0.01
