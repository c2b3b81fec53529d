"""Estimated areas of tractions, compared with formulas and with generated meshes."""

import math
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import CaseError, parse_case
from conoid.cases.model.schema import Case
from conoid.cases.shapes.loaded import loads
from conoid.cases.shapes.region import Region
from conoid.cases.warnings.idle import unloaded
from conoid.worker.mesh.faces import boundary_faces, normals
from conoid.worker.mesh.structured import structured

TUBE = {"shape": "tube", "inner_radius": 5e-3, "radius": 8e-3, "length": 20e-3, "element_size": 1e-3}
BALL = {"shape": "sphere", "radius": 5e-3, "element_size": 0.25e-3}
BLOCK = {"shape": "box", "low": [0, 0, 0], "high": [4e-3, 4e-3, 2e-3], "element_size": 1e-3}
FAR = {"low": [-1, -1], "high": [1, 1]}
BORE = {"cylinder": {"radius": 5e-3}}


def slab(low: float, high: float) -> dict[str, Any]:
    return {"low": [-1, -1, low], "high": [1, 1, high]}


def pressed(mesh: dict[str, Any], region: dict[str, Any], **part: Any) -> Case:
    planes = {"full": "", "half": "x", "quarter": "xy"}[mesh.get("sector", "full")]
    held = [{"kind": "symmetry", "axis": axis} for axis in planes]
    return parse_case({
        "name": "pressed", "run": {"end_time": 1e-6},
        "parts": [{"name": "a", "material": "steel", "mesh": mesh, **part}],
        "boundaries": [{"kind": "traction", "pressure": 1e8, **region}, *held],
    })  # fmt: skip


@pytest.mark.parametrize(
    ("mesh", "region", "area"),
    [
        (TUBE, {}, math.pi * (2 * 39 + 26 * 20)),
        (TUBE, BORE, math.pi * 10 * 20),
        (TUBE, {**BORE, **slab(5e-3, 15e-3)}, math.pi * 10 * 10),
        (TUBE, {"cylinder": {"inner_radius": 8e-3, "radius": 9e-3}}, math.pi * 16 * 20),
        (TUBE, slab(20e-3, 20e-3), math.pi * 39),
        ({**TUBE, "sector": "quarter"}, BORE, math.pi * 10 * 20 / 4),
        ({**TUBE, "sector": "half"}, slab(20e-3, 20e-3), math.pi * 39 / 2),
        (BALL, slab(0, 1), 2 * math.pi * 25),
        (BLOCK, slab(2e-3, 2e-3), 16),
        (BLOCK, {}, 16 * 2 + 8 * 4),
        ({"shape": "cylinder", "radius": 3e-3, "length": 9e-3, "element_size": 0.3e-3}, slab(9e-3, 1), 9 * math.pi),
        ({"shape": "plate", "width": 6e-3, "height": 4e-3, "thickness": 1e-3, "axis": "x", "element_size": 5e-4,
          "base": [1e-3, 0, 0]}, {"low": [2e-3, -1, -1], "high": [1, 1, 1]}, 24),
    ],
)  # fmt: skip
def test_areas_are_those_of_formulas(mesh: dict[str, Any], region: dict[str, Any], area: float) -> None:
    (load,) = loads(pressed(mesh, region))
    assert load.area == pytest.approx(1e-6 * area, rel=0.04)
    assert load.faces


def test_a_turned_body_has_its_bore_where_it_is() -> None:
    turned = pressed(TUBE, {"cylinder": {"axis": "x", "radius": 5e-3}}, turn={"axis": "y", "angle": "90 deg"})
    (load,) = loads(turned)
    assert load.area == pytest.approx(1e-6 * math.pi * 10 * 20, rel=0.01)


@pytest.mark.parametrize("region", [BORE, {**BORE, **slab(4e-3, 12e-3)}])
def test_area_and_faces_are_those_of_the_mesh(region: dict[str, Any]) -> None:
    case = pressed({**TUBE, "generator": "structured"}, region)
    (load,) = loads(case)
    made, spec = structured(case.parts[0].mesh), case.boundaries[0]  # type: ignore[arg-type]
    inside = Region(cylinder=spec.cylinder).holds(made.points.T, 1e-9)  # type: ignore[union-attr]
    if spec.low is not None:  # type: ignore[union-attr]
        z = made.points[:, 2]
        inside &= (z >= spec.low[2] - 1e-12) & (z <= spec.high[2] + 1e-12)  # type: ignore[union-attr, index]
    faces = boundary_faces(made.tets)
    faces = faces[inside[faces].all(axis=1)]
    area = 0.5 * np.linalg.norm(normals(made.points, faces), axis=1).sum()
    assert load.area == pytest.approx(float(area), rel=2e-3)
    assert load.faces == pytest.approx(len(faces), rel=0.3)


def test_an_unknown_area_is_none() -> None:
    file = pressed({"shape": "file", "unit": "1 mm", "path": "rod.msh"}, BORE)
    loose = pressed({"shape": "two_tets", "element_size": 1e-3}, BORE)
    assert [(load.area, load.faces) for case in (file, loose) for load in loads(case)] == [(None, None)] * 2
    assert list(unloaded(file)) == []


def test_a_region_without_a_face_gets_a_warning() -> None:
    (odd,) = unloaded(pressed(TUBE, {"cylinder": {"radius": 4e-3}}))
    assert str(odd).startswith("boundaries[0]: probably no face of the bodies lies in the region")
    assert list(unloaded(pressed(TUBE, BORE))) == []


def test_radii_are_in_order() -> None:
    with pytest.raises(CaseError, match=r"cylinder.inner_radius = .0.006 m.: must not be above radius, 0.005 m"):
        pressed(TUBE, {"cylinder": {"inner_radius": 6e-3, "radius": 5e-3}})
