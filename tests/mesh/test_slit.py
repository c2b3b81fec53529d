"""A slit: both sides of the slit are exposed, its border inside of the body is connected, and nothing else of the mesh
changes.
"""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.model.bodies import Box, Mesh, Plate
from conoid.cases.shapes.geometry import across, index, slit_extents, surface, volume
from conoid.worker.mesh.faces import across as behind
from conoid.worker.mesh.faces import areas, boundary_faces, normals
from conoid.worker.mesh.model import Floats, TetMesh, check
from conoid.worker.mesh.order import morton_ordered
from conoid.worker.mesh.structured import structured

PLATE: dict[str, Any] = {"shape": "plate", "base": (0.5, 0.2, 0.0), "width": 1.0, "height": 0.4, "thickness": 0.1}
BOX: dict[str, Any] = {"shape": "box", "low": (0.0, 0.0, 0.0), "high": (1.0, 0.8, 0.6)}
FROM_ONE_SIDE = {**PLATE, "slit": {"axis": "y", "at": 0.2, "low": (-1.0, 0.0), "high": (1.0, 0.5)}}
INSIDE = {**BOX, "slit": {"axis": "x", "at": 0.4, "low": (0.2, 0.1), "high": (0.6, 0.4)}}


def body(written: dict[str, Any], **more: Any) -> Box | Plate:
    request = {"generator": "structured", "element_size": 0.1, **written, **more}
    made: Mesh = TypeAdapter[Mesh](Mesh).validate_python(request)
    assert isinstance(made, Box | Plate)
    return made


def crack(made: Box | Plate, mesh: TetMesh) -> tuple[Floats, Floats]:
    """Returns centres (k, 3) and normals (k, 3) of the exposed faces in the plane of the slit, inside of the body."""
    assert made.slit is not None
    faces = boundary_faces(mesh.tets)
    flat = np.abs(mesh.points[faces][:, :, index(made.slit.axis)] - made.slit.at).max(axis=1) < 1e-9
    return mesh.points[faces[flat]].mean(axis=1), normals(mesh.points, faces[flat])


@pytest.mark.parametrize("split", [5, 6])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("written", [FROM_ONE_SIDE, INSIDE], ids=["edge", "inside"])
def test_both_sides_are_exposed(written: dict[str, Any], axis: str, split: int) -> None:
    """Each side of the slit has the area of the rectangle, and the sides are opposite to each other, except corner
    faces whose nodes are all on the border.
    """
    shift = "xyz".index(axis) - "xyz".index(written["slit"]["axis"])
    turned = {
        key: tuple(np.roll(value, shift).tolist()) if key in ("low", "high") else value
        for key, value in written.items()
    }
    if written["shape"] == "plate":
        turned |= {"axis": "xyz"[(2 + shift) % 3], "base": tuple(np.roll(written["base"], shift).tolist())}
    made = body(turned | {"slit": {**written["slit"], "axis": axis}}, split=split)
    mesh, slit = morton_ordered(check(structured(made))), made.slit
    assert slit is not None
    centres, outward = crack(made, mesh)
    whole, corner = float(np.prod(slit_extents(made))), 0.5 * 0.1**2
    corners = 0 if written is FROM_ONE_SIDE else 4
    for sign in (-1.0, 1.0):
        side = np.flatnonzero(sign * outward[:, index(slit.axis)] > 0.0)
        area = 0.5 * np.linalg.norm(outward[side], axis=1).sum()
        assert whole - corners * corner - 1e-12 <= area <= whole + 1e-12
        for k, d in enumerate(across(slit.axis)):
            assert (centres[side, d] > slit.low[k]).all()
            assert (centres[side, d] < slit.high[k]).all()
    assert mesh.volumes().sum() == pytest.approx(volume(made), rel=1e-12)


def test_the_surface_is_that_of_the_block_and_the_slit() -> None:
    made = body(FROM_ONE_SIDE)
    mesh = structured(made)
    assert areas(mesh.points, boundary_faces(mesh.tets)).sum() == pytest.approx(surface(made), rel=1e-12)
    whole = surface(body(PLATE))
    assert surface(made) == pytest.approx(whole + 2 * 0.5 * 0.1)


def test_the_border_inside_the_body_holds_it_together() -> None:
    """Nodes at the tip of the slit are not duplicated; all other nodes of the slit exist twice. The halves of the body
    have common nodes only beyond the tip of the slit.
    """
    made = body(FROM_ONE_SIDE)
    mesh = structured(made)
    on = np.abs(mesh.points[:, 1] - 0.2) < 1e-9
    at, count = np.unique(np.round(mesh.points[on], 6), axis=0, return_counts=True)
    assert (count == np.where(at[:, 0] < 0.5 - 1e-9, 2, 1)).all()
    upper = mesh.points[mesh.tets, 1].mean(axis=1) > 0.2
    common = np.intersect1d(mesh.tets[upper], mesh.tets[~upper])
    assert mesh.points[common, 0].min() == pytest.approx(0.5)
    other = behind(mesh.tets)
    through = (other >= 0) & (upper[other // 4] != upper[:, None])
    assert mesh.points[mesh.tets[through.any(axis=1)], 0].min() > 0.4 - 1e-9


def test_a_slit_through_the_whole_body_leaves_two() -> None:
    made = body({**BOX, "slit": {"axis": "z", "at": 0.3, "low": (-1.0, -1.0), "high": (2.0, 2.0)}})
    mesh = structured(made)
    upper = mesh.points[mesh.tets, 2].mean(axis=1) > 0.3
    assert not len(np.intersect1d(mesh.tets[upper], mesh.tets[~upper]))


def test_the_tets_stay_where_they_were() -> None:
    plain, slit = structured(body(PLATE)), structured(body(FROM_ONE_SIDE))
    assert (plain.points[plain.tets] == slit.points[slit.tets]).all()
