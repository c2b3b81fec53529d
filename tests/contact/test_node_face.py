"""Contacts of nodes and faces in a step: choice of the contacts, contact point, and target velocity."""

import numpy as np
import pytest

from conoid.worker.contact.broad_phase import search
from conoid.worker.contact.broad_phase.boxes import Primitives
from conoid.worker.contact.geometry import MARGIN
from conoid.worker.contact.narrow_phase.facing import RIM, TOUCHING
from conoid.worker.contact.narrow_phase.tables import DEEP, DEEP_SELF, NEAR, PUSH_OUT, ContactRows
from conoid.worker.contact.surface import normals
from conoid.worker.mesh.faces import FACES
from conoid.worker.parallel.team import team

from ..worker.meshes import Floats, block
from .bodies import Indices, meeting_of, nodes_of, pieces_of, sheet, surface_of
from .distances import point_triangle
from .kernels import every_pair, face_sizes, many, node_face

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, -1.0]])
FACE = np.array([[0, 1, 2, 3]], np.int32)
SIZE = 1.0


def height(x: Floats, corners: Floats) -> tuple[float, Floats]:
    """Returns the height of a point above a face, and the unit normal of the face."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    return float(normal @ (x - corners[0])), normal


def foot(x: Floats, corners: Floats) -> Floats:
    """Returns the area coordinates of the point in the plane of a face that is nearest to ``x``."""
    sides = (corners[1:3] - corners[0]).T
    b = np.linalg.lstsq(sides, x - corners[0], rcond=None)[0]
    return np.array([1.0 - b.sum(), *b])


class Expected:
    """Contact of the node ``s`` with a face by the formulas of the docstrings of the kernels."""

    def __init__(self, x: Floats, v: Floats, s: int, face: "np.ndarray", size: float, own: bool, dt: float) -> None:
        three, then = face[:3], x + dt * v
        self.nodes = np.array([s, *three])
        self.gap0 = height(x[s], x[three])[0]
        self.gap1, self.normal = height(then[s], then[three])
        deep = min((DEEP_SELF if own else DEEP) * size, 0.5 * -height(x[face[3]], x[three])[0])
        share = 0.0 if self.gap0 <= 0.0 else min(self.gap0 / (self.gap0 - self.gap1), 1.0) if self.gap1 < 0.0 else 1.0
        at = x + share * dt * v
        b = foot(at[s], at[three])
        self.meets = self.gap1 <= NEAR * size and self.gap0 >= -deep and b.min() >= -MARGIN
        self.weights = np.array([1.0, *-(np.maximum(b, 0.0) / np.maximum(b, 0.0).sum())])
        speed = float(self.normal @ (self.weights @ v[[s, *three]]))
        depth = max(-self.gap0, 0.0)
        back = PUSH_OUT * min(depth / dt, max(-speed, 0.0))
        self.wanted = speed - (depth + self.gap1) / dt + back
        self.deep = self.gap0 < -TOUCHING * size


def random_scene(seed: int, nodes: int = 40, faces: int = 12) -> tuple[Floats, Floats, Indices, "np.ndarray"]:
    """Returns moving nodes around moving faces of sizes 10:1; a third of the nodes belongs to the part of the faces."""
    random = np.random.default_rng(seed)
    size = 10.0 ** random.uniform(-0.5, 0.5, (faces, 1, 1))
    tets = TRIANGLE[None] * size * random.uniform(0.5, 1.5, (faces, 1, 3)) + random.uniform(-0.3, 0.3, (faces, 1, 3))
    points = random.uniform(-0.2, 0.8, (nodes, 3)) * np.array([1.0, 1.0, 0.5])
    x = np.concatenate([tets.reshape(-1, 3), points])
    v = random.normal(size=x.shape) * 10.0 ** random.uniform(-2.0, 0.5, (len(x), 1))
    part = np.concatenate([np.zeros(4 * faces), random.integers(0, 3, nodes)])
    return x, v, np.arange(4 * faces, dtype=np.int32).reshape(faces, 4), part.astype(np.int32)


def expected(
    x: Floats, v: Floats, faces: Indices, part: "np.ndarray", tested: "np.ndarray", dt: float
) -> list[Expected]:
    """Returns the contacts sorted by node, then by face. A node inside of several faces of a part has contact with the
    nearest face. A node has no contact with a part if the node is nearer to the front of another face of this part.
    """
    sizes, rows = face_sizes(x, faces), []
    for s in tested:
        mine = [Expected(x, v, s, f, sizes[i], part[s] == part[f[0]], dt) for i, f in enumerate(faces)]
        away = point_triangle(x[s][None], x[faces[:, :3]])[0]
        deepest = [DEEP_SELF if part[s] == part[f[0]] else DEEP for f in faces]
        ahead = [away[i] for i, row in enumerate(mine) if row.gap0 > 0.0 and away[i] < deepest[i] * sizes[i]]
        mine = [row for row in mine if row.meets and not (row.deep and min(ahead, default=np.inf) < -row.gap0)]
        deep = [row for row in mine if row.deep]
        nearest = max(deep, key=lambda row: row.gap0, default=None)
        rows += [row for row in mine if not row.deep or row is nearest]
    return rows


def test_a_node_inside_of_two_parts_is_held_by_the_nearest_face_of_each() -> None:
    """A corner of a body is in two other bodies: 0.05 and 0.1 below two faces of the first body, and 0.02 below a face
    of the second body.
    """
    steep = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0.2, 0.2]], float)
    first, second = TRIANGLE + np.array([-0.3, -0.3, 0.05]), steep + np.array([0.02, -0.3, -0.3])
    x = np.concatenate([first, first + np.array([0.0, 0.0, 0.05]), second, np.zeros((1, 3))])
    part = np.array([0] * 8 + [1] * 4 + [2], np.int32)
    faces = np.arange(12, dtype=np.int32).reshape(3, 4)
    got = node_face(x, np.zeros_like(x), faces, every_pair(np.array([12]), 3), 1e-3, part, mu=np.zeros((3, 3)))
    assert sorted(got.nodes.tolist()) == [[12, 0, 1, 2], [12, 8, 9, 10]]


@pytest.mark.parametrize("dt", [1.0, 0.1, 1e-3])
def test_contacts_are_those_of_the_formulas(dt: float) -> None:
    count = 0
    for seed in range(8):
        x, v, faces, part = random_scene(seed)
        tested = np.arange(4 * len(faces), len(x))
        got = node_face(
            x, v, faces, every_pair(tested, len(faces)), dt, part, mu=np.repeat([[1.0], [2.0], [3.0]], 3, axis=1)
        )
        want = sorted(expected(x, v, faces, part, tested, dt), key=lambda row: tuple(row.nodes))
        order = np.lexsort(got.nodes.T[::-1])
        assert got.nodes[order].tolist() == [row.nodes.tolist() for row in want]
        assert got.weights[order] == pytest.approx(np.array([row.weights for row in want]), abs=1e-9)
        assert got.normals[order] == pytest.approx(np.array([row.normal for row in want]), abs=1e-9)
        assert got.wanted[order] == pytest.approx(np.array([row.wanted for row in want]), rel=1e-9, abs=1e-9 / dt)
        assert (got.friction == 1.0 + part[got.nodes[:, 0]]).all()
        assert np.abs(got.weights.sum(axis=1)).max() < 1e-14
        assert np.linalg.norm(got.normals, axis=1) == pytest.approx(1.0, abs=1e-14)
        count += many(got)
    assert count > 150


@pytest.mark.parametrize("gap", [0.3, 0.0, -0.05, -0.2])
def test_the_target_velocity_ends_the_step_on_the_face_or_corrects_a_tenth_of_the_depth(gap: float) -> None:
    x = np.concatenate([TRIANGLE, [[0.3, 0.25, gap]]])
    v = np.zeros_like(x)
    v[4] = 0.5, -0.2, -7.0
    dt = 0.1
    met = node_face(x, v, FACE, every_pair(np.array([4]), 1), dt)
    assert many(met) == 1
    rate = met.weights[0] @ v[met.nodes[0]] @ met.normals[0]
    v[4] += (met.wanted[0] - rate) * met.normals[0]
    assert height((x + dt * v)[4], (x + dt * v)[:3])[0] == pytest.approx(0.9 * min(gap, 0.0), abs=1e-14)


def met_from(start: Floats, speed: Floats, dt: float = 1.0, own: bool = False, below: float = -1.0) -> ContactRows:
    """Returns the contacts of one node with the triangle of a tet that reaches down to ``below``."""
    x = np.concatenate([TRIANGLE, start[None]])
    x[3, 2] = below
    v = np.concatenate([np.zeros((4, 3)), speed[None]])
    return node_face(x, v, FACE, every_pair(np.array([4]), 1), dt, np.array([0, 0, 0, 0, 0 if own else 1]))


@pytest.mark.parametrize(
    ("gap", "own", "below", "meets"),
    [
        (-0.99 * DEEP, False, -1.0, True), (-1.01 * DEEP, False, -1.0, False),
        (-0.99 * DEEP_SELF, True, -1.0, True), (-1.01 * DEEP_SELF, True, -1.0, False),
        (-0.099, False, -0.2, True), (-0.101, False, -0.2, False),
    ],
)  # fmt: skip
def test_a_node_deeper_than_the_limit_has_no_contact(gap: float, own: bool, below: float, meets: bool) -> None:
    """The limits of the depth are a quarter of the size of the face, a twentieth within one part, and half the height
    of the tet of the face.
    """
    assert (many(met_from(np.array([0.3, 0.3, gap]), np.zeros(3), own=own, below=below)) == 1) == meets


@pytest.mark.parametrize(("gap", "meets"), [(0.99 * NEAR, True), (1.01 * NEAR, False)])
def test_a_node_that_stays_near_is_watched(gap: float, meets: bool) -> None:
    assert (many(met_from(np.array([0.3, 0.3, gap]), np.zeros(3))) == 1) == meets


@pytest.mark.parametrize(
    ("faces", "meets"),
    [
        ([(0, 0, -1.0)], True), ([(0, 0, 1.0)], False), ([(1.0, 0, 0)], False), ([(0, 0, 0)], True),
        ([(1.0, 0, 0), (0, 0, 1.0)], False), ([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)], False),
        ([(1.0, 0, 0), (0, 0, -1.0)], True), ([(0.6, 0, 0.8), (0.6, 0, -0.8)], True),
        ([(0.96, 0.28, 0), (0.96, -0.28, 0)], False),
    ],
)  # fmt: skip
def test_a_node_is_in_contact_with_the_faces_that_it_faces(faces: list[tuple[float, ...]], meets: bool) -> None:
    """The rim of a bar has no contact with the side of another bar of the same width; the surface below a block has no
    contact with the front of the block. A blunt and a sharp edge, and a node without faces, have contact.
    """
    x, v = np.concatenate([TRIANGLE, [[0.3, 0.3, -0.01]]]), np.zeros((5, 3))
    out = np.zeros((5, len(faces), 3))
    out[4] = faces
    assert (many(node_face(x, v, FACE, every_pair(np.array([4]), 1), 1.0, out=out)) == 1) == meets


FLAKE = np.array([[0.0, 0.0, 0.0], [-0.9, 0.9, 0.3], [-0.2, -0.9, 0.4], [-0.8, -0.7, 0.9]])
"""A tet whose first corner is its lowest corner; the cosines of the faces at this corner, -0.82, 0.73 and 0.76, have a
mean of 0.25."""


@pytest.mark.parametrize(("height", "own"), [(0.01, True), (0.01, False), (-0.01, True), (-0.1, False)])
def test_the_lowest_corner_of_a_flake_meets_what_it_enters(height: float, own: bool) -> None:
    """The mean of the cosines may have any value; the corner is tested before it is inside of the other body and when
    it is inside.
    """
    x, v = np.concatenate([TRIANGLE, FLAKE + np.array([0.3, 0.3, height])]), np.zeros((8, 3))
    v[4:, 2] = -0.05
    sums, faces = np.zeros((8, normals.COLUMNS), np.int64), (FACES + 4).astype(np.int32)
    normals.add(sums, normals.shares(x, faces, SIZE), faces)
    part, every, means = np.array([0] * 4 + [0 if own else 1] * 4), np.arange(8, dtype=np.int32), np.zeros((8, 12))
    normals.MeanNormals(team(1)).means(means, every, sums, every)
    met = node_face(x, v, FACE, every_pair(np.array([4]), 1), 1.0, part, normals=means)
    assert many(met) == 1


@pytest.mark.parametrize(("height", "own", "meets"), [(0.01, False, True), (0.01, True, False), (-0.1, False, False)])
def test_a_node_of_another_part_meets_what_it_passes_from_outside(height: float, own: bool, meets: bool) -> None:
    """At least one normal of the node is opposite to the face, although the mean normal is not, and the faces of the
    node do not rise.
    """
    x, v, out = np.concatenate([TRIANGLE, [[0.3, 0.3, height]]]), np.zeros((5, 3)), np.zeros((5, 3, 3))
    v[4, 2], out[4] = -0.05, [(0.6, 0.0, 0.8), (-0.6, 0.0, 0.8), (0.0, 0.8, -0.6)]
    part = np.array([0] * 4 + [0 if own else 1])
    assert (many(node_face(x, v, FACE, every_pair(np.array([4]), 1), 1.0, part, out=out)) == 1) == meets


def test_a_node_beside_an_acute_edge_is_not_inside() -> None:
    """The node is below the plane of a face, with its foot on the face, but in front of another face at an acute angle
    to the first face.
    """
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.9, -0.7], [0.45, 0.0, -0.1]])
    faces = np.array([[0, 1, 2, 3], [0, 3, 1, 2], [1, 3, 2, 0], [0, 2, 3, 1]], np.int32)
    x[4, 1] = 0.02
    assert many(node_face(x, np.zeros_like(x), faces[:1], every_pair(np.array([4]), 1), 1.0)) == 1
    assert many(node_face(x, np.zeros_like(x), faces, every_pair(np.array([4]), 4), 1.0)) == 0
    x[4, 1] = 0.25
    assert many(node_face(x, np.zeros_like(x), faces, every_pair(np.array([4]), 4), 1.0)) == 1


def test_a_node_in_a_convex_corner_is_held_by_the_nearest_face() -> None:
    """The node is in the corner of a cube, where three faces have a common node: deep, or by less than the tolerance of
    a node on a face.
    """
    ((piece, model),) = pieces_of(meeting_of([{}], {"self_contact": ("body0",)}), [block((1, 1, 1), shake=0.0)])
    faces = surface_of(piece, model).faces.nodes.astype(np.int32)
    for depth in (np.array([0.03, 0.02, 0.04]), np.array([3e-4, 2e-4, 4e-4])):
        x = np.concatenate([model.nodes.x, 1.0 - depth[None]])
        met = node_face(x, np.zeros_like(x), faces, every_pair(np.array([8]), len(faces)), 1.0)
        assert many(met) >= 1
        assert (met.normals == [0.0, 1.0, 0.0]).all()


@pytest.mark.parametrize("gap", [0.0, 5e-4, -5e-4, -0.05])
def test_a_sliding_node_changes_between_coplanar_facets(gap: float) -> None:
    """The node has exactly one contact at its present position, also over an edge or a node of the sheet."""
    x, faces = sheet(6, 1.0)
    faces = np.column_stack([faces, np.full(len(faces), len(x))]).astype(np.int32)
    random = np.random.default_rng(3)
    slides = np.column_stack([random.uniform(0.5, 5.5, (2000, 2)), np.full(2000, gap)])
    slides[:500, 0] = np.round(slides[:500, 0])
    slides[500:700, 1] = slides[500:700, 0]
    slides[700:800, :2] = np.round(slides[700:800, :2])
    points = np.concatenate([x, [[3.0, 3.0, -5.0]], slides])
    v = np.zeros_like(points)
    v[len(x) + 1 :, :2] = random.normal(size=(2000, 2)) * 0.01
    tested = np.arange(len(x) + 1, len(points))
    met = node_face(points, v, faces, every_pair(tested, len(faces)), 0.5)
    at = -(met.weights[:, 1:, None] * points[met.nodes[:, 1:]]).sum(axis=1)
    start = points[met.nodes[:, 0]]
    looked_at = start + (0.5 * v[met.nodes[:, 0]] if gap > 0.0 else 0.0)
    assert np.abs((at - looked_at)[:, :2]).max() < 3e-3
    assert (met.normals == [0.0, 0.0, 1.0]).all()
    assert (np.bincount(met.nodes[:, 0], minlength=len(points))[tested] == 1).all()


@pytest.mark.parametrize("angle", [0.0, 0.5, 2.0, -2.0])
def test_a_node_over_the_ridge_of_two_faces_has_one_contact_if_they_are_flat(angle: float) -> None:
    """The faces have the edge from (0, 0, 0) to (0, 1, 0) in common and fall by ``angle`` degrees beyond it. A node
    over the edge, and a node at a distance of a twentieth of a face from it."""
    fall = -np.tan(np.radians(0.5 * angle))
    x = np.array([[0, 0, 0], [0, 1, 0], [1, 0.5, fall], [-1, 0.5, fall], [0, 0.5, -1], [0, 0.4, 0], [0.05, 0.4, fall]])
    faces = np.array([[0, 2, 1, 4], [0, 1, 3, 4]], np.int32)
    met = node_face(x, np.zeros_like(x), faces, every_pair(np.array([5, 6]), 2), 1.0)
    assert np.bincount(met.nodes[:, 0], minlength=7)[[5, 6]].tolist() == [1 if abs(angle) < 0.8 else 2, 1]
    over = met.nodes[:, 0] == 5
    assert set(met.nodes[over].ravel().tolist()) >= {0, 1, 5}
    assert np.abs(met.weights[over][:, 1:].sum(axis=1) + 1.0).max() < 1e-12
    if abs(angle) < 0.8:
        assert met.nodes[over][0].tolist() == [5, 0, 2, 1]  # the face of lower id


def crossings(start: Floats, path: Floats, corners: Floats) -> tuple["np.ndarray", Floats]:
    """Returns which straight paths pass which triangles from the front, exactly, and the area coordinates (n, f, 3) of
    the crossing points.
    """
    a, b, c = (corners[None, :, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    before = ((start[:, None] - a) * normal).sum(axis=2)
    after = before + (path[:, None] * normal).sum(axis=2)
    passes = (before > 0.0) & (after < 0.0)
    share = np.where(passes, before / np.where(passes, before - after, 1.0), 0.0)
    at = start[:, None] + share[..., None] * path[:, None]
    area = (normal * normal).sum(axis=2)
    b0 = (np.cross(c - b, at - b) * normal).sum(axis=2) / area
    b1 = (np.cross(a - c, at - c) * normal).sum(axis=2) / area
    return passes, np.stack([b0, b1, 1.0 - b0 - b1], axis=2)


@pytest.mark.parametrize("seed", range(10))
def test_no_fast_node_passes_a_closed_surface_without_contact(seed: int) -> None:
    """10^4 nodes each start outside of a moving body, with any direction and speed, also with paths longer than the
    body. The pairs are those of the search. Every face that a node passes is among its contacts; a face beside the
    path is not. Where the node passes an edge between coplanar faces, one of the two is enough.
    """
    random = np.random.default_rng(seed)
    ((piece, model),) = pieces_of(
        meeting_of([{}], {"self_contact": ("body0",)}), [block((2, 2, 2), shake=0.3, seed=seed)]
    )
    body, faces = model.nodes.x, surface_of(piece, model).faces.nodes.astype(np.int32)
    n, dt, flight = 10_000, 1e-3, random.normal(size=3) * 300.0
    aim = random.uniform(-0.3, 2.3, (n, 3))
    way = random.normal(size=(n, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    start = aim - 4.0 * way
    path = way * random.uniform(0.5, 12.0, (n, 1))
    x, v = np.concatenate([body, start]), np.concatenate([np.zeros_like(body), path / dt]) + flight
    surface_nodes = nodes_of(x, v)
    nodes = Primitives(np.arange(len(body), len(x), dtype=np.int32)[:, None], np.full(n, 0.01))
    part = np.repeat([0, 1], [len(body), n]).astype(np.int32)
    things = Primitives(np.ascontiguousarray(faces[:, :3]), np.full(len(faces), 0.3))
    pairs = search.find(nodes, things, surface_nodes.x, surface_nodes.v, part, ~np.eye(2, dtype=bool), dt, None)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    pairs[:, 0] += len(body)
    met = node_face(x, v, faces, pairs, dt, part)
    found = np.zeros((n, len(faces)), bool)
    where = {tuple(face[:3]): i for i, face in enumerate(faces.tolist())}
    found[met.nodes[:, 0] - len(body), [where[tuple(row)] for row in met.nodes[:, 1:].tolist()]] = True
    passes, b = crossings(start, path, body[faces[:, :3]])
    hits = passes & (b.min(axis=2) > 0.0)
    assert 1000 < hits.any(axis=1).sum() < n
    near = passes & (b.min(axis=2) > -1.01 * MARGIN)
    assert (near & found).any(axis=1)[hits.any(axis=1)].all()
    assert not (hits & (b.min(axis=2) > 2.0 * RIM) & ~found).any()
    beside = passes & (b.min(axis=2) < -1.01 * MARGIN)
    assert not (beside & found).any()
