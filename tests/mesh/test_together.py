"""Shapes meshed together: each has its volume, and their interface one mesh."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.worker.assembly import Whole, assemble
from conoid.worker.errors import InputError, MeshError
from conoid.worker.mesh.faces import FACES, across, areas

PLATE = {"shape": "plate", "width": "20 mm", "height": "20 mm", "thickness": "5 mm", "element_size": "4 mm"}
ROD = {"shape": "cylinder", "radius": "4 mm", "length": "10 mm", "element_size": "2.5 mm", "axis": "x"}
TUBE = {"shape": "tube", "inner_radius": "4 mm", "radius": "7 mm", "length": "10 mm", "element_size": "2.5 mm",
        "axis": "x"}  # fmt: skip


def joined(one: dict[str, Any], other: dict[str, Any]) -> Whole:
    parts = [{"name": name, "material": "steel", "mesh": mesh} for name, mesh in (("one", one), ("other", other))]
    data = {"name": "joint", "run": {"end_time": "1 us"}, "parts": parts, "contact": "none"}
    return assemble(parse_case({**data, "bond": [{"parts": ["one", "other"], "kind": "shared"}]}), Path())


def interface(whole: Whole) -> float:
    """Area, m^2, of the faces that two parts have in common."""
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
    """Facets of one mesh: no gap and no overlap between the two."""
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
        InputError, match=r"^bond\[0\].parts = 'one, other': the meshes of the two have no face in common"
    ):
        joined({**grid, "base": [0, 0, "5 mm"]}, {**grid, "element_size": "5 mm"})


def test_shapes_with_a_gap_and_shapes_that_overlap_are_refused() -> None:
    with pytest.raises(InputError, match="no face in common"):
        joined({**PLATE, "base": [0, 0, "5.5 mm"]}, PLATE)
    with pytest.raises(MeshError, match="shapes that a bond joins overlap"):
        joined({**PLATE, "base": [0, 0, "4 mm"]}, PLATE)
