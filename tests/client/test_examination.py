"""``conoid validate`` and ``conoid batch`` read mesh files and report the content of the files, or the error that a run
would report.
"""

import importlib.util
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from conoid.client.cli import app

BAR = """*NODE
1, 0, 0, 0
2, 10, 0, 0
3, 0, 10, 0
4, 0, 0, 10
*ELEMENT, TYPE=C3D4, ELSET=All
1, 1, 2, 3, 4
*ELEMENT, TYPE=MASS
2, 1
"""
CASE = """
name = "bar"
contact = "none"
run.end_time = "100 us"
[[parts]]
name = "bar"
material = "steel"
mesh = { shape = "file", path = "bar.inp", unit = "1 mm", group = "All" }
"""


@pytest.fixture
def folder(quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A case with a mesh file of one tet of the size 10 mm."""
    monkeypatch.setenv("CONOID_CACHE_DIR", str(quiet_home / "cache"))
    (quiet_home / "bar.inp").write_text(BAR)
    (quiet_home / "bar.toml").write_text(CASE)
    return quiet_home


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_a_mesh_file_is_measured_and_its_estimate_is_that_of_its_tets(folder: Path) -> None:
    result = conoid("validate", "bar.toml", "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert answer["estimate"]["parts"][0]["bulk"]["mass"] == pytest.approx(7850.0 * 1e-6 / 6.0)
    assert answer["estimate"]["elements"] == 1
    assert answer["estimate"]["dt"] == pytest.approx(0.9 * answer["files"][0]["step_length"] / 5900.0, rel=0.2)
    assert [each["message"] for each in answer["warnings"]] == ["elements that carry no volume are skipped: 1 MASS"]
    assert answer["warnings"][0]["key"] == "parts[0].mesh.path"


def test_a_wrong_unit_gets_the_same_warning_as_for_any_body(folder: Path) -> None:
    result = conoid("validate", "bar.toml", "--set", "parts[0].mesh.unit='1 m'")
    assert result.exit_code == 0, result.output
    assert "warning: run.end_time = '0.0001 s': is shorter than the first time step" in result.stderr
    assert "10 x 10 x 10 m" in result.stdout
    assert "577 cm" in result.stdout or "5.77 m" in result.stdout


@pytest.mark.parametrize("command", ["validate", "batch"])
def test_an_input_that_a_run_refuses_is_refused_before_the_run(command: str, folder: Path) -> None:
    result = conoid(command, "bar.toml", "--set", "parts[0].mesh.group='ice'")
    assert result.exit_code == 2
    refused = "conoid: parts[0].mesh.group = 'ice': no such element set, instance or part; known: All"
    assert [line for line in result.stderr.splitlines() if not line.endswith("so far")] == [refused]
    assert not (folder / "runs").exists()


def test_without_the_worker_an_unread_mesh_file_is_reported(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "conoid.worker" else found(name))
    result = conoid("validate", "bar.toml")
    assert result.exit_code == 0
    assert (
        "parts[0].mesh.path = 'bar.inp': the file was not read, because the solver is not installed on this machine"
        in result.stderr
    )
