"""Meshes of cones, ogives, caps and ring sectors, made in the same way as for a case."""

import math
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.estimates.mesh_size import mesh_size
from conoid.cases.model.bodies import RingSector
from conoid.cases.shapes.geometry import centre, cut_directions, surface, volume
from conoid.worker.mesh.build import build
from conoid.worker.mesh.faces import areas, boundary_faces
from conoid.worker.mesh.model import REGULAR_STEP, TetMesh, check
from conoid.worker.mesh.unstructured import unstructured

from ..cases.forms import SHAPES, Shape, shape
from .quality import face_counts

HERE = Path(__file__).parent
WORST = 0.38
"""Smallest step length divided by that of a regular tet in the bodies of this module, including blunt tips."""


def made(body: Shape) -> TetMesh:
    """Returns the mesh of a body, made in this process to save the time of a child process."""
    return check(unstructured(body))


def skin(mesh: TetMesh) -> float:
    """Returns the area of the surface of a mesh, m^2."""
    return float(areas(mesh.points, boundary_faces(mesh.tets)).sum())


@pytest.mark.parametrize("name", SHAPES)
def test_volume_and_area_converge_at_second_order(name: str) -> None:
    """A chord cuts off h^2 / 8 R: the errors at h and h/2 have the ratio 4, as far as a few elements around the body
    show this ratio. A body with flat faces has no error.
    """
    body = shape(name)
    errors = []
    for size in (0.14, 0.07):
        mesh = made(body.model_copy(update={"element_size": size}))
        errors.append([1.0 - mesh.volumes().sum() / volume(body), 1.0 - skin(mesh) / surface(body)])
    for coarse, fine in zip(*errors, strict=True):
        assert abs(coarse) < 0.05
        assert coarse / fine == pytest.approx(4.0, rel=0.35) or abs(coarse) < 3e-3


@pytest.mark.parametrize("sector", ["half", "quarter"])
@pytest.mark.parametrize("name", SHAPES)
def test_a_sector_is_a_share_of_the_whole_with_nodes_exactly_on_its_planes(name: str, sector: str) -> None:
    body = shape(name, sector=sector)
    mesh, start = made(body), np.array(centre(body))
    assert mesh.volumes().sum() == pytest.approx(volume(body), rel=0.02)
    assert set(face_counts(mesh.tets).tolist()) == {1, 2}
    faces = boundary_faces(mesh.tets)
    for direction in cut_directions(body, body.axis):
        away = mesh.points[:, direction] - start[direction]
        assert ((away == 0.0) | (away > 1e-4)).all()
        if isinstance(body, RingSector):
            continue
        cut = areas(mesh.points, faces[(away[faces] == 0.0).all(axis=1)]).sum()
        whole = surface(body) - surface(shape(name)) * (0.5 if sector == "half" else 0.25)
        assert cut == pytest.approx(whole / len(cut_directions(body, body.axis)), rel=0.02)


@pytest.mark.parametrize("name", SHAPES)
def test_the_worst_tet_is_known_before(name: str) -> None:
    """The estimate of the step length is within its factor of two; at sharp tips nodes slide along the surface."""
    for sector in ("full", "quarter"):
        body = shape(name, sector=sector)
        mesh, expected = made(body), mesh_size(body)
        worst = mesh.step_lengths().min()
        assert worst > WORST * REGULAR_STEP * body.element_size
        assert 0.5 < expected.step_length / worst < 2.0
        assert expected.elements / len(mesh.tets) == pytest.approx(1.0, abs=0.25)


def test_nodes_lie_on_the_surface() -> None:
    """The body is an ogive, whose radius at each height is known: smoothing has moved the nodes along the surface
    only.
    """
    body = shape("tangent", base=(0.0, 0.0, 0.0), sector="quarter")
    mesh = made(body)
    faces = boundary_faces(mesh.tets)
    nodes = mesh.points[np.unique(faces)]
    nodes = nodes[(nodes[:, 2] > 1.0 + 1e-9) & (nodes[:, 0] > 0.0) & (nodes[:, 1] > 0.0)]
    rho = 3.0
    radius = np.sqrt(rho**2 - (nodes[:, 2] - 1.0) ** 2) - (rho - 0.5)
    assert len(nodes) > 50
    assert np.hypot(nodes[:, 0], nodes[:, 1]) == pytest.approx(radius, abs=1e-9)


def test_slender_cones_have_tips_that_a_mesh_can_be_made_of() -> None:
    """A single face around a slender tip would have two triangles with the same nodes."""
    for half_angle in (2.0, 5.0, 10.0):
        body = shape(
            "cone",
            radius=0.05 + 0.01 * half_angle,
            length=(0.05 + 0.01 * half_angle) / math.tan(math.radians(half_angle)),
        )
        mesh = made(body)
        assert mesh.volumes().sum() == pytest.approx(volume(body), rel=0.3)


def test_a_child_process_makes_the_same_bits() -> None:
    body = shape("rounded", element_size=0.12)
    one, other = build(body, HERE), made(body)
    assert len(one.tets) == len(other.tets)
    assert np.array_equal(np.sort(one.points, axis=0), np.sort(other.points, axis=0))
    assert np.array_equal(made(body).points, other.points)
