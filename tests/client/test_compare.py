"""Comparison of two runs; columns as tables and data frames; charts of the columns."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from typer.testing import CliRunner

from conoid.client.cli import app
from conoid.client.columns import read_columns
from conoid.client.errors import ClientError, UnfinishedError
from conoid.client.reports import curves
from conoid.client.reports.compare import Value, compare, differing, material
from conoid.client.result import Result

from .bodies import write_fragments, write_history, write_run

TIMES = [0.0, 4e-5, 8e-5]


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Result, Result]:
    """Two runs for the comparison; the second run is slower and breaks into more fragments."""
    for name, speed, masses in (("a", 10.0, [1.0, 2.0, 4.0, 1e-4]), ("b", 8.0, [1.0, 1.0, 1.0, 1.0, 2.0])):
        folder = write_run(tmp_path / name)
        write_history(
            folder, t=TIMES, dt=[1e-8] * 3, kinetic=[5.0, 4.0, speed], initial=[5.0] * 3, push=[0.0, speed, speed]
        )
        write_fragments(folder, 0, [7.0], t=0.0)
        write_fragments(folder, 7, masses)
    case = json.loads((tmp_path / "b" / "case.resolved.json").read_text())
    case["parts"][0]["mesh"] = {"element_size": 1e-3}
    (tmp_path / "b" / "case.resolved.json").write_text(json.dumps(case))
    return Result.open(tmp_path / "a"), Result.open(tmp_path / "b")


def test_keys_that_differ_are_named_as_the_user_writes_them() -> None:
    one: dict[str, Any] = {"run": {"ranks": 1}, "parts": [{"name": "rod", "velocity": [0.0, 1.0]}], "title": "x"}
    other: dict[str, Any] = {"run": {"ranks": 2}, "parts": [{"name": "rod", "velocity": [0.0, 2.0]}, {"name": "t"}]}
    found = {each.key: (each.a, each.b) for each in differing(one, other)}
    assert found == {
        "run.ranks": (1, 2), "parts.rod.velocity": ([0.0, 1.0], [0.0, 2.0]), "title": ("x", None),
        "parts.t.name": (None, "t"),
    }  # fmt: skip
    assert differing(one, one) == []


def test_ends_and_fragments_are_compared(runs: tuple[Result, Result]) -> None:
    found = compare(*runs)
    assert found.same_answer, "the digests of both are d"
    assert [each.key for each in found.keys] == ["parts.rod.mesh.element_size"]
    values = {each.name: each for each in [*found.ends, *found.sizes]}
    assert values["extent of rod"].difference == 0.0
    push = values["push, at the end"]
    assert (push.unit, push.a, push.b, push.difference) == ("m/s", 10.0, 8.0, -2.0)
    assert push.relative == pytest.approx(-0.2)
    whole = values["fragments of 10 tets or more"]
    assert (whole.a, whole.b) == (3, 5)
    assert values["dust"].a == 1
    assert values["largest fragment, of the mass"].b == pytest.approx(2.0 / 6.0)


def test_a_run_that_never_ended_by_itself_is_compared_too(runs: tuple[Result, Result], tmp_path: Path) -> None:
    ended = json.loads((tmp_path / "a" / "outcome.json").read_text())
    (tmp_path / "a" / "outcome.json").write_text(json.dumps({**ended, "eroded": 0}))
    (tmp_path / "b" / "outcome.json").write_text('{"state": "lost", "steps": null, "time": null, "elements": 5}')
    printed = CliRunner().invoke(app, ["compare", str(tmp_path / "a"), str(tmp_path / "b")])
    assert printed.exit_code == 0, printed.output
    steps = next(line for line in printed.stdout.splitlines() if line.startswith("steps"))
    assert steps.split()[2:] == ["–", "–", "–"], "of b, the difference, the share"
    assert "nan" not in printed.stdout


def test_the_command_prints_and_draws(runs: tuple[Result, Result], tmp_path: Path) -> None:
    out = tmp_path / "both.png"
    printed = CliRunner().invoke(app, ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--out", str(out)])
    assert printed.exit_code == 0, printed.output
    assert "both runs have the same answer, bit for bit" in printed.stdout
    assert "parts.rod.mesh.element_size" in printed.stdout
    assert out.read_bytes().startswith(b"\x89PNG")
    drawn = curves.comparison(material(*runs))
    assert [axes.get_ylabel() for axes in drawn.axes] == ["J", "m/s", "N"]
    assert [len(axes.lines) for axes in drawn.axes] == [2, 2, 2], "a curve a run"


def test_the_tables_are_read_on_a_terminal_of_80_columns(runs: tuple[Result, Result], tmp_path: Path) -> None:
    """Runs of a server have folder names of 22 letters, which the comparison must show."""
    for name in ("a", "b"):
        case = json.loads((tmp_path / name / "case.resolved.json").read_text())
        title = f"{name} bar of steel that hits a wall " * 20
        (tmp_path / name / "case.resolved.json").write_text(json.dumps({**case, "description": title}))
    folders = [(tmp_path / name).rename(tmp_path / f"1k17skpaczsdw34brntcee{name}") for name in ("a", "b")]
    printed = CliRunner().invoke(app, ["compare", *map(str, folders)], env={"COLUMNS": "80"})
    lines = [line.rstrip() for line in printed.stdout.splitlines()]
    assert max(map(len, lines)) <= 80
    assert [line.split() for line in lines[:2]] == [["A", folders[0].name], ["B", folders[1].name]]
    shown = {line.split()[0] for line in lines if line}
    assert {"steps", "time", "ranks", "push", "dust", "parts.rod.mesh.element_size"} <= shown, "a line each"
    assert next(line for line in lines if line.startswith("push")).endswith(" -20.00"), "nothing is cut off"
    assert sum("steel" in line for line in lines) <= 3, "of a description the beginning is enough"


def test_energy_is_drawn_without_its_kinetic_term(runs: tuple[Result, Result]) -> None:
    left, middle, _ = curves.energy(runs[0].history).axes
    assert "kinetic" in {line.get_label() for line in left.lines}
    assert not middle.lines, "nothing but kinetic energy is there"


def test_energy_is_drawn_part_by_part_where_there_are_several(tmp_path: Path) -> None:
    parts = {f"{name}.{part}": [1.0, 2.0] for part in ("glass", "steel") for name in ("kinetic", "internal")}
    write_history(
        write_run(tmp_path / "bar"), t=[0.0, 8e-5], initial=[8.0] * 2, residual=[1e-6] * 2, **parts, push=[0.0, 1.0]
    )
    history = Result.open(tmp_path / "bar").history
    *_, kinetic, internal = curves.energy(history).axes
    assert [line.get_label() for line in kinetic.get_lines()] == ["glass", "steel"]
    assert internal.get_title() == "internal energy of each part"
    assert curves.probes(history) == ["push"]


def test_the_step_is_drawn_by_what_holds_it(runs: tuple[Result, Result]) -> None:
    axes = curves.steps(runs[0].history).axes[0]
    assert {str(line.get_label()) for line in axes.lines[1:]} == {"stability: rod"}


def test_fragments_are_drawn_over_time_and_by_mass(runs: tuple[Result, Result]) -> None:
    tables = [runs[0].fragments_of(index) for index in runs[0].fragment_tables]
    over_time, by_mass = curves.fragments(tables).axes
    assert np.asarray(over_time.lines[0].get_ydata()).tolist() == [1, 4]
    assert np.asarray(over_time.lines[1].get_ydata()).tolist() == [1, 3]
    assert np.asarray(by_mass.lines[0].get_xdata()).tolist() == pytest.approx([4e3, 2e3, 1e3, 0.1])
    with pytest.raises(ClientError, match="no part of it can break"):
        curves.fragments([])


@pytest.mark.parametrize("name", ["energy", "dt", "fragments", "history"])
def test_every_figure_is_a_command(name: str, runs: tuple[Result, Result], tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["figures", name, str(tmp_path / "a"), str(tmp_path / f"{name}.svg")])
    assert done.exit_code == 0, done.output
    assert "<svg" in (tmp_path / f"{name}.svg").read_text()


def test_an_unknown_column_is_one_line(runs: tuple[Result, Result]) -> None:
    with pytest.raises(ClientError, match="column = 'pull': columns of numbers are: step, t"):
        curves.columns(runs[0].history, ["pull"])
    with pytest.raises(ClientError, match="column = 'limiter'"):
        curves.columns(runs[0].history, ["limiter"])


# Tables ---------------------------------------------------------------------------------------------------------------


def test_a_history_is_a_data_frame_with_units(runs: tuple[Result, Result]) -> None:
    frame = runs[0].history.frame()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame["push"]) == [0.0, 10.0, 10.0]
    assert frame.attrs["units"]["push"] == "m/s"


def test_fragments_of_every_frame_are_one_data_frame(runs: tuple[Result, Result]) -> None:
    frame = runs[0].fragments.frame()
    assert list(frame.groupby("frame")["mass"].count()) == [1, 4]
    assert frame.attrs["units"]["mass"] == "kg"
    assert set(frame["part"]) == {"rod"}
    with pytest.raises(UnfinishedError, match="no fragments of frame 3; there are 2 tables of fragments"):
        runs[0].fragments_of(3)


def test_without_pandas_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(ClientError, match=r"pip install 'conoid\[tables\]'"):
        read_columns("a [m]\n1\n").frame()


def test_tables_show_themselves_in_notebooks() -> None:
    html = read_columns("a [m],b\n" + "".join(f"{i},<{i}>\n" for i in range(20)))._repr_html_()
    assert "<th>a [m]</th>" in html
    assert "&lt;19&gt;" in html
    assert "&lt;9&gt;" not in html
    assert "20 lines" in html


@pytest.mark.parametrize(
    ("a", "b", "share"),
    [(2.0, 3.0, 0.5), (3.0, 2.0, -1 / 3), (-2.0, -3.0, -0.5), (-2.0, 2.0, 2.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0)],
)
def test_a_share_is_of_the_first_run(a: float, b: float, share: float) -> None:
    assert Value("x", "", a, b).relative == pytest.approx(share)


def test_of_a_first_run_that_has_none_there_is_no_share() -> None:
    assert math.isnan(Value("x", "", 0.0, 1.0).relative)
