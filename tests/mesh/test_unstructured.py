"""Meshes by gmsh, made in the child process in the same way as for a case."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.model.bodies import Box, Cylinder, Mesh, Plate, Sphere, Tube
from conoid.cases.shapes.geometry import Generated, bounds, centre, cut_directions, index, volume
from conoid.worker.mesh.build import build
from conoid.worker.mesh.faces import areas, boundary_faces
from conoid.worker.mesh.model import REGULAR_STEP, TetMesh, check
from conoid.worker.mesh.skin import Skin
from conoid.worker.mesh.smooth import smoothed
from conoid.worker.mesh.structured import structured

from .quality import face_counts, quality

HERE = Path(__file__).parent
SHAPES: dict[str, dict[str, Any]] = {
    "box": {"low": (-0.5, -1.0, -0.75), "high": (1.0, 1.0, 1.0)},
    "plate": {"base": (0.1, 0.2, 0.3), "width": 2.0, "height": 2.0, "thickness": 0.4},
    "cylinder": {"base": (0.1, 0.2, 0.3), "radius": 1.0, "length": 2.0},
    "tube": {"base": (0.1, 0.2, 0.3), "inner_radius": 0.5, "radius": 1.0, "length": 2.0},
    "sphere": {"centre": (0.1, 0.2, 0.3), "radius": 1.0},
}
CASES = [
    (shape, axis, sector) for shape, axis in zip(SHAPES, "xyzxy", strict=True) for sector in ("full", "half", "quarter")
]


def body(shape: str, **more: Any) -> Generated:
    request = {"shape": shape, "element_size": 0.25, **SHAPES[shape], **more}
    made: Mesh = TypeAdapter[Mesh](Mesh).validate_python(request)
    assert isinstance(made, Box | Plate | Cylinder | Tube | Sphere)
    return made


@pytest.mark.parametrize(("shape", "axis", "sector"), CASES)
def test_an_unstructured_mesh_fills_its_body(shape: str, axis: str, sector: str) -> None:
    made = body(shape, axis=axis, sector=sector)
    mesh = check(build(made, HERE))
    curved = shape in ("cylinder", "sphere")
    assert mesh.volumes().sum() == pytest.approx(volume(made), rel=0.02 if curved else 0.003)
    assert set(face_counts(mesh.tets).tolist()) == {1, 2}
    low, high = (np.array(corner) for corner in bounds(made) or ((), ()))
    assert np.abs(mesh.points.min(axis=0) - low).max() < 0.02
    assert np.abs(mesh.points.max(axis=0) - high).max() < 0.02
    assert mesh.points.min() >= low.min() - 1e-12
    assert_cuts_are_exact(made, mesh)
    assert_quality(made, mesh)


def assert_cuts_are_exact(made: Generated, mesh: TetMesh) -> None:
    """Checks that each cut plane has nodes to the last bit, that no other nodes are near the plane, and that the faces
    cover the section.
    """
    faces, start = boundary_faces(mesh.tets), np.array(centre(made))
    for direction in cut_directions(made, made.axis):
        on = mesh.points[:, direction] == start[direction]
        near = np.abs(mesh.points[:, direction] - start[direction]) < 0.02
        assert (on == near).all()
        cut = areas(mesh.points, faces[on[faces].all(axis=1)]).sum()
        assert cut == pytest.approx(section(made, direction), rel=0.03)


def section(made: Generated, direction: int) -> float:
    """Returns the area of the cut of a mesh normal to ``direction``, m^2."""
    halved = 0.5 if made.sector == "quarter" else 1.0
    if isinstance(made, Sphere):
        return halved * np.pi * made.radius**2
    if isinstance(made, Cylinder | Tube):
        inner = made.inner_radius if isinstance(made, Tube) else 0.0
        return halved * 2 * (made.radius - inner) * made.length
    low, high = bounds(made) or ((), ())
    return float(np.prod([b - a for i, (a, b) in enumerate(zip(low, high, strict=True)) if i != direction]))


def assert_quality(made: Generated, mesh: TetMesh) -> None:
    found, size = quality(mesh), REGULAR_STEP * made.element_size
    assert found.worst > 0.5 * size
    assert 0.7 * size < found.mean < 1.1 * size
    tets = len(mesh.tets) * made.element_size**3 / volume(made)
    assert 5.5 < tets < 14


@pytest.mark.parametrize("shape", ["plate", "cylinder", "tube", "sphere"])
@pytest.mark.parametrize("sector", ["half", "full"])
def test_an_aligned_mesh_has_the_tets_of_a_quarter_at_the_axis(shape: str, sector: str) -> None:
    """A mesh that is not aligned with the axis has tets of up to twice the volume at the axis, and no node on the
    axis.
    """
    made = body(shape, axis="z", sector=sector, aligned=True)
    quarter, share = build(body(shape, axis="z", sector="quarter"), HERE), {"half": 2, "full": 4}[sector]
    mesh = check(build(made, HERE))
    assert mesh.volumes().sum() == pytest.approx(share * quarter.volumes().sum(), rel=0.01)
    assert len(mesh.tets) == pytest.approx(share * len(quarter.tets), rel=0.05)
    assert set(face_counts(mesh.tets).tolist()) == {1, 2}
    assert_quality(made, mesh)
    if shape != "tube":
        assert at_axis(made, mesh) == pytest.approx(at_axis(made, quarter), rel=0.15)


def at_axis(made: Generated, mesh: TetMesh) -> float:
    """Returns the mean volume of the tets whose distance from the axis z is at most an element size."""
    x = mesh.points[:, :2] - np.array(centre(made))[:2]
    near = np.linalg.norm(x[mesh.tets].mean(axis=1), axis=1) < made.element_size
    return float(mesh.volumes()[near].mean())


@pytest.mark.parametrize("shape", ["cylinder", "plate"])
def test_end_faces_are_exactly_flat(shape: str) -> None:
    """The nodes of the end face lie on one plane; therefore a wall touches the whole end face at once."""
    mesh = build(body(shape), HERE)
    assert (mesh.points[:, 2] == 0.3).sum() > 30
    assert not ((mesh.points[:, 2] > 0.3) & (mesh.points[:, 2] < 0.32)).any()


def test_round_surfaces_are_round() -> None:
    mesh = build(body("tube"), HERE)
    skin = np.unique(boundary_faces(mesh.tets))
    inside = (mesh.points[skin, 2] > 0.31) & (mesh.points[skin, 2] < 2.29)
    radius = np.hypot(*(mesh.points[skin[inside], :2] - [0.1, 0.2]).T)
    assert (np.abs(radius - 0.5) < 1e-6).sum() + (np.abs(radius - 1) < 1e-6).sum() == len(radius)


def test_millimetres_are_meshed_as_metres_are() -> None:
    """The tolerances of gmsh are absolute. The mesher scales a body by a power of two, so that the mesh is equal except
    for its size.
    """
    large = build(body("box", low=(0, 0, 0), high=(1.0, 0.5, 0.5), element_size=0.125), HERE)
    small = build(body("box", low=(0, 0, 0), high=(2.0**-10, 2.0**-11, 2.0**-11), element_size=2.0**-13), HERE)
    assert np.array_equal(large.tets, small.tets)
    assert np.array_equal(large.points * 2.0**-10, small.points)


@pytest.mark.parametrize(("line", "radius"), [(None, 0.0), ("z", 0.0), ("z", 0.7)])
def test_grading_sets_the_size_near_and_far(line: str | None, radius: float) -> None:
    near, far = (0.3, 1.0) if radius == 0.0 else (0.1, 0.45)
    grading = {"axis": line, "radius": radius, "near": near, "far": far, "far_size": 0.3}
    low, high = (-1.2, -1.2, -0.4), (1.2, 1.2, 0.4)
    mesh = build(body("box", low=low, high=high, element_size=0.08, grading=grading), HERE)
    middle = mesh.points[mesh.tets].mean(axis=1)
    distance = np.abs(np.linalg.norm(middle[:, : 2 if line else 3], axis=1) - radius)
    size = np.cbrt(6 * mesh.volumes())
    half = 0.5 * (near + far)
    for start, end, wanted in ((0.0, near, 0.08), (half - 0.05, half + 0.05, 0.19), (1.1 * far, 2.0, 0.3)):
        measured = size[(distance >= start) & (distance < end)].mean()
        assert measured == pytest.approx(wanted, rel=0.25)


SKIN = {"surface": True, "near": 0.12, "far": 0.5, "far_size": 0.3}


@pytest.mark.parametrize(("kind", "sector"), [("box", "full"), ("box", "quarter"), ("sphere", "half")])
def test_tets_are_small_below_the_surface_but_not_at_the_cut_of_a_sector(kind: str, sector: str) -> None:
    shapes: dict[str, dict[str, Any]] = {
        "box": {"low": (-1.0, -1.0, -0.8), "high": (1.0, 1.0, 0.8)},
        "sphere": {"centre": (0.0, 0.0, 0.0), "radius": 1.3},
    }
    mesh = build(body(kind, **shapes[kind], element_size=0.1, sector=sector, grading=SKIN), HERE)
    x, y, z = np.abs(mesh.points[mesh.tets].mean(axis=1)).T
    depth = {
        "box": np.minimum(np.minimum(1.0 - x, 1.0 - y), 0.8 - z),
        "sphere": 1.3 - np.hypot(np.hypot(x, y), z),
    }[kind]
    size = np.cbrt(6 * mesh.volumes())
    assert size[depth < 0.12].mean() == pytest.approx(0.1, rel=0.25)
    assert size[depth > 0.55].mean() == pytest.approx(0.3, rel=0.25)


def test_tets_are_small_beside_a_plane() -> None:
    grading = {"origin": (0.0, 0.0, 0.5), "normal": "z", "near": 0.2, "far": 1.0, "far_size": 0.3}
    mesh = build(body("box", low=(-0.5, -0.5, 0.0), high=(0.5, 0.5, 2.5), element_size=0.08, grading=grading), HERE)
    away, size = np.abs(mesh.points[mesh.tets].mean(axis=1)[:, 2] - 0.5), np.cbrt(6 * mesh.volumes())
    assert size[away < 0.2].mean() == pytest.approx(0.08, rel=0.25)
    assert size[away > 1.1].mean() == pytest.approx(0.3, rel=0.25)


def test_smoothing_raises_the_time_step_and_keeps_the_body() -> None:
    made = body("cylinder", sector="quarter", base=(0.0, 0.0, 0.0), generator="structured")
    regular = structured(made)
    skin, start = Skin.of(made, regular, 1.0)
    shaken = start + 0.025 * np.random.default_rng(5).normal(size=start.shape)
    points = np.concatenate([skin.allowed(n, start[n], shaken[n : n + 1]) for n in range(len(start))])
    rough = check(TetMesh(points, regular.tets))
    better = check(smoothed(rough, skin, 0.6 * REGULAR_STEP * made.element_size))
    assert quality(better).worst > 2 * quality(rough).worst
    assert better.volumes().sum() == pytest.approx(regular.volumes().sum(), rel=0.01)
    assert (better.points[start == 0] == 0).all()
    rim = np.hypot(start[:, 0], start[:, 1]) > 1 - 1e-9
    assert np.hypot(*better.points[rim, :2].T) == pytest.approx(np.ones(rim.sum()), rel=1e-12)


def test_smoothing_leaves_a_good_mesh_alone() -> None:
    made = body("box", generator="structured")
    mesh = structured(made)
    skin, points = Skin.of(made, mesh, 1.0)
    assert np.array_equal(smoothed(mesh, skin, 0.7 * REGULAR_STEP * made.element_size).points, points)


def test_the_axis_only_turns_the_body() -> None:
    meshes = {axis: build(body("cylinder", axis=axis, base=(0.0, 0.0, 0.0)), HERE) for axis in "xyz"}
    for axis, mesh in meshes.items():
        turned = np.roll(meshes["z"].points, index(axis) + 1, axis=1)  # type: ignore[arg-type]
        assert sorted(map(tuple, mesh.points)) == sorted(map(tuple, turned))
