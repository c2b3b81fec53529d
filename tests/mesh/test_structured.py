"""Regular meshes: exact volumes, matching faces, complete sectors, and the meshes of the Taylor bar."""

import math
import time
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.model.bodies import Box, Cylinder, Mesh, Sphere
from conoid.cases.model.grading import Grading
from conoid.cases.model.solids import Measured
from conoid.cases.shapes.geometry import Generated, bounds, centre, cut_directions, volume
from conoid.worker.errors import MeshError
from conoid.worker.mesh.faces import areas, boundary_faces
from conoid.worker.mesh.model import REGULAR_STEP, TetMesh, check
from conoid.worker.mesh.order import morton_ordered
from conoid.worker.mesh.structured import structured

from .quality import face_counts, quality

SHAPES: dict[str, dict[str, Any]] = {
    "box": {"low": (-0.5, -1.0, -0.75), "high": (1.0, 1.0, 1.0)},
    "plate": {"base": (0.1, 0.2, 0.3), "width": 1.0, "height": 2.0, "thickness": 0.3},
    "cylinder": {"base": (0.1, 0.2, 0.3), "radius": 1.0, "length": 2.0},
    "tube": {"base": (0.1, 0.2, 0.3), "inner_radius": 0.5, "radius": 1.0, "length": 2.0},
}


def body(shape: str, **more: Any) -> Generated:
    request = {"shape": shape, "generator": "structured", "element_size": 0.2, **SHAPES[shape], **more}
    made: Mesh = TypeAdapter[Mesh](Mesh).validate_python(request)
    assert not isinstance(made, Measured)
    return made


def polygon_share(steps: int) -> float:
    """Returns the area of the polygon with ``steps`` corners in each quarter divided by the area of its circle."""
    return steps * math.sin(math.pi / 2 / steps) / (math.pi / 2)


@pytest.mark.parametrize("split", [5, 6])
@pytest.mark.parametrize("sector", ["full", "half", "quarter"])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_regular_mesh_fills_its_body(shape: str, axis: str, sector: str, split: int) -> None:
    made = body(shape, axis=axis, sector=sector, split=split)
    mesh = check(structured(made))
    share = {"cylinder": polygon_share(10), "tube": polygon_share(6)}.get(shape, 1.0)
    assert mesh.volumes().sum() == pytest.approx(volume(made) * share, rel=1e-12)
    assert set(face_counts(mesh.tets).tolist()) == {1, 2}
    low, high = bounds(made) or ((), ())
    assert mesh.points.min(axis=0) == pytest.approx(low)
    assert mesh.points.max(axis=0) == pytest.approx(high)
    assert_planes_are_exact(made, mesh)


def assert_planes_are_exact(made: Generated, mesh: TetMesh) -> None:
    """Checks that the cut faces lie on their planes to the last bit and are complete: their area is the area of the
    section times the number of divisions.
    """
    start = np.array(centre(made))
    faces = boundary_faces(mesh.tets)
    for direction in cut_directions(made, made.axis):
        on = (mesh.points[:, direction] == start[direction])[faces].all(axis=1)
        near = (mesh.points[:, direction] < start[direction] + 1e-6)[faces].all(axis=1)
        assert on.sum() == near.sum() > 0


@pytest.mark.parametrize("shape", ["box", "plate"])
def test_boundary_area(shape: str) -> None:
    made = body(shape, sector="quarter")
    low, high = map(np.array, bounds(made) or ((), ()))
    a, b, c = high - low
    mesh = structured(made)
    assert areas(mesh.points, boundary_faces(mesh.tets)).sum() == pytest.approx(2 * (a * b + b * c + c * a))


@pytest.mark.parametrize(("size", "split", "tets"), [(0.81, 6, 3840), (0.81, 5, 3200), (0.54, 6, 12960)])
def test_the_family_of_the_taylor_bar(size: float, split: int, tets: int) -> None:
    sizes = {"base": (0.0, 0.0, 0.0), "radius": 3.2e-3, "length": 32.4e-3, "element_size": size * 1e-3}
    made = body("cylinder", sector="quarter", split=split, **sizes)
    mesh = check(structured(made))
    assert len(mesh.tets) == tets
    assert mesh.points.min(axis=0).tolist() == [0.0, 0.0, 0.0]
    assert mesh.points[:, 2].max() == 32.4e-3
    assert np.hypot(mesh.points[:, 0], mesh.points[:, 1]).max() == pytest.approx(3.2e-3, rel=1e-14)


@pytest.mark.parametrize("n", [2, 6, 20])
def test_the_corners_of_the_square_do_not_hold_the_time_step_down(n: int) -> None:
    size = 1 / n
    mesh = structured(Cylinder(shape="cylinder", radius=1.0, length=size, element_size=size))
    assert quality(mesh).worst / (REGULAR_STEP * size) > 0.8


def test_element_size_is_rounded_to_whole_divisions_and_at_least_one() -> None:
    one = structured(Box(shape="box", low=(0, 0, 0), high=(1, 1, 1), element_size=50.0))
    assert len(one.tets) == 6
    assert len(structured(Box(shape="box", low=(0, 0, 0), high=(1, 2, 3), element_size=1.1, split=5)).tets) == 5 * 6


def test_what_has_no_regular_mesh_is_refused() -> None:
    ball = Sphere(shape="sphere", radius=1.0, element_size=0.1, generator="structured")
    with pytest.raises(MeshError, match=r"parts\[0\].mesh.generator = 'structured': .* sphere; use gmsh"):
        structured(ball, "parts[0].mesh")
    graded = body("box", grading=Grading(near=0.1, far=1.0, far_size=0.5))
    with pytest.raises(MeshError, match=r"mesh.grading: .*one element size"):
        structured(graded)


def test_a_slip_in_the_element_size_is_refused_at_once() -> None:
    with pytest.raises(MeshError, match=r"mesh.element_size = 1e-06 m: about .* tets; at most 50,000,000"):
        structured(body("cylinder", element_size=1e-6))


def test_an_empty_body_is_refused() -> None:
    with pytest.raises(MeshError, match="the box has no volume"):
        structured(body("box", low=(1.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)))


def test_two_million_tets_are_made_and_ordered_in_seconds() -> None:
    start = time.perf_counter()
    mesh = morton_ordered(structured(Box(shape="box", low=(0, 0, 0), high=(1, 1, 1), element_size=1 / 69)))
    assert time.perf_counter() - start < 20  # takes 1 s on an idle machine
    assert len(mesh.tets) == 6 * 69**3
    assert mesh.volumes().sum() == pytest.approx(1.0)
