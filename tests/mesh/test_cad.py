"""Solids of STEP and BREP files."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conoid.cases.model.bodies import Mesh
from conoid.worker.errors import MeshError
from conoid.worker.mesh.build import build
from conoid.worker.mesh.model import TetMesh, check
from conoid.worker.mesh.occ.solids import measured

from .cad_files import in_inches, in_metres, written

CUBE, ROD, PLATE = 1000.0, 45.0 * np.pi, 200.0
"""Volumes of the three solids, in cubic units of the file."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cad")


@pytest.fixture(scope="module")
def step(folder: Path) -> str:
    return written(folder)[0]


@pytest.fixture(scope="module")
def brep(folder: Path) -> bytes:
    return written(folder)[1]


def cad(path: Path, **more: Any) -> Any:
    request = {"shape": "cad", "path": path.name, "element_size": 2e-3, **more}
    return TypeAdapter[Mesh](Mesh).validate_python(request)


def made(path: Path, data: str | bytes, **more: Any) -> TetMesh:
    """Returns the mesh of a body, made in this process to save the time of a child process."""
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return check(measured(cad(path, **more), {"mesh": path}, "mesh"))


@pytest.mark.parametrize(
    ("change", "unit", "written_unit"),
    [(str, 1e-3, "1 mm"), (in_metres, 1.0, "1 m"), (in_inches, 0.0254, "1 in")],
    ids=["mm", "m", "inch"],
)
def test_a_file_contains_its_unit(folder: Path, step: str, change: Any, unit: float, written_unit: str) -> None:
    """The key ``unit`` may have the unit of the STEP file, and no other unit."""
    path = folder / "unit.step"
    for given in (None, written_unit):
        mesh = made(path, change(step), element_size=2.0 * unit, unit=given)
        assert mesh.volumes().sum() == pytest.approx((CUBE + ROD + PLATE) * unit**3, rel=0.01)
        assert mesh.points.max(axis=0) == pytest.approx(np.array([23.0, 10.0, 10.0]) * unit, rel=1e-9)
    with pytest.raises(MeshError, match=r"^mesh.path = 'unit.step': unit = 25.0 mm, but the STEP file is in "):
        made(path, change(step), unit="25 mm")


@pytest.mark.parametrize(
    ("solids", "volume"),
    [
        (["Core"], CUBE), ([2], ROD), (["Rod, 'x'"], ROD), (["Bullet"], CUBE + ROD + PLATE),
        (["Core", "Jacket"], CUBE + PLATE), ([1, "Core"], CUBE), ([], CUBE + ROD + PLATE),
    ],
)  # fmt: skip
def test_solids_are_chosen_by_name_and_number(folder: Path, step: str, solids: list[Any], volume: float) -> None:
    mesh = made(folder / "solids.stp", step, solids=solids)
    assert mesh.volumes().sum() == pytest.approx(1e-9 * volume, rel=1e-9 if volume == CUBE else 0.05)


def test_solids_that_touch_are_one_body(folder: Path, step: str) -> None:
    """The cube and the plate on it have common nodes on their common face."""
    mesh = made(folder / "two.step", step, solids=["Core", "Jacket"])
    between = np.flatnonzero(np.abs(mesh.points[:, 0] - 0.01) < 1e-9)
    sides = mesh.points[mesh.tets].mean(axis=1)[:, 0] > 0.01
    shared = np.intersect1d(mesh.tets[sides], mesh.tets[~sides])
    assert len(between) > 20
    assert set(shared.tolist()) == set(between.tolist())


def test_a_quarter_of_a_solid_is_a_quarter(folder: Path, step: str) -> None:
    mesh = made(folder / "q.step", step, solids=["Core"], sector="quarter", centre=["5 mm", "5 mm", 0])
    assert mesh.volumes().sum() == pytest.approx(0.25e-9 * CUBE, rel=1e-9)
    for direction in (0, 1):
        assert mesh.points[:, direction].min() == 0.005
    rod = made(folder / "h.step", step, solids=[2], sector="half", centre=["20 mm", 0, 0], element_size=1e-3)
    assert rod.volumes().sum() == pytest.approx(0.5e-9 * ROD, rel=0.02)
    assert rod.points[:, 0].min() == 0.02


def test_a_solid_of_a_file_is_an_operand(folder: Path, step: str) -> None:
    """The body is a hole in the cube of the file: position and rotation are those of the operands."""
    path = folder / "operand.step"
    path.write_text(step)
    hole = {"shape": "cylinder", "base": ["5 mm", "5 mm", "-1 mm"], "radius": "2 mm", "length": "20 mm"}
    turn = {"axis": "z", "angle": "90 deg", "centre": ["5 mm", "5 mm", 0]}
    of = [{"shape": "cad", "path": path.name, "solids": ["Core"], "turn": turn}, hole]
    body = TypeAdapter[Mesh](Mesh).validate_python({"shape": "difference", "of": of, "element_size": 1e-3})
    mesh = build(body, folder, "parts[0].mesh")
    assert mesh.volumes().sum() == pytest.approx(1e-9 * (CUBE - 40.0 * np.pi), rel=5e-3)
    path.write_text(step.replace("Core", "Kern"))
    with pytest.raises(MeshError, match=r"^parts\[0\].mesh.of\[0\].path = .*'Core' is not in the file, which has 3"):
        build(body, folder, "parts[0].mesh")


