"""Contacts of edges in a step: convex bodies that begin to overlap in the step always have a contact."""

import numpy as np
import pytest

from conoid.worker.contact.narrow_phase.edge_edge import beyond_ends
from conoid.worker.contact.narrow_phase.tables import DEEP, DEEP_SELF, NEAR, ContactRows

from ..worker.meshes import Floats
from .bodies import Indices, rotation
from .kernels import edge_edge, every_pair, lowest_heights, many, node_face

ONE = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, -1.0], [0.0, -1.0, -1.0]])
"""An edge along x on top of a body: its two ends, and the third nodes of its two faces."""
EDGES = np.array([[0, 1, 2, 3, 3, 2], [4, 5, 6, 7, 7, 6]], np.int32)
"""The two edges ``ONE``, (2, 6): the two ends, the third nodes of the two faces, and the opposite nodes."""
PAIR = np.array([[0, 1]], np.int32)


def turned(angle: float, width: float = 1.0) -> Floats:
    """Returns ``ONE`` upside down, at an angle about z, with faces of slope 1 / ``width``."""
    other = ONE * np.array([1.0, width, 1.0])
    return np.asarray(other @ rotation((1, 0, 0), np.pi).T @ rotation((0, 0, 1), angle).T)


def meets(
    gap: float = 0.1, speed: float = -0.2, angle: float = np.pi / 2, shift: tuple[float, float] = (0.0, 0.0),
    one: Floats = ONE, width: float = 1.0, tilt: float = 0.0,
) -> ContactRows:  # fmt: skip
    """Returns the contacts of two edges that are ``gap`` apart; the upper edge moves at ``speed`` for a step of 1 s;
    ``tilt`` turns the lower body.
    """
    lower = one @ rotation((1, 0, 0), tilt).T
    x = np.concatenate([lower, turned(angle, width) + np.array([*shift, gap])])
    v = np.concatenate([np.zeros((4, 3)), np.tile([0.0, 0.0, speed], (4, 1))])
    return edge_edge(x, v, EDGES, PAIR, 1.0)


