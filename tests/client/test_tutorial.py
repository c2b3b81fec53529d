"""The blocks of the tutorial make a case that is valid, follows the schema, and has the estimate and the result that
the text gives.
"""

import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
from typer.testing import CliRunner

from conoid.cases.estimates.estimate import estimate
from conoid.cases.figures import rough
from conoid.cases.load import parse_case, toml_data
from conoid.cases.model.solids import Cad
from conoid.cases.reference.json_schema import json_schema
from conoid.cases.warnings.plausible import doubts
from conoid.client.cli import app
from conoid.client.result import Result

TEXT = (Path(__file__).parents[2] / "docs" / "tutorial" / "first_case.md").read_text(encoding="utf-8")
CASE = "\n".join(re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))


def test_the_pieces_are_a_sound_case() -> None:
    data = toml_data(CASE)
    case = parse_case(data)
    assert [doubt.key for doubt in doubts(data, case, estimate(case))] == ["materials.alumina.strength"]
    jsonschema.Draft202012Validator(json_schema()).validate(data)


def test_the_pieces_of_the_bullet_stand_in_its_case() -> None:
    """The mesh file of the tutorial case has the solids that the blocks name."""
    folder = Path(__file__).parents[2] / "docs" / "tutorial" / "bullet"
    text, case = (folder.parent / "bullet.md").read_text(), (folder / "bullet_tile.toml").read_text()
    pieces = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert len(pieces) == 4
    assert all(piece in case for piece in pieces)
    parts = parse_case(toml_data(case)).parts
    solids = [solid for part in parts if isinstance(part.mesh, Cad) for solid in part.mesh.solids]
    assert solids == ["core", "jacket"]
    assert all(f"PRODUCT('{solid}'," in (folder / "bullet.step").read_text() for solid in solids)


def test_the_tutorial_shows_the_printed_text(quiet_home: Path) -> None:
    (quiet_home / "tile.toml").write_text(CASE)
    shown = re.search(r"```\n(tile: valid, 1 warning\n.*?)```", TEXT, re.DOTALL)
    assert shown is not None
    printed = CliRunner().invoke(app, ["validate", "tile.toml"])
    assert [line.rstrip() for line in printed.stdout.splitlines()] == shown[1].splitlines()
    warned = CliRunner().invoke(app, ["validate", "tile.toml", "--set", "run.end_time=15"])
    assert set(warned.stderr.splitlines()) <= set(TEXT.splitlines())


def ran(folder: Path, case: str) -> Result:
    path = folder / "tile.toml"
    path.write_text(case, encoding="utf-8")
    out = folder / "run"
    subprocess.run([sys.executable, "-m", "conoid.worker", str(path), "--out", str(out)], check=True, timeout=600)
    return Result.open(out)


@pytest.mark.slow
def test_the_tutorial_ends_with_the_documented_results(tmp_path: Path) -> None:
    result = ran(tmp_path, CASE)
    end, history = result.outcome, result.history
    expected = estimate(parse_case(toml_data(CASE)))
    assert expected.memory_bytes is not None
    assert 1.0 <= (expected.memory_bytes + expected.dust_bytes) / end.peak_memory[0] < 1.3
    times, speeds, forces = ([abs(float(v)) for v in history[name]] for name in ("t", "sphere_speed", "backing_force"))
    force, at = max(zip(forces, times, strict=True))
    for text in (
        f"ends after {end.steps} steps with `{end.state}`, a worst residual of {rough(end.worst_residual)}",
        f"{end.fragments} fragments", f"sphere still has a speed of {speeds[-1]:.0f} m/s",
        f"was {1e-3 * force:.0f} kN in the quarter model, after {1e6 * at:.1f} us",
    ):  # fmt: skip
        assert text in " ".join(TEXT.split())


@pytest.mark.slow
def test_without_erosion_it_takes_more_than_three_times_as_many_steps(tmp_path: Path) -> None:
    (words,) = re.findall(r"ends after (\d+) steps", TEXT)
    result = ran(tmp_path, re.sub("(?m)^erosion.*$", "", CASE))
    assert result.outcome.state == "succeeded"
    assert (result.outcome.steps or 0) // int(words) == 3
