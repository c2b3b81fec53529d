"""Nodes inside of other bodies are found, and the depths of these nodes are computed."""

import numpy as np
import pytest

from conoid.worker.contact.checks.inside import Inside, _depths, _from_edges, _from_faces, look
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from ..worker.kernels import build
from ..worker.meshes import block
from .bodies import meeting_of, moved

SIZE = 1e-3


def sunk(depth: float) -> Simulation:
    """Returns a small block that penetrates the top of a larger block by ``depth``, m, between four nodes of the larger
    block.
    """
    lower, upper = block((4, 4, 4), SIZE, shake=0.0), block((2, 2, 2), 0.4 * SIZE, shake=0.0)
    case = meeting_of([{}, {}], end=2e-7)
    sim = build(case, [lower, moved(upper, (1.13 * SIZE, 1.08 * SIZE, 4.5 * SIZE))])
    sim.model.nodes.x[sim.model.nodes.part == 1, 2] -= 0.5 * SIZE + depth
    return sim


def seen(sim: Simulation) -> Inside:
    assert sim.contact is not None
    return look(sim.contact, sim.model, None, SerialComm())


@pytest.mark.parametrize("depth", [-0.1 * SIZE, 0.0, 0.01 * SIZE])
def test_separate_touching_or_hardly_deep_bodies_are_not_inside(depth: float) -> None:
    found = seen(sunk(depth))
    assert (found.nodes, found.buried, found.deepest) == (0, 0, 0.0)
    assert found.warnings == []


@pytest.mark.parametrize("depth", [0.2 * SIZE, 0.3 * SIZE])
def test_the_lower_nodes_of_a_block_are_as_deep_as_it_has_sunk(depth: float) -> None:
    """Nine nodes are inside of the other block. For nodes in tets without a face on top, the depth is the distance from
    the nearest face of the tet, which may be small.
    """
    sim = sunk(depth)
    found = seen(sim)
    assert sim.contact is not None
    assert found.tested == 5**3 - 3**3 + 3**3 - 1
    assert 0 < found.nodes <= 9
    assert found.buried == 0
    assert found.deepest * sim.contact.exterior.size == pytest.approx(depth, rel=1e-9)


def test_a_node_below_the_outermost_tets_counts_as_inside() -> None:
    """The middle of the larger block consists of tets that have no corner on its surface."""
    found = seen(sunk(2.0 * SIZE))
    assert found.nodes > 9
    assert found.buried > 0
    [line] = found.warnings
    assert line.startswith(f"{found.nodes} of {found.tested} nodes are inside of other bodies")
    assert f"{found.buried} of them deeper than the outermost tets" in line


@pytest.mark.parametrize(("depth", "buried"), [(0.025 * SIZE, False), (0.1 * SIZE, True)])
def test_a_node_that_touches_a_surface_of_flat_tets_is_not_inside(depth: float, buried: bool) -> None:
    """The top layer of the larger block is compressed to a hundredth: the tets below this layer have no corner on the
    surface.
    """
    sim = sunk(depth)
    x, part = sim.model.nodes.x, sim.model.nodes.part
    x[(part == 0) & (x[:, 2] > 3.5 * SIZE), 2] -= 0.99 * SIZE
    x[part == 1, 2] -= 0.99 * SIZE
    assert (seen(sim).buried > 0) == buried
    assert (seen(sim).nodes > 0) == buried


def test_fragments_of_one_part_are_treated_as_bodies() -> None:
    """The body consists of two separate halves. An unbroken body has no nodes inside of itself."""
    sim = sunk(0.3 * SIZE)
    assert sim.contact is not None
    one = [np.zeros(b.n, np.int64) for b in sim.model.blocks]
    assert look(sim.contact, sim.model, one, SerialComm()).nodes == 0
    apart = [np.full(b.n, 7 * k, np.int64) for k, b in enumerate(sim.model.blocks)]
    assert look(sim.contact, sim.model, apart, SerialComm()) == seen(sim)
    assert seen(sim).nodes > 0


def test_parts_that_do_not_meet_may_be_in_each_other() -> None:
    case = meeting_of([{}, {}], {"parts": ("body0",)}, end=2e-7)
    sim = build(case, [block((4, 4, 4), SIZE), moved(block((2, 2, 2), 0.6 * SIZE), (SIZE, SIZE, SIZE))])
    assert seen(sim).nodes == 0


def test_nodes_on_faces_between_tets_are_inside() -> None:
    """A cube penetrates an equal cube: all nodes of each cube are on edges and faces of tets of the other cube. The
    nodes in the middle of the two faces and of the body are only on edges and faces of tets.
    """
    cube = block((2, 2, 2), SIZE, shake=0.0)
    sim = build(meeting_of([{}, {}], end=2e-7), [cube, moved(cube, (0.0, 0.0, 2.0 * SIZE))])
    sim.model.nodes.x[sim.model.nodes.part == 1, 2] -= 0.3 * SIZE
    found = seen(sim)
    assert sim.contact is not None
    assert found.nodes >= 2
    assert found.deepest * sim.contact.exterior.size == pytest.approx(0.3 * SIZE, rel=1e-9)


def test_no_node_is_deeper_than_it_is_away_from_a_corner_on_the_surface() -> None:
    """The only open face of the tet is far from the node; at the other corner of the tet the surface belongs to
    neighbouring tets.
    """
    corners = np.vstack([np.zeros(3), np.eye(3)])[None]
    opened, outer = np.array([[True, False, False, False]]), np.array([[False, True, True, True]])
    near = np.full((1, 3), 0.1)
    assert _depths(near, corners, opened, outer) == pytest.approx(0.7 / np.sqrt(3.0))
    assert _depths(near, corners, opened, outer | True) == pytest.approx(0.1 * np.sqrt(3.0))
    assert _depths(-near, corners, opened, outer) == pytest.approx(-1.0)


def test_how_far_points_are_from_triangles() -> None:
    """The points are above the middle of a triangle, beyond its edge, behind its corner, and near a triangle of zero
    area.
    """
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = np.array([[0.2, 0.2, -0.3], [0.5, -0.4, 0.3], [-3.0, 0.0, 4.0], [0.5, 0.0, 2.0]])
    corners = np.array([triangle, triangle, triangle, triangle[[0, 1, 1]]])
    assert _from_faces(points, corners) == pytest.approx([0.3, 0.5, 5.0, 2.0])


def test_a_node_on_an_edge_between_two_corners_on_the_surface_touches() -> None:
    """The tet has an open face elsewhere, and the node is deep below this open face."""
    corners, on = np.concatenate([np.zeros((1, 3)), np.eye(3)])[None], np.array([[0.4, 0.0, 0.0]])
    opened, outer = np.array([[False, True, False, False]]), np.ones((1, 4), bool)
    assert _depths(on, corners, opened, outer) == pytest.approx(0.4)
    assert _from_edges(on, corners, outer) == pytest.approx(0.0)
    assert _from_edges(on, corners, np.array([[True, False, True, True]])) == pytest.approx(0.4)
    assert _from_edges(on, corners, np.array([[True, False, False, False]])) == np.inf