@pytest.mark.parametrize("angle", [0.3, 0.5, 1.5, 2.5, -0.5])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, -0.2)])
def test_crossed_edges_that_pass_are_met_between_their_faces(angle: float, shift: tuple[float, float]) -> None:
    met = meets(angle=angle, shift=shift)
    assert many(met) == 1
    assert met.normals[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    x = np.concatenate([ONE, turned(angle) + np.array([*shift, 0.1])])
    rate = met.weights[0] @ x[met.nodes[0]]
    assert rate == pytest.approx([0.0, 0.0, 0.1], abs=1e-12)
    assert met.weights[0].sum() == pytest.approx(0.0, abs=1e-15)
    assert met.wanted[0] == pytest.approx(-0.1, abs=1e-12)


def test_the_order_of_the_two_edges_turns_the_normal_only() -> None:
    one = meets(angle=0.7, shift=(0.2, 0.1))
    x = np.concatenate([ONE, turned(0.7) + np.array([0.2, 0.1, 0.1])])
    v = np.concatenate([np.zeros((4, 3)), np.tile([0.0, 0.0, -0.2], (4, 1))])
    two = edge_edge(x, v, EDGES, PAIR[:, ::-1].copy(), 1.0)
    assert many(two) == 1
    assert two.nodes[0].tolist() == one.nodes[0, [2, 3, 0, 1]].tolist()
    assert two.normals == pytest.approx(-one.normals, abs=1e-14)
    assert two.weights[0] == pytest.approx(-one.weights[0, [2, 3, 0, 1]], abs=1e-14)
    assert two.wanted == pytest.approx(one.wanted, abs=1e-14)


def test_parallel_edges_are_left_to_nodes_and_faces() -> None:
    for angle in (0.0, 5e-4, np.pi, np.pi - 5e-4):
        assert many(meets(angle=angle)) == 0
    for angle in (2e-3, 0.04, np.pi - 2e-3, np.pi - 0.04):
        met = meets(angle=angle)
        assert many(met) == 1
        assert met.normals[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-10)


def test_edges_that_cross_beyond_an_end_do_not_meet() -> None:
    for shift in ((1.1, 0.0), (-1.1, 0.0), (0.0, 1.1), (0.0, -1.1)):
        assert many(meets(shift=shift)) == 0
    for shift in ((0.9, 0.0), (0.0, -0.9)):
        assert many(meets(shift=shift)) == 1


def crossings(ends: Floats) -> tuple[Floats, Floats]:
    """Returns the crossing points of the two edges of each of ``ends`` (..., 4, 3), as fractions of both lengths,
    (...).
    """
    u, w, r = ends[..., 1, :] - ends[..., 0, :], ends[..., 3, :] - ends[..., 2, :], ends[..., 2, :] - ends[..., 0, :]
    uu, uw, ww, ur, wr = ((a * b).sum(axis=-1) for a, b in ((u, u), (u, w), (w, w), (u, r), (w, r)))
    return (ww * ur - uw * wr) / (uu * ww - uw * uw), (uw * ur - uu * wr) / (uu * ww - uw * uw)


@pytest.mark.parametrize("seed", range(4))
def test_edges_that_cross_beyond_an_end_do_so_while_ends_move_by_less_than_the_bound(seed: int) -> None:
    """The ends of the two edges are near each other, at any angle. The bound is not far from the exact value: if ends
    move by 20 times as much, some edges cross between their ends.
    """
    random = np.random.default_rng(seed)
    ends = random.normal(size=(400, 4, 3))
    ends[:, 2] = ends[:, 0] + 10.0 ** random.uniform(-3.0, 0.0, (400, 1)) * random.normal(size=(400, 3))
    s, t = crossings(ends)
    x = np.array([
        beyond_ends(tuple(e[1] - e[0]), tuple(e[3] - e[2]), tuple(e[2] - e[0]), *at)
        for e, at in zip(ends, zip(s, t, strict=True), strict=True)
    ])  # fmt: skip
    apart = (np.minimum(s, t) < 0.0) | (np.maximum(s, t) > 1.0)
    assert apart.sum() > 200
    assert (x[apart] > 0.0).all()
    assert (x[~apart] == 0.0).all()
    ways = random.normal(size=(200, 4, 3))
    ways /= 2.0 * np.linalg.norm(ways, axis=-1, keepdims=True)
    for share, meet in ((1.0, False), (20.0, True)):
        s, t = crossings(ends[apart][:, None] + share * x[apart][:, None, None, None] * ways)
        assert ((np.minimum(s, t) >= 0.0) & (np.maximum(s, t) <= 1.0)).any() == meet


def test_edges_meet_where_they_cross_not_where_they_end_the_step() -> None:
    """The upper edge moves to the side in the same step, after it has passed the lower edge, or comes from the side."""
    x = np.concatenate([ONE, turned(np.pi / 2) + np.array([0.5, 0.0, 0.1])])
    for sideways, found in ((0.9, 1), (1.1, 0), (-1.0, 1)):
        v = np.concatenate([np.zeros((4, 3)), np.tile([sideways, 0.0, -0.2], (4, 1))])
        met = edge_edge(x, v, EDGES, PAIR, 1.0)
        assert many(met) == found
        if found:
            at = -(met.weights[0, 2:, None] * x[met.nodes[0, 2:]]).sum(axis=0)
            assert at == pytest.approx([0.5 + 0.5 * sideways, 0.0, 0.0], abs=1e-12)


def test_a_concave_edge_meets_nothing() -> None:
    assert many(meets(one=ONE * [1.0, 1.0, -1.0] @ np.diag([1.0, -1.0, 1.0]))) == 0


@pytest.mark.parametrize(("tilt", "found"), [(0.0, 1), (0.7, 1), (0.85, 0), (-0.7, 1), (-0.85, 0), (np.pi, 0)])
def test_an_edge_meets_only_what_comes_between_its_faces(tilt: float, found: int) -> None:
    """The faces of the lower edge have a slope of 45 degrees. If the lower body is turned by more than this slope, one
    face is directed upwards and has contacts with nodes.
    """
    assert many(meets(tilt=tilt)) == found


@pytest.mark.parametrize(
    ("gap", "speed", "found"),
    [
        (0.5, -0.4, 0), (0.5, -0.6, 1), (1.9 * NEAR, 0.0, 1), (2.1 * NEAR, 0.0, 0), (1.9 * NEAR, 1.0, 0),
        (-1.4 * DEEP, 0.0, 1), (-1.42 * DEEP, 0.0, 0), (-1.4 * DEEP, -0.5, 1),
    ],
)  # fmt: skip
def test_edges_meet_when_they_pass_or_are_near_and_not_too_deep(gap: float, speed: float, found: int) -> None:
    """The edges are 2 m long and belong to tets of height sqrt(2)."""
    assert many(meets(gap=gap, speed=speed)) == found


@pytest.mark.parametrize(("gap", "found"), [(-0.95 * DEEP_SELF, 1), (-1.05 * DEEP_SELF, 0)])
def test_edges_of_flat_tets_hold_to_a_share_of_their_length(gap: float, found: int) -> None:
    """The edges are 2 m long, and their tets are ten times flatter than those of the previous test."""
    flat = np.array([1.0, 1.0, 0.1])
    x = np.concatenate([ONE * flat, turned(np.pi / 2) * flat + np.array([0.0, 0.0, 2.0 * gap])])
    assert many(edge_edge(x, np.zeros((8, 3)), EDGES, PAIR, 1.0)) == found


@pytest.mark.parametrize("thick", [0.6, 0.9, 1.5, 6.0])
@pytest.mark.parametrize("which", [0, 1])
def test_edges_between_two_tets_hold_to_a_quarter_of_the_lower_one(thick: float, which: int) -> None:
    """One of the two tets below the edge ``ONE`` is ``thick``; the upper edge belongs to a tet four times as large."""
    apexes = np.array([[0.0, 0.5, -0.5], [0.0, -0.5, -0.5]]) - 4.0 * np.array([[0.0, 1.0, 1.0], [0.0, -1.0, 1.0]])
    apexes[which] *= thick / 6.0
    edges = EDGES.copy()
    edges[0, 4:] = 8, 9
    heights = lowest_heights(np.array([[ONE[0], ONE[1], ONE[2 + k], apexes[k]] for k in (0, 1)]))
    limit = DEEP * min(*heights, 2.0)
    assert limit > DEEP_SELF * 2.0
    for share, found in ((0.99, 1), (1.01, 0)):
        upper = turned(np.pi / 2) * 4.0 - np.array([0.0, 0.0, share * limit])
        x = np.concatenate([ONE, upper, apexes])
        assert many(edge_edge(x, np.zeros((10, 3)), edges, PAIR, 1.0)) == found


@pytest.mark.parametrize("order", [1, -1])
def test_the_opposite_edges_of_a_flat_tet_do_not_meet(order: int) -> None:
    """The two edges are behind each other by the thickness of the tet; two such edges of two different tets have passed
    each other.
    """
    flat = np.array([[-1.0, 0.0, 0.01], [1.0, 0.0, 0.01], [0.0, -1.0, -0.01], [0.0, 1.0, -0.01]])
    one, two = [0, 1, 3, 2, 2, 3], [2, 3, 1, 0, 0, 1]
    v = np.zeros((8, 3))
    alone = np.array([one, two], np.int32)[::order].copy()
    assert many(edge_edge(np.concatenate([flat, flat]), v, alone, PAIR, 1.0, never=1)) == 0
    apart = np.array([one, [k + 4 for k in two]], np.int32)[::order].copy()
    assert many(edge_edge(np.concatenate([flat, flat]), v, apart, PAIR, 1.0)) == 1


def test_the_target_velocity_ends_the_step_with_edges_that_touch() -> None:
    for gap, speed in ((0.1, -0.5), (-0.05, -0.5)):
        met = meets(gap=gap, speed=speed, angle=0.8)
        assert gap + 1.0 * met.wanted[0] == pytest.approx(0.9 * min(gap, 0.0), abs=1e-12)


TETS = np.array([[0, 1, 2, 3], [4, 5, 6, 7]], np.int32)
_OUT = ((1, 2, 3, 0), (0, 3, 2, 1), (0, 1, 3, 2), (0, 2, 1, 3))


def surface_of(tet: "np.ndarray") -> tuple[Indices, Indices]:
    """Returns faces and edges of a tet with positive volume that has the given nodes, in the form of the worker."""
    faces = np.array([[tet[k] for k in row] for row in _OUT], np.int32)
    edges = []
    for i in range(4):
        for j in range(i + 1, 4):
            (c,) = (_third(f, i, j) for f in _OUT if _runs(f, i, j))
            (d,) = (_third(f, i, j) for f in _OUT if _runs(f, j, i))
            edges.append([tet[i], tet[j], tet[c], tet[d], tet[d], tet[c]])
    return faces, np.array(edges, np.int32)


def _runs(face: tuple[int, ...], i: int, j: int) -> bool:
    return any(face[k] == i and face[(k + 1) % 3] == j for k in range(3))


def _third(face: tuple[int, ...], i: int, j: int) -> int:
    return next(k for k in face[:3] if k not in (i, j))


FACES = np.concatenate([surface_of(tet)[0] for tet in TETS])
RIDGES = np.concatenate([surface_of(tet)[1] for tet in TETS])


def overlap(x: Floats, y: Floats) -> bool:
    """Returns whether two tets (4, 3) have a common point: no face and no two edges give a separating plane."""
    sides = [np.array([p[j] - p[i] for i in range(4) for j in range(i + 1, 4)]) for p in (x, y)]
    axes = [np.cross(p[[1, 0, 0, 0]] - p[[2, 3, 1, 2]], p[[3, 2, 3, 1]] - p[[2, 3, 1, 2]]) for p in (x, y)]
    axes.append(np.cross(sides[0][:, None], sides[1][None]).reshape(-1, 3))
    every = np.concatenate(axes)
    one, two = x @ every.T, y @ every.T
    return not ((one.max(axis=0) < two.min(axis=0)) | (two.max(axis=0) < one.min(axis=0))).any()


def approach(random: np.random.Generator) -> tuple[Floats, Floats]:
    """Returns two tets shortly before contact, and the motion (3,) of the second tet with which the tets begin to
    overlap.
    """
    while True:
        pair = random.normal(size=(2, 4, 3))
        volumes = np.linalg.det(pair[:, 1:] - pair[:, :1])
        if np.abs(volumes).min() > 0.6:
            break
    pair[volumes < 0.0] = pair[volumes < 0.0][:, [0, 1, 3, 2]]
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    aim = pair[0].mean(axis=0) - pair[1].mean(axis=0) + 0.5 * random.normal(size=3)
    far, near = 20.0, 0.0
    if not overlap(pair[0], pair[1] + aim):
        return approach(random)
    for _ in range(30):
        middle = 0.5 * (far + near)
        far, near = (far, middle) if overlap(pair[0], pair[1] + aim - middle * way) else (middle, near)
    pair[1] += aim - far * way
    return pair.reshape(8, 3), way


def meet(x: Floats, step: Floats) -> tuple[int, int]:
    """Returns the number of contacts of nodes and the number of contacts of edges when the second tet moves by
    ``step``.
    """
    v = np.concatenate([np.zeros((4, 3)), np.tile(step, (4, 1))])
    pairs = [every_pair(TETS[i], 4) + np.array([0, 4 * (1 - i)], np.int32) for i in (0, 1)]
    nodes = sum(many(node_face(x, v, FACES, p, 1.0, np.repeat([0, 1], 4))) for p in pairs)
    return nodes, many(edge_edge(x, v, RIDGES, every_pair(np.arange(6), 6) + np.array([0, 6], np.int32), 1.0))


def lowest_altitude(x: Floats) -> float:
    """Returns the lowest altitude of two tets with the given corners, m."""
    return float(lowest_heights(x[TETS]).min())


@pytest.mark.parametrize(("share", "late"), [(0.5, 3), (0.05, 0)])
def test_convex_bodies_that_come_to_overlap_in_a_step_meet_in_it(share: float, late: int) -> None:
    """Random tets move in random directions by a fraction of their lowest altitude (contact allows at most half of it
    in a step). Half of the collisions begin only between two edges. Edges that do not cross in a step are tested only
    at the end of the step: with the longest steps one pair in a thousand is found one step later.
    """
    random, alone, missed = np.random.default_rng(1), 0, 0
    for _ in range(200):
        x, way = approach(random)
        step = share * lowest_altitude(x) * way
        x[4:] -= random.uniform(0.02, 0.98) * step
        nodes, edges = meet(x, step)
        alone += nodes == 0
        if nodes + edges == 0:
            missed += 1
            x[4:] += step
            assert sum(meet(x, step)) > 0
    assert alone > 60
    assert missed <= late
