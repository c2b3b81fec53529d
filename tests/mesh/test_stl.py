"""Closed surfaces of STL files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.model.bodies import Mesh
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
from conoid.worker.mesh.model import REGULAR_STEP, TetMesh, check
from conoid.worker.mesh.occ.crossing import crossing
from conoid.worker.mesh.occ.solids import measured

from .cad_files import ball, binary, box, text

BALL, BOX = ball(), box()


def stl(**more: Any) -> Any:
    request = {"shape": "stl", "path": "a.stl", "unit": "1 mm", "element_size": 1.5e-3, **more}
    return TypeAdapter[Mesh](Mesh).validate_python(request)


def made(folder: Path, data: bytes | str, **more: Any) -> TetMesh:
    path = folder / "a.stl"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return check(measured(stl(**more), {"mesh": path}, "mesh"))


def inside(facets: Any) -> float:
    """Returns the volume inside of facets, m^3, of an STL file in mm."""
    a, b, c = facets.transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6.0 * 1e-9)


@pytest.mark.parametrize(
    ("facets", "share"),
    [
        (BOX, 1e-9), (BALL, 0.04), (np.concatenate([BOX, box((20.0, 0.0, 0.0))]), 1e-9),
        (np.concatenate([BOX, box((3.0, 3.0, 3.0), 4.0)[:, ::-1]]), 1e-9),
    ],
    ids=["box", "ball", "two", "cavity"],
)  # fmt: skip
def test_text_and_binary_are_the_same_body_with_elements_of_the_size_asked_for(
    tmp_path: Path, facets: Any, share: float
) -> None:
    """The elements have the requested size for any triangles of the file: the triangles of the box are as large as
    possible.
    """
    meshes = [made(tmp_path, data) for data in (text(facets), binary(facets))]
    for mesh in meshes:
        assert mesh.volumes().sum() == pytest.approx(inside(facets), rel=share)
        assert mesh.step_lengths().min() > 0.4 * REGULAR_STEP * 1.5e-3
    assert np.array_equal(meshes[0].points, meshes[1].points)


def test_the_surface_converges_to_the_facets_at_second_order(tmp_path: Path) -> None:
    fine = ball(80)
    errors = [1.0 - made(tmp_path, binary(fine), element_size=h).volumes().sum() / inside(fine) for h in (2e-3, 1e-3)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.35)


def test_it_is_read_in_a_child_process_and_kept_by_content(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(binary(BOX))
    one, other = build(stl(), tmp_path), made(tmp_path, binary(BOX))
    assert np.array_equal(np.sort(one.points, axis=0), np.sort(other.points, axis=0))
    (tmp_path / "a.stl").write_bytes(binary(BOX[:-1]))
    with pytest.raises(MeshError, match=r"^k.path = 'a.stl': the surface has a hole: 3 edges belong to one facet"):
        build(stl(), tmp_path, "k")


def _flipped() -> Any:
    facets = BALL.copy()
    facets[7] = facets[7][::-1]
    return facets


def _folded() -> Any:
    """Returns a box with one corner pushed out through the opposite side of the box."""
    facets = BALL.copy()
    corner = facets[40][0].copy()
    facets[(np.abs(facets - corner) < 1e-9).all(axis=2)] = -1.3 * corner
    return facets


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (binary(BALL[:-1]), "the surface has a hole: 3 edges belong to one facet, one of them (0, 0, -5) - ("),
        (binary(_flipped()), "facets are flipped: 3 edges have facets that face opposite ways"),
        (binary(BALL[:, ::-1]), "the facets of the STL file face inwards"),
        (binary(np.concatenate([BALL, BALL[3:4]])), "1 facets of the STL file occur more than once"),
        (binary(np.concatenate([BALL, BALL])), "528 facets of the STL file occur more than once"),
        (binary(_folded()), "the surface crosses or touches itself: 8 pairs of facets"),
        (binary(np.concatenate([BOX, box((5.0, 5.0, 5.0))])), "the surface crosses or touches itself: 6 pairs"),
        (binary(np.concatenate([BOX, ball(centre=(5.0, 5.0, 10.0))])), "its closed surfaces overlap each other"),
        (binary(np.concatenate([BOX, box((3.0, 3.0, 3.0), 4.0)])), "its closed surfaces overlap each other"),
        (binary(BALL)[:-20], "the binary STL file is cut off, or is no STL file: 528 facets take 26,484 bytes, and"),
        (text(BOX)[:500], "the STL file is cut off: it does not end with endsolid"),
        (text(BOX).replace("vertex 10", "vertex ten"), "a corner in the STL file does not have three numbers"),
        (text(BOX).replace("vertex 10", "vertex nan"), "a coordinate of the STL file is not finite"),
        (b"", "no STL file"), (b"\x00\x07\xff" * 500, "the binary STL file is cut off, or is no STL file"),
    ],
    ids=["hole", "flipped", "inwards", "doubled", "twice", "folded", "crossing", "through", "within", "cut", "cut text",
         "word", "nan", "empty", "garbage"],
)  # fmt: skip
def test_a_surface_that_is_wrong_is_refused_in_one_line(tmp_path: Path, data: bytes | str, message: str) -> None:
    with pytest.raises(MeshError) as refused:
        made(tmp_path, data)
    assert str(refused.value).startswith(f"mesh.path = 'a.stl': {message}")
    assert "\n" not in str(refused.value)


def test_triangles_that_cross_are_those_that_edges_pierce() -> None:
    """Random pairs of triangles are compared with the signs of volumes: the ends of an edge of one triangle are on both
    sides of the other triangle, and the edge passes through its inside.
    """
    chance = np.random.default_rng(5)
    corners = chance.uniform(0.0, 1.0, (400, 1, 3)) + chance.uniform(-0.15, 0.15, (400, 3, 3))
    faces = np.arange(1200).reshape(-1, 3)
    found = {(int(a), int(b)) for a, b in crossing(corners.reshape(-1, 3), faces)}
    wanted = {(a, b) for a in range(400) for b in range(a + 1, 400) if _pierces(corners[a], corners[b])
              or _pierces(corners[b], corners[a])}  # fmt: skip
    assert found == wanted
    assert len(wanted) > 50


def _pierces(one: Any, other: Any) -> bool:
    def side(a: Any, b: Any, c: Any, d: Any) -> float:
        u, v, w = b - a, c - a, d - a
        return float(u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
                     + u[2] * (v[0] * w[1] - v[1] * w[0]))  # fmt: skip

    a, b, c = other
    for p, q in ((one[k], one[(k + 1) % 3]) for k in range(3)):
        if side(a, b, c, p) * side(a, b, c, q) < 0.0:
            signs = {side(p, q, a, b) > 0.0, side(p, q, b, c) > 0.0, side(p, q, c, a) > 0.0}
            if len(signs) == 1:
                return True
    return False


def test_a_surface_is_an_operand_and_has_sectors_in_a_combination(tmp_path: Path) -> None:
    """A quarter of a ball, and of a block without the ball, has only plane faces, so that the volume is that of the
    facets.
    """
    facets = ball(8)
    (tmp_path / "a.stl").write_bytes(binary(facets))
    block = {"shape": "box", "low": [-6e-3] * 3, "high": [6e-3] * 3}
    body = {"shape": "stl", "path": "a.stl", "unit": "1 mm"}
    for shape, of, expected in (
        ("intersection", [body, block], inside(facets) / 4.0),
        ("difference", [block, body], (12e-3**3 - inside(facets)) / 4.0),
    ):
        data = {"shape": shape, "of": of, "sector": "quarter", "element_size": 3e-3}
        mesh = check(build(TypeAdapter[Mesh](Mesh).validate_python(data), tmp_path))
        assert mesh.volumes().sum() == pytest.approx(expected, rel=1e-6)
        assert mesh.points[:, :2].min() == 0.0


def test_too_many_facets_of_an_operand_are_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(binary(ball(48)))
    body = {"shape": "stl", "path": "a.stl", "unit": "1 mm"}
    box_ = {"shape": "box", "low": [0, 0, 0], "high": [6e-3] * 3}
    data = {"shape": "intersection", "of": [body, box_], "element_size": 3e-3}
    with pytest.raises(MeshError, match=r"of\[0\].path = 'a.stl': .* facets are too many for a combination; allowed"):
        build(TypeAdapter[Mesh](Mesh).validate_python(data), tmp_path)
