"""Tables in a terminal, and in a pipe."""

import io

import pytest

from conoid.cases.run import State
from conoid.client.console import PlainConsole
from conoid.client.options import show_lines
from conoid.client.tables import runs_table
from conoid.client.told import RunInfo

NAME, ID = "glass_steel_bar_at_210_metres_a_second", "0mb3k2d9x7f1q0a5z8w4ty"
RUNS = [
    RunInfo(
        id=ID, owner="ann", name=name, state=State.TIMED_OUT, cause="walltime", ranks=128, submitted=1.8e9,
        started=1.0, finished=7e4,
    )
    for name in (NAME, NAME.replace("_", "-"), "demo")
]  # fmt: skip


@pytest.mark.parametrize("width", [72, 80, 100])
def test_a_run_is_one_line_with_its_whole_id(width: int) -> None:
    out = io.StringIO()
    PlainConsole(file=out, width=width, highlight=False).print(runs_table(RUNS))
    _, _, *lines = out.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == [ID] * len(RUNS)
    assert [line.split()[1][:4] for line in lines] == ["glas", "glas", "demo"]
    assert all(" timed_o" in line for line in lines)


def test_a_pipe_gets_whole_names(capsys: pytest.CaptureFixture[str]) -> None:
    show_lines(runs_table(RUNS))
    assert [line.split()[1] for line in capsys.readouterr().out.splitlines()[2:]] == [run.name for run in RUNS]
