"""Meshes made tet by tet: two regular tets with a common face, and separate tets that do not touch."""

import itertools
import math

import numpy as np
import pytest

from conoid.cases.estimates.mesh_size import mesh_size
from conoid.cases.model.bodies import Shards, TwoTets
from conoid.cases.shapes.geometry import bounds, pitch, surface, volume
from conoid.worker.mesh.faces import areas, boundary_faces, normals
from conoid.worker.mesh.loose import rotations
from conoid.worker.mesh.model import REGULAR_STEP, Floats, TetMesh, check
from conoid.worker.mesh.structured import structured
from conoid.worker.model.hashing import uniform

from .quality import face_counts, quality


def shards(**more: object) -> Shards:
    return Shards.model_validate(
        {"shape": "shards", "base": (1.0, 2.0, 3.0), "count": (5, 6, 7), "element_size": 0.1, "gap": 0.01, **more}
    )


def edges(mesh: TetMesh) -> Floats:
    """Returns (m, 6) lengths of the edges of the tets."""
    x = mesh.points[mesh.tets]
    return np.stack([np.linalg.norm(x[:, a] - x[:, b], axis=1) for a, b in itertools.combinations(range(4), 2)], axis=1)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_two_tets_share_a_face(axis: str) -> None:
    k, centre = "xyz".index(axis), (0.1, -0.2, 0.3)
    made = TwoTets.model_validate({"shape": "two_tets", "element_size": 0.2, "axis": axis, "centre": centre})
    mesh = check(structured(made))
    assert edges(mesh) == pytest.approx(0.2, rel=1e-14)
    assert sorted(face_counts(mesh.tets)) == [1, 1, 1, 1, 1, 1, 2]
    common = np.intersect1d(mesh.tets[0], mesh.tets[1])
    assert mesh.points[common].mean(axis=0) == pytest.approx(centre, abs=1e-15)
    assert np.abs(normals(mesh.points, common[None]))[0] == pytest.approx(0.02 * 3**0.5 * np.eye(3)[k], abs=1e-16)
    first = (k + 1) % 3
    assert mesh.points[common, first].max() == pytest.approx(centre[first] + 0.2 / 3**0.5)
    low, high = bounds(made) or ((), ())
    assert mesh.points.min(axis=0) == pytest.approx(low)
    assert mesh.points.max(axis=0) == pytest.approx(high)
    assert mesh.volumes().sum() == pytest.approx(volume(made), rel=1e-14)
    assert areas(mesh.points, boundary_faces(mesh.tets)).sum() == pytest.approx(surface(made), rel=1e-14)


def test_two_tets_lean() -> None:
    """The free corners are on a line through the centre of the common face; volumes and bounds agree with the
    estimate.
    """
    made = TwoTets.model_validate({"shape": "two_tets", "element_size": 0.2, "axis": "y", "lean": "50 deg"})
    mesh = check(structured(made))
    free = mesh.points[np.setxor1d(mesh.tets[0], mesh.tets[1])]
    assert free.sum(axis=0) == pytest.approx(0.0, abs=1e-15)
    assert free[0, 2] / free[0, 1] == pytest.approx(math.tan(math.radians(50.0)))
    assert mesh.volumes() == pytest.approx(volume(made) / 2, rel=1e-14)
    assert areas(mesh.points, boundary_faces(mesh.tets)).sum() == pytest.approx(surface(made), rel=1e-14)
    assert mesh.step_lengths() == pytest.approx(mesh_size(made).step_length, rel=1e-14)
    low, high = bounds(made) or ((), ())
    assert mesh.points.min(axis=0) == pytest.approx(low)
    assert mesh.points.max(axis=0) == pytest.approx(high)


def test_shards_are_regular_and_free() -> None:
    made = shards()
    mesh = check(structured(made))
    assert (len(mesh.tets), len(mesh.points)) == (210, 840)
    assert set(face_counts(mesh.tets)) == {1}
    assert edges(mesh) == pytest.approx(0.1, rel=1e-13)
    assert quality(mesh).worst == pytest.approx(REGULAR_STEP * 0.1, rel=1e-13)
    assert mesh.volumes().sum() == pytest.approx(volume(made), rel=1e-13)
    assert areas(mesh.points, boundary_faces(mesh.tets)).sum() == pytest.approx(surface(made), rel=1e-13)


@pytest.mark.parametrize("perturbation", [0.0, 0.15])
def test_every_shard_stays_in_a_ball_of_its_own(perturbation: float) -> None:
    """The spheres around the tets are in the middle of cubes, half a gap away from the faces of the cubes: no two tets
    are nearer to each other than the gap.
    """
    made = shards(perturbation=perturbation)
    mesh = structured(made)
    corners = (mesh.points[mesh.tets] - np.array(made.base)) / pitch(made)
    cube = np.floor(corners.mean(axis=1))
    assert len(np.unique(cube, axis=0)) == 210
    reach = np.linalg.norm(corners - cube[:, None] - 0.5, axis=2).max() * pitch(made)
    assert 0.9 * (pitch(made) - made.gap) / 2 < reach * (1 + 3.0 * perturbation)
    assert reach <= (pitch(made) - made.gap) / 2 * (1 + 1e-12)
    low, high = bounds(made) or ((), ())
    assert (mesh.points >= low).all()
    assert (mesh.points <= high).all()


def test_the_seed_makes_the_shards() -> None:
    one, same, other = (structured(shards(seed=seed, perturbation=0.1)).points for seed in (3, 3, 4))
    assert (one == same).all()
    assert np.abs(one - other).max() > 0.01
    assert edges(structured(shards(perturbation=0.1))).std() > 0.003


def test_all_rotations_are_treated_equally() -> None:
    """The rotations of the tets have no preferred direction: means of their entries and of the squares are within four
    standard errors, and the angles have the density (1 - cos a) / pi.
    """
    turns = rotations(uniform(np.arange(60_000), 9).reshape(-1, 3))
    assert np.einsum("nij,nkj->nik", turns, turns) == pytest.approx(np.broadcast_to(np.eye(3), turns.shape), abs=1e-12)
    assert np.linalg.det(turns) == pytest.approx(1.0, abs=1e-12)
    n = len(turns)
    assert turns.mean(axis=0) == pytest.approx(0.0, abs=4 * (1 / 3 / n) ** 0.5)
    assert (turns**2).mean(axis=0) == pytest.approx(1 / 3, abs=4 * (4 / 45 / n) ** 0.5)
    angle = np.arccos(np.clip((np.trace(turns, axis1=1, axis2=2) - 1) / 2, -1, 1))
    share = np.array([(angle < a).mean() for a in (1.0, 2.0, 2.5)])
    assert share == pytest.approx([(a - np.sin(a)) / np.pi for a in (1.0, 2.0, 2.5)], abs=4 * 0.5 / n**0.5)
