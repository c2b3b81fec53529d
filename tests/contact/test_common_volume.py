"""The common volume of bodies or fragments is measured, with and without nodes inside of the other body."""

import numpy as np
import pytest

from conoid.worker.contact.checks.common_volume import CommonVolume, intersection, measure
from conoid.worker.mesh.model import TetMesh
from conoid.worker.model.state import Floats
from conoid.worker.simulation import Simulation

from ..worker.kernels import build
from ..worker.meshes import block
from ..worker.simulations import on
from .bodies import meeting_of, moved

CORNER = np.vstack([np.zeros(3), np.eye(3)])
REGULAR = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]])


def common(one: Floats, other: Floats) -> float:
    """Returns the common volume of two tets divided by the volume of the first tet."""
    rooms = np.empty((2, 81, 4, 3))
    whole = float(np.linalg.det(one[1:] - one[:1]))
    return float(intersection(rooms[0], rooms[1], np.ascontiguousarray(one), np.ascontiguousarray(other))) / whole


@pytest.mark.parametrize(
    ("one", "other", "share"),
    [
        (CORNER, CORNER, 1.0),
        (CORNER, CORNER + np.array([0.25, 0.0, 0.0]), 0.75**3),
        (CORNER, CORNER + 0.1, 0.7**3),
        (CORNER, 0.5 * CORNER, 0.125),
        (0.5 * CORNER, CORNER, 1.0),
        (CORNER, CORNER + np.array([1.0, 0.0, 0.0]), 0.0),
        (CORNER, CORNER + np.array([5.0, 0.0, 0.0]), 0.0),
        (REGULAR, -REGULAR[[0, 1, 3, 2]], 0.5),  # the octahedron that is common to the two tets of a stella octangula
        (CORNER, np.array([[0.2, 0.2, -1.0], [0.25, 0.2, -1.0], [0.2, 0.25, -1.0], [0.2, 0.2, 9.0]]), None),
    ],
)
def test_what_two_tets_have_in_common(one: Floats, other: Floats, share: float | None) -> None:
    """The expected common volume, if it is not given, is counted with points on a fine grid. The common volume is found
    even if no node of a tet is in the other tet.
    """
    both = (
        common(one, other),
        common(other, one) * np.linalg.det(other[1:] - other[:1]) / np.linalg.det(one[1:] - one[:1]),
    )
    assert both[0] == pytest.approx(both[1], rel=1e-12, abs=1e-15)
    assert both[0] == pytest.approx(
        sampled(one, other) if share is None else share, rel=2e-3 if share is None else 1e-12
    )


