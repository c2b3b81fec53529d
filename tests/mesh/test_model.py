"""Tet meshes: volumes, step lengths, refused meshes, faces, and order."""

import numpy as np
import pytest

from conoid.cases.model.bodies import Box
from conoid.worker.errors import MeshError
from conoid.worker.mesh.faces import FACES, areas, boundary_faces
from conoid.worker.mesh.model import REGULAR_STEP, Ints, Names, TetMesh, check
from conoid.worker.mesh.order import morton_codes, morton_ordered
from conoid.worker.mesh.structured import structured

from .quality import face_counts, quality

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
ONE = np.array([[0, 1, 2, 3]])


def rows(tets: object) -> Ints:
    return np.array(tets, np.int32)


def small_box() -> TetMesh:
    return structured(Box(shape="box", low=(0, 0, 0), high=(1, 1, 1), element_size=0.25, generator="structured"))


def test_volume_and_step_length_of_known_tets() -> None:
    corner = TetMesh(CORNER, ONE)
    assert corner.volumes() == pytest.approx([1 / 6])
    assert corner.step_lengths() == pytest.approx([6**-0.5])  # squares of the four gradients: 1, 1, 1 and 3
    regular = TetMesh(np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / 8**0.5, ONE)
    assert abs(regular.step_lengths()[0]) == pytest.approx(REGULAR_STEP)


def test_step_length_is_the_sum_of_squared_gradients_in_plain_numpy() -> None:
    points = np.random.default_rng(3).normal(size=(4, 3))
    gradients = np.linalg.inv(np.c_[np.ones(4), points])[1:]
    mesh = TetMesh(points, ONE)
    assert abs(mesh.step_lengths()[0]) == pytest.approx((gradients**2).sum() ** -0.5)
    assert np.sign(mesh.step_lengths()) == np.sign(mesh.volumes())


def test_quality_names_the_worst_tet() -> None:
    points = np.concatenate([CORNER, CORNER * [1, 1, 0.1] + 5])
    found = quality(TetMesh(points, rows([[0, 1, 2, 3], [4, 5, 6, 7]])))
    assert found.worst_tet == 1
    assert found.ratio < 0.5


@pytest.mark.parametrize(
    ("points", "tets", "message"),
    [
        (CORNER, np.empty((0, 4)), "no tets"),
        (CORNER * [1, np.nan, 1], ONE, "node 0 has a coordinate that is not finite"),
        (CORNER, [[0, 1, 2, 4]], "tet 0 has the node indices 0, 1, 2, 4; allowed: 0 to 3"),
        (CORNER, [[0, 1, 2, -1]], "allowed: 0 to 3"),
        (np.concatenate([CORNER, CORNER[:1]]), ONE, "node 4 belongs to no tet"),
        (CORNER * [1, 1, 0], ONE, "tet 0 is flat: its nodes 0, 1, 2, 3 span a volume of 0 m"),
        (CORNER * [1, 1, -1], ONE, "tet 0 is inverted: .* -0.167 m.*1 of 1 tets"),
        (CORNER, [[0, 1, 2, 2], [0, 1, 2, 3]], "tet 0 is flat"),
    ],
)
def test_unusable_meshes_are_refused_by_name(points: object, tets: object, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        check(TetMesh(np.asarray(points), np.asarray(tets)))


def test_names_of_the_file_are_used() -> None:
    with pytest.raises(MeshError, match="tet 900 is inverted: its nodes 11, 13, 12, 14"):
        check(TetMesh(CORNER, rows([[0, 2, 1, 3]])), Names(np.array([11, 12, 13, 14]), np.array([900])))


def test_a_thin_but_honest_tet_far_from_the_origin_is_accepted() -> None:
    check(TetMesh((CORNER * [1, 1, 1e-4]) * 1e-3 + 7.0, ONE))


@pytest.mark.parametrize(("points", "tets"), [(np.zeros((4, 2)), ONE), (CORNER, [[0, 1, 2]])])
def test_wrong_shapes_are_refused(points: object, tets: object) -> None:
    with pytest.raises(MeshError, match="expected"):
        TetMesh(np.asarray(points), np.asarray(tets))


def test_faces_are_oriented_outward() -> None:
    a, b, c = (CORNER[FACES[:, i]] for i in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - CORNER.mean(axis=0))
    assert (outward > 0).all()


def test_boundary_of_a_box() -> None:
    mesh = small_box()
    faces = boundary_faces(mesh.tets)
    assert areas(mesh.points, faces).sum() == pytest.approx(6.0)
    a, b, c = (mesh.points[faces[:, i]] for i in range(3))
    flux = np.einsum("ij,ij->", np.cross(b - a, c - a), a + b + c) / 18
    assert flux == pytest.approx(1.0)  # by the divergence theorem all faces are directed outward
    counts = face_counts(mesh.tets)
    assert (counts == 1).sum() == len(faces)
    assert 2 * (counts == 2).sum() + len(faces) == 4 * len(mesh.tets)


def test_morton_codes_interleave_the_bits() -> None:
    points = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [2, 0, 0], [2**21, 2**21, 2**21]]) / 2**21
    codes = morton_codes(points, np.zeros(3), 1.0)
    assert codes.tolist() == [1, 2, 4, 7, 8, 2**63 - 1]


def test_morton_order_keeps_the_mesh_and_brings_neighbours_together() -> None:
    mesh = small_box()
    rng = np.random.default_rng(1)
    nodes, tets = rng.permutation(len(mesh.points)), rng.permutation(len(mesh.tets))
    place = np.argsort(nodes)
    mixed = TetMesh(mesh.points[nodes], rows(place[mesh.tets[tets]]))
    ordered, again = morton_ordered(mesh), morton_ordered(mixed)
    assert np.array_equal(ordered.points, again.points)
    assert sorted(map(tuple, ordered.tets.tolist())) == sorted(map(tuple, again.tets.tolist()))
    assert ordered.volumes().sum() == pytest.approx(1.0)
    assert np.ptp(ordered.tets, axis=1).mean() < 0.5 * np.ptp(mixed.tets, axis=1).mean()


def test_morton_ties_keep_their_order() -> None:
    mesh = TetMesh(np.concatenate([CORNER, CORNER]), rows([[0, 1, 2, 3], [4, 5, 6, 7]]))
    ordered = morton_ordered(mesh)
    assert ordered.tets.tolist() == [[0, 2, 4, 6], [1, 3, 5, 7]]
