"""Shapes meshed together: each shape has its volume, and their interface has one mesh."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.cases.model.bodies import Ogive
from conoid.cases.model.schema import Case
from conoid.cases.reading.problems import CaseError
from conoid.cases.shapes.geometry import volume
from conoid.worker.errors import InputError, MeshError
from conoid.worker.mesh.faces import FACES, across, areas
from conoid.worker.scene.assembly import Whole, assemble
from conoid.worker.scene.survey import surveyed

from .cad_files import written

PLATE = {"shape": "plate", "width": "20 mm", "height": "20 mm", "thickness": "5 mm", "element_size": "4 mm"}
ROD = {"shape": "cylinder", "radius": "4 mm", "length": "10 mm", "element_size": "2.5 mm", "axis": "x"}
TUBE = {"shape": "tube", "inner_radius": "4 mm", "radius": "7 mm", "length": "10 mm", "element_size": "2.5 mm",
        "axis": "x"}  # fmt: skip


def case(one: dict[str, Any], other: dict[str, Any], planes: str = "") -> Case:
    parts = [{"name": name, "material": "steel", "mesh": mesh} for name, mesh in (("one", one), ("other", other))]
    data = {"name": "joint", "run": {"end_time": "1 us"}, "parts": parts, "contact": "none",
            "boundaries": [{"kind": "symmetry", "axis": axis} for axis in planes]}  # fmt: skip
    return parse_case({**data, "bond": [{"parts": ["one", "other"], "kind": "shared"}]})


def joined(one: dict[str, Any], other: dict[str, Any], planes: str = "", folder: Path = Path()) -> Whole:
    return assemble(case(one, other, planes), folder)


def interface(whole: Whole) -> float:
    """Returns the area, m^2, of the common faces of two parts."""
    behind = across(whole.tets)
    tet, face = np.nonzero(behind >= 0)
    between = whole.tet_part[tet] < whole.tet_part[behind[tet, face] // 4]
    return float(
        areas(whole.points, whole.tets[tet[between]][np.arange(between.sum())[:, None], FACES[face[between]]]).sum()
    )


def volumes(whole: Whole) -> list[float]:
    return [float(whole.volumes[whole.tet_part == part].sum()) for part in (0, 1)]


@pytest.mark.parametrize("axis", ["z", "x"])
def test_a_small_plate_on_a_large_one(axis: str) -> None:
    base = [0.0, 0.0, 0.0]
    base["xyz".index(axis)] = 5e-3
    whole = joined({**PLATE, "axis": axis, "base": base}, {**PLATE, "axis": axis, "width": "30 mm"})
    assert volumes(whole) == pytest.approx([2e-6, 3e-6])
    assert interface(whole) == pytest.approx(4e-4)
    assert (whole.volumes > 0.0).all()


def test_a_rod_that_fills_a_tube() -> None:
    """The facets of rod and tube are those of one mesh: no gap and no overlap between rod and tube."""
    whole = joined(ROD, TUBE)
    lateral = 2.0 * np.pi * 4e-3 * 10e-3
    assert interface(whole) == pytest.approx(lateral, rel=0.1)
    outer, inner = volumes(whole)[1], volumes(whole)[0]
    assert outer + inner == pytest.approx(np.pi * 49e-6 * 10e-3, rel=0.1)


def test_grids_that_match_are_joined_and_others_are_refused() -> None:
    grid = {**PLATE, "generator": "structured", "element_size": "2.5 mm"}
    whole = joined({**grid, "base": [0, 0, "5 mm"]}, grid)
    assert interface(whole) == pytest.approx(4e-4)
    assert len(whole.points) == 9 * 9 * 5
    with pytest.raises(
        InputError, match=r"^bond\[0\].parts = 'one, other': the meshes of the two parts have no face in common"
    ):
        joined({**grid, "base": [0, 0, "5 mm"]}, {**grid, "element_size": "5 mm"})


def test_shapes_with_a_gap_and_shapes_that_overlap_are_refused() -> None:
    with pytest.raises(InputError, match="no face in common"):
        joined({**PLATE, "base": [0, 0, "5.5 mm"]}, PLATE)
    with pytest.raises(MeshError, match=r"^parts\[1\].mesh: overlaps parts\[0\].mesh, to which a bond joins it"):
        joined({**PLATE, "base": [0, 0, "4 mm"]}, PLATE)
    with pytest.raises(CaseError, match=r"^bond\[0\].parts = .* a body from an STL file is meshed separately"):
        joined({"shape": "stl", "path": "a.stl", "unit": "1 mm", "element_size": "1 mm"}, PLATE)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_core_that_fills_a_jacket(axis: str) -> None:
    """A quarter of an ogive is inside of a larger ogive with a cavity; the nodes are exactly on the planes of the
    cut.
    """
    base: list[Any] = [0, 0, 0]
    base["xyz".index(axis)] = "2 mm"
    core = {"shape": "ogive", "radius": "3 mm", "crh": 3, "shank": "6 mm", "axis": axis, "base": base}
    hull = {"shape": "ogive", "radius": "4 mm", "crh": 3, "shank": "8 mm", "axis": axis}
    more = {"element_size": "1.2 mm", "sector": "quarter"}
    jacket = {"shape": "difference", "of": [hull, core], "axis": axis, **more}
    whole = joined(jacket, {**core, **more}, "xyz".replace(axis, ""))
    solids = [volume(Ogive.model_validate({**each, **more})) for each in (hull, core)]
    assert volumes(whole) == pytest.approx([solids[0] - solids[1], solids[1]], rel=0.02)
    for direction in {0, 1, 2} - {"xyz".index(axis)}:
        across = whole.points[:, direction]
        assert (across == 0.0).sum() > 50
        assert not ((across != 0.0) & (np.abs(across) < 1e-7)).any()
    assert (whole.volumes > 0.0).all()


def test_solids_of_a_step_file_are_two_parts_of_one_body(tmp_path: Path) -> None:
    """The run has the numbers that ``validate`` gives; a part of the body without a file is meshed together with the
    solids.
    """
    (tmp_path / "s.step").write_text(written(tmp_path)[0])
    core, jacket = (
        {"shape": "cad", "path": "s.step", "solids": [name], "element_size": "2 mm"} for name in ("Core", "Jacket")
    )
    whole = joined(core, jacket, folder=tmp_path)
    assert volumes(whole) == pytest.approx([1e-6, 2e-7])
    assert interface(whole) == pytest.approx(1e-4)
    survey = surveyed(case(core, jacket), tmp_path, compiled=False)
    assert not survey.refused
    assert [part.elements for part in survey.parts] == np.bincount(whole.tet_part).tolist()
    block = {"shape": "box", "low": ["10 mm", "2 mm", "2 mm"], "high": ["15 mm", "8 mm", "8 mm"]}
    survey = surveyed(case(core, {**block, "element_size": "2 mm"}), tmp_path, compiled=False)
    assert not survey.refused
    assert len(survey.parts) == 1