def test_a_brep_file_needs_a_unit(folder: Path, brep: bytes) -> None:
    path = folder / "a.brep"
    assert made(path, brep, unit="1 mm", solids=[1]).volumes().sum() == pytest.approx(1e-9 * CUBE, rel=1e-9)
    healed = made(path, brep, unit="1 mm", heal=True, element_size=3e-3)  # surfaces after healing are slow to mesh
    assert healed.volumes().sum() == pytest.approx(1.341e-6, rel=0.01)
    with pytest.raises(MeshError, match="a BREP file does not contain its unit; give the key unit"):
        made(path, brep)


def test_the_bytes_of_a_file_decide_its_mesh(folder: Path, step: str) -> None:
    """The mesh is made in a child process. Another file with the same name gives another mesh; an unchanged file is
    found in the cache.
    """
    path, made_again = folder / "child.step", []
    path.write_text(step)
    body = cad(path, solids=[1])
    first = build(body, folder)
    again = build(body, folder, made=lambda: made_again.append(1))
    assert np.array_equal(first.points, again.points)
    assert not made_again
    path.write_text(in_metres(step))
    assert build(cad(path, solids=[1], element_size=2.0), folder).points.max() == pytest.approx(10.0)
    with pytest.raises(MeshError, match=r"mesh.sha256 = '0{64}': 'child.step' has "):
        build(cad(path, sha256="0" * 64), folder)


def _without(step: str, begin: str) -> str:
    """Returns the text of the file without the first statement that contains ``begin``."""
    lines = step.split(";\n")
    lines.remove(next(line for line in lines if begin in line))
    return ";\n".join(lines)


def _open(step: str) -> str:
    """Returns the text of the file without one face of a shell."""
    head = step.index("CLOSED_SHELL('',(") + len("CLOSED_SHELL('',(")
    return step[:head] + step[step.index(",", head) + 1 :]


def test_surface_bodies_of_a_file_are_reported(folder: Path, step: str) -> None:
    """A plate that was saved as a surface beside solids must not be missing without a message."""
    note = "mesh: 1 surface body without volume in sheet.step: not in the mesh; only solids are read"
    sheet = step.replace("ENDSEC;\nEND-", "#9998 = OPEN_SHELL('',());\nENDSEC;\nEND-")
    for data, solids, notes in ((sheet, (), (note,)), (sheet, (1,), ()), (step, (), ())):
        origin = made(folder / "sheet.step", data, solids=list(solids)).origin
        assert origin is not None
        assert origin.notes == notes


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda step: step[: len(step) // 2], "the STEP file is cut off"),
        (lambda step: os.urandom(4000), "neither a STEP file (it begins with ISO-10303-21;) nor a BREP file"),
        (lambda step: "", "neither a STEP file"),
        (lambda step: step.replace("SI_UNIT(.MILLI.,.METRE.)", "$"), "the STEP file does not give its unit of length"),
        (lambda step: _without(step, "PLANE('"), "the STEP file is damaged: #"),
        (lambda step: step.replace("ENDSEC;\nEND-ISO", "#9 9 = (\nENDSEC;\nEND-ISO"), "the STEP file is damaged: "),
        (_open, "1 of 3 solids of the STEP file are not closed"),
        (lambda step: step.replace("ENDSEC;\nEND-", "#9999 = DOCUMENT_FILE('b.stp','',$,#1,'',$);\nENDSEC;\nEND-"),
         "the STEP file refers to other files (DOCUMENT_FILE), which are not read"),
    ],
    ids=["cut", "garbage", "empty", "unit", "lost", "syntax", "open", "external"],
)  # fmt: skip
def test_a_damaged_file_is_refused_in_one_line(folder: Path, step: str, damage: Any, message: str) -> None:
    with pytest.raises(MeshError) as refused:
        made(folder / "bad.step", damage(step))
    assert str(refused.value).startswith(f"mesh.path = 'bad.step': {message}")
    assert "\n" not in str(refused.value)


def test_brep_files_that_are_cut_off_and_huge_files_are_refused(folder: Path, brep: bytes) -> None:
    """OpenCASCADE would read such a damaged BREP file without end."""
    for share in (0.1, 0.5, 0.9, 0.99):
        with pytest.raises(MeshError, match="the BREP file is cut off"):
            made(folder / "cut.brep", brep[: int(share * len(brep))], unit="1 mm")
    huge = folder / "huge.step"
    with huge.open("wb") as file:
        file.truncate(300 * 2**20)
    with pytest.raises(MeshError, match="300 MiB are too many; allowed: up to 256"):
        measured(cad(huge), {"mesh": huge}, "mesh")
    huge.unlink()


def test_a_name_or_number_that_is_not_there_is_refused(folder: Path, step: str) -> None:
    for wanted in ("Nope", 4):
        with pytest.raises(
            MeshError, match="is not in the file, which has 3 solids: 1 'Core', 2 \"Rod, 'x'\", 3 'Jacket'"
        ):
            made(folder / "names.step", step, solids=[wanted])
