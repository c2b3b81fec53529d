"""A stable time step that falls by orders of magnitude gives a warning with the tet and the remedy, on any number of
ranks.
"""

from pathlib import Path

import pytest

from conoid.cases.outcome import Outcome, from_json
from conoid.cases.output import layout

from .launching import command, ended

SQUASHED = """
name = "squashed"
contact = "none"
[materials.rubber]
density = 1000
elastic = { young = 1e6, poisson = 0.3 }
[[parts]]
name = "block"
material = "rubber"
[parts.mesh]
shape = "box"
low = [0, 0, 0]
high = [1e-3, 1e-3, 1e-3]
generator = "structured"
element_size = 1e-3
[[boundaries]]
kind = "velocity"
low = [-1, -1, 0.9e-3]
high = [1, 1, 1.1e-3]
z = -1
x = 0
y = 0
[[boundaries]]
kind = "velocity"
low = [-1, -1, -0.1e-3]
high = [1, 1, 0.1e-3]
x = 0
y = 0
z = 0
[run]
end_time = END
frames = 0
"""
"""All nodes have a prescribed motion: the body is flat at t = 1 ms."""


def outcome(tmp_path: Path, end: str, ranks: int, *words: str) -> Outcome:
    case, out = tmp_path / "squashed.toml", tmp_path / f"{end}_{ranks}"
    case.write_text(SQUASHED.replace("END", f'"{end}"'), encoding="utf-8")
    ended(command(ranks, str(case), "--out", str(out), *words))
    return from_json((out / layout.OUTCOME).read_bytes())


def warned(end: Outcome) -> list[str]:
    """Returns the warnings of a run; the numbers in the case have no units."""
    return [text for text in end.warnings if "no unit, taken for" not in text]


def test_a_half_flat_tet_gives_no_warning(tmp_path: Path) -> None:
    end = outcome(tmp_path, "0.5 ms", 1)
    assert (end.state, warned(end)) == ("succeeded", [])


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_flat_is(tmp_path: Path, ranks: int) -> None:
    end = outcome(tmp_path, "1.1 ms", ranks)
    assert end.state == "failed"
    [line] = warned(end)
    assert line.startswith("the stable step has fallen to ")
    assert "below 1/1000 of the first, at 0.00099" in line
    assert " s (stability: tet " in line
    assert " of block): about " in line


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_run_out_of_steps_reports_its_step_sizes(tmp_path: Path, ranks: int) -> None:
    """At the end of the run the body has a fifth of its initial height."""
    end = outcome(tmp_path, "1.1 ms", ranks, "--set", "run.max_steps=300")
    assert (end.state, end.cause, end.steps, warned(end)) == ("timed_out", "steps", 300, [])
    assert end.message.startswith("the run reached run.max_steps before run.end_time, at 0.0008")
    assert "; the stable step has fallen to " in end.message
    assert " of the first (stability: tet " in end.message
    assert end.message.endswith(" steps are left; erosion.time_step removes such tets")
