"""Survey of mesh files before a run: measurements with the rotation of the part, all errors, shared nodes."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conoid.cases.load import parse_case
from conoid.cases.model.bodies import Mesh
from conoid.cases.reading import survey
from conoid.worker.errors import MeshError
from conoid.worker.mesh.child import Limits, perform
from conoid.worker.mesh.sources import Sources
from conoid.worker.scene.assembly import assemble
from conoid.worker.scene.survey import surveyed

TWO = """*NODE
1, 0, 0, 0
2, 6, 0, 0
3, 0, 6, 0
4, 0, 0, 3
5, 0, 0, -3
*ELEMENT, TYPE=C3D4, ELSET=Upper
1, 1, 2, 3, 4
*ELEMENT, TYPE=C3D4, ELSET=Lower
2, 1, 3, 2, 5
*ELEMENT, TYPE=S3, ELSET=Skin
3, 1, 2, 3
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file has two tets of 18 mm^3 with a common face. Files are read in this process, which takes a tenth of the
    time of a child process."""
    monkeypatch.setenv("CONOID_CACHE_DIR", str(tmp_path))

    def read(mesh: Mesh, sources: Sources, target: Path, key: str, limits: Limits) -> None:
        perform(mesh, key, sources, target)

    monkeypatch.setattr("conoid.worker.mesh.build.run_child", read)
    (tmp_path / "two.inp").write_text(TWO)
    return tmp_path


def case(*parts: dict[str, Any], contact: object = "none") -> Any:
    return parse_case({
        "name": "files", "contact": contact, "run": {"end_time": "1 us"},
        "parts": [{"name": f"part{i}", "material": "steel", **part} for i, part in enumerate(parts)],
    })  # fmt: skip


def part(group: str | None, path: str = "two.inp", **more: Any) -> dict[str, Any]:
    mesh = {"shape": "file", "path": path, "unit": "1 mm"} | ({"group": group} if group is not None else {})
    return {"mesh": mesh, **more}


def test_a_part_is_measured_as_it_stands_and_moves(folder: Path) -> None:
    turn = {"axis": "x", "angle": "90 deg", "centre": [0, 0, 0]}
    spin = {"rate": [0, 0, "1000 rad/s"], "centre": [0, 0, 0]}
    made = case(part("Upper", turn=turn, velocity=[0, 0, "2 m/s"], spin=spin))
    (found,) = surveyed(made, folder).parts
    mass = 7850.0 * 18e-9
    assert (found.elements, found.nodes, found.faces) == (1, 4, 4)
    assert found.mass == pytest.approx(mass)
    assert np.array([found.low, found.high]) == pytest.approx(np.array([[0, -3e-3, 0], [6e-3, 0, 6e-3]]), abs=1e-12)
    assert found.altitude == pytest.approx(1e-3 * 18.0 * 3.0 / (0.5 * 6.0 * np.sqrt(2.0) * np.sqrt(18.0 + 9.0)))
    corners = np.array([[0, 0, 0], [6, 0, 0], [0, 0, 6], [0, -3, 0]]) * 1e-3
    v = np.cross([0, 0, 1000.0], corners) + np.array([0, 0, 2.0])
    assert found.momentum == pytest.approx(tuple(0.25 * mass * v.sum(axis=0)))
    assert found.energy == pytest.approx(0.125 * mass * (v * v).sum())
    assert found.speed == pytest.approx(np.sqrt((v * v).sum(axis=1).max()))
    assert found.notes == ["elements that carry no volume are skipped: 1 S3"]


def test_every_refusal_is_reported_at_once(folder: Path) -> None:
    (folder / "bad.inp").write_text(TWO + "*NGEN\n1, 2\n")
    found = surveyed(case(part("ice"), part(None), part(None, "bad.inp")), folder)
    assert [each.part for each in found.parts] == [1]
    assert found.refused == [
        "parts[0].mesh.group = 'ice': no such element set, instance or part; known: Lower, Skin, Upper",
        "parts[2].mesh.path = 'bad.inp': line 13: *NGEN is not supported; write the nodes and elements out",
    ]


SHARED = r"parts: 'part0' and 'part1' share 3 nodes of 'two.inp', but would be separate bodies that only touch: give "


@pytest.mark.parametrize("contact", ["none", {}])
def test_two_parts_that_share_nodes_of_a_file_are_refused(contact: object, folder: Path) -> None:
    """The survey before the run and the run both refuse the parts. A copy of the file under another name counts as the
    same file."""
    (folder / "copy.inp").write_text(TWO)
    made = case(part("Upper"), part("Lower", "copy.inp"), contact=contact)
    assert surveyed(made, folder).refused[0].startswith(SHARED)
    with pytest.raises(MeshError, match=SHARED):
        assemble(made, folder)


def test_parts_with_nodes_of_their_own_may_touch_and_one_mesh_may_stand_in_two_places(folder: Path) -> None:
    (folder / "apart.inp").write_text(TWO.replace("2, 1, 3, 2, 5", "2, 6, 8, 7, 5").replace("*ELEMENT", (
        "6, 0, 0, 0\n7, 6, 0, 0\n8, 0, 6, 0\n*ELEMENT"), 1))  # fmt: skip
    assert surveyed(case(part("Upper", "apart.inp"), part("Lower", "apart.inp")), folder).refused == []
    turned = {"axis": "x", "angle": "180 deg", "centre": [0, 0, "10 mm"]}
    assert surveyed(case(part(None), part(None, turn=turned)), folder).refused == []


def test_a_survey_is_read_as_it_was_written(folder: Path) -> None:
    found = surveyed(case(part(None), part("ice")), folder)
    assert survey.from_json(survey.to_json(found)) == found


def test_surfaces_that_coincide_are_measured(folder: Path) -> None:
    """The scene has a common face of two meshes, and faces of a mesh on a plate; surfaces with a gap are not
    counted."""
    (folder / "apart.inp").write_text(TWO.replace("2, 1, 3, 2, 5", "2, 6, 8, 7, 5").replace("*ELEMENT", (
        "6, 0, 0, 0\n7, 6, 0, 0\n8, 0, 6, 0\n*ELEMENT"), 1))  # fmt: skip
    files = surveyed(case(part("Upper", "apart.inp"), part("Lower", "apart.inp")), folder).touching
    assert [(each.one, each.other) for each in files] == [(0, 1)]
    assert files[0].area == pytest.approx(18e-6)
    for gap, area in ((0.0, [18e-6]), (1e-3, [])):
        plate = {"shape": "plate", "base": [0, 0, f"{-5 - gap} mm"], "width": "20 mm", "height": "20 mm"}
        below = {"mesh": {**plate, "thickness": "5 mm", "element_size": "1 mm"}}
        found = surveyed(case(below, part("Upper")), folder).touching
        assert [each.area for each in found] == pytest.approx(area)


def loaded(folder: Path, *boundaries: dict[str, Any]) -> survey.Survey:
    data = case(part(None)).model_dump(mode="json", exclude_unset=True) | {"boundaries": boundaries}
    return surveyed(parse_case(data), folder)


def test_what_tractions_and_boxes_act_on_is_counted_in_the_file(folder: Path) -> None:
    """The upper tet has a face of 9 mm^2 on each of the planes x = 0 and y = 0, and three nodes at z = 0."""
    plane = {"low": [0, 0, 0], "high": [0, "6 mm", "3 mm"]}
    found = loaded(
        folder, {"kind": "traction", "pressure": "1 MPa", **plane}, {"kind": "velocity", "x": 0, **plane},
        {"kind": "traction", "pressure": "1 MPa"},
    )  # fmt: skip
    face, held, surface = found.loads
    assert (face.boundary, face.faces, face.exact) == (0, 1, True)
    assert face.area == pytest.approx(9e-6)
    assert (held.boundary, held.nodes, held.exact) == (1, 3, True)
    assert (surface.boundary, surface.faces) == (2, 6)
    assert survey.from_json(survey.to_json(found)) == found


def test_a_box_in_which_a_file_has_nothing_is_refused(folder: Path) -> None:
    off = {"low": [0, 0, "1 mm"], "high": ["6 mm", "6 mm", "2 mm"]}
    found = loaded(folder, {"kind": "traction", "pressure": "1 MPa", **off}, {"kind": "velocity", "x": 0, **off})
    assert found.refused == [
        "boundaries[0]: no face of its meshes lies in its region",
        "boundaries[1]: no node of its meshes lies in its region",
    ]


def test_the_program_names_the_cache_of_kernels_before_numba_is_imported() -> None:
    """Numba reads the name of its cache when it is imported; therefore the program must not import numba at its
    beginning."""
    asked = "import sys, conoid.worker.scene.survey; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", asked], check=False).returncode == 0