def sampled(one: Floats, other: Floats) -> float:
    """Returns the common volume counted with the points of a grid."""
    low, high, n = other.min(axis=0), other.max(axis=0), 120
    low, high = np.maximum(low, one.min(axis=0)), np.minimum(high, one.max(axis=0))
    axes = [a + (np.arange(n) + 0.5) / n * (b - a) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.ones(len(points), bool)
    for tet in (one, other):
        tail = np.linalg.solve((tet[1:] - tet[0]).T, (points - tet[0]).T).T
        inside &= (tail >= 0.0).all(axis=1) & (tail.sum(axis=1) <= 1.0)
    return float(inside.mean() * np.prod(high - low) / (np.linalg.det(one[1:] - one[0]) / 6.0))


def test_random_tets_by_points_of_a_grid() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        one, other = (turned(rng.normal(size=(4, 3))) for _ in range(2))
        assert common(one, other) == pytest.approx(sampled(one, other), abs=3e-3)


def turned(tet: Floats) -> Floats:
    """Returns the corners of a tet, in an order with positive volume."""
    return tet if np.linalg.det(tet[1:] - tet[:1]) > 0.0 else tet[[0, 2, 1, 3]]


CASE = meeting_of([{}, {}], end=2e-7)
LOWER, UPPER = block((4, 4, 4), 1e-3, shake=0.0), moved(block((2, 2, 2), 1e-3, shake=0.0), (1.13e-3, 1.08e-3, 4.5e-3))


def sunk(sim: Simulation, depth: float) -> CommonVolume:
    """Returns the result for a block of 2 x 2 mm that penetrates the top of a block of 4 x 4 mm by ``depth``, m."""
    sim.model.nodes.x[sim.model.nodes.part == 1, 2] -= 0.5e-3 + depth
    return seen(sim)


def seen(sim: Simulation) -> CommonVolume:
    assert sim.contact is not None
    return measure(sim.contact, sim.model, None, sim.comm)


@pytest.mark.parametrize("depth", [-0.1e-3, 0.0, 0.02e-3, 0.3e-3, 0.9e-3])
def test_a_block_that_has_sunk_into_another(depth: float) -> None:
    """The whole common volume is in tets of both blocks with a corner on the surface: the volume counts twice."""
    found, deep = sunk(build(CASE, [LOWER, UPPER]), depth), max(depth, 0.0)
    whole = 4.0**3 - core() + 8.0
    assert found.share * whole == pytest.approx(2 * 4.0 * deep / 1e-3, rel=1e-6)
    assert bool(found.warnings) == (depth > 0.1e-3)
    assert (found.large > 0) == (depth > 0.1e-3)


def core() -> float:
    """Returns the volume of those tets of the larger block that have no corner on its surface, mm^3."""
    outer = np.any((LOWER.points < 1e-9) | (LOWER.points > 4e-3 - 1e-9), axis=1)
    return float((~np.asarray(outer)[LOWER.tets].any(axis=1)).sum()) / 6.0


@pytest.mark.parametrize("ranks", [2, 5])
def test_no_cut_changes_a_bit(ranks: int) -> None:
    found = on(ranks, CASE, [LOWER, UPPER], lambda sim: sunk(sim, 0.3e-3))
    assert found == ranks * [sunk(build(CASE, [LOWER, UPPER]), 0.3e-3)]


def test_bars_that_cross_without_a_node_inside() -> None:
    thin = np.array([0.2, 1.0, 0.2])
    bar = block((1, 4, 1), 1e-3, shake=0.0)
    one = TetMesh(bar.points * thin, bar.tets)
    other = TetMesh(one.points[:, [1, 0, 2]] + [-1.9e-3, 1.9e-3, 0.1e-3], one.tets[:, [0, 2, 1, 3]])
    sim = build(meeting_of([{}, {}], {"overlap": "push"}, end=2e-7), [one, moved(other, (0.0, 0.0, 1e-3))])
    sim.model.nodes.x[sim.model.nodes.part == 1, 2] -= 1e-3
    found = seen(sim)
    assert found.share == pytest.approx(2 * 0.2 * 0.2 * 0.1 / (2 * 0.2 * 0.2 * 4.0), rel=1e-9)
    assert found.largest > 0.1


def test_loose_tets_of_one_part_that_meets_itself() -> None:
    """Without fracture there are no fragments; the common volume of tets without a common node counts."""
    mesh = block((2, 1, 1), 1e-3, shake=0.0)
    loose = TetMesh(mesh.points[mesh.tets].reshape(-1, 3), np.arange(4 * len(mesh.tets), dtype=np.int32).reshape(-1, 4))
    centres = np.repeat(loose.points.reshape(-1, 4, 3).mean(axis=1), 4, axis=0)
    sim = build(meeting_of([{}], {"self_contact": ("body0",)}, end=2e-7), [TetMesh(loose.points + centres, loose.tets)])
    sim.model.nodes.x[:] -= centres
    assert seen(sim).share < 1e-12
    whole = build(meeting_of([{}], {"self_contact": ("body0",)}, end=2e-7), [mesh])
    assert seen(whole) == CommonVolume(len(mesh.tets), 0, 0.0, 0.0)
    sim.model.nodes.x[:] = loose.points + 0.1 * (loose.points - centres)
    assert seen(sim).share > 0.1
