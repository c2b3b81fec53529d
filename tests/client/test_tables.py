"""Printed tables in a terminal and in a pipe."""

import io

import msgspec
import pytest

from conoid.cases.outcome import Compressed, Measured, Outcome
from conoid.cases.run import State
from conoid.client.commands import points_table
from conoid.client.commands.console import PlainConsole
from conoid.client.commands.options import show_lines
from conoid.client.commands.tables import end_tables, outcome_table, runs_table, short_names
from conoid.client.errors import UsageError
from conoid.client.remote.rows import Alike, RunRow, differing
from conoid.client.remote.run_info import RunInfo
from conoid.client.sweeps.sweep import text_rows

NAME, ID = "glass_steel_bar_at_210_metres_a_second", "0mb3k2d9x7f1q0a5z8w4ty"
SHORT = ID[:9]
INFOS = [
    RunInfo(
        id=ID, short=SHORT, owner="ann", name=name, state=State.TIMED_OUT, cause="walltime", ranks=128, submitted=1.8e9,
        started=1.0, finished=7e4, labels={"sweep": "s", "batch": "first"},
    )
    for name in (NAME, NAME.replace("_", "-"), "demo")
]  # fmt: skip
SPEED = "parts[0].velocity[2]"
COMMON = Alike(values={SPEED: 210.0}, units={SPEED: "m/s"}, results=[])
RUNS = [
    RunRow(
        info=info, values={SPEED: 100.0 * n}, results={}, units={SPEED: "m/s"}, references=2, missed=[], alike=COMMON
    )
    for n, info in enumerate(INFOS, 1)
]


@pytest.mark.parametrize("width", [72, 80, 100])
def test_a_run_is_one_line_with_its_short_id(width: int) -> None:
    out = io.StringIO()
    PlainConsole(file=out, width=width, highlight=False).print(runs_table(RUNS, [SPEED]))
    _, _, *lines = out.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == [SHORT] * len(RUNS)
    assert [line.split()[1][:4] for line in lines] == ["glas", "glas", "demo"]
    assert all(" timed_" in line for line in lines)


def test_a_pipe_gets_whole_names(capsys: pytest.CaptureFixture[str]) -> None:
    show_lines(runs_table(RUNS, [SPEED]))
    lines = capsys.readouterr().out.splitlines()[2:]
    assert [line.split()[1] for line in lines] == [run.name for run in INFOS]
    assert ["velocity[2] 100 m/s" in lines[0], "velocity[2] 300 m/s" in lines[2]] == [True, True]
    assert all("batch=first" in line and "sweep" not in line for line in lines)


def test_the_listed_values_differ_within_equal_cases() -> None:
    other = Alike(values={"x": 1.0}, units={}, results=[])
    alone = RunRow(
        info=INFOS[0], values={"x": 1.0, "run.ranks": 2}, results={}, units={}, references=0, missed=[], alike=other
    )
    assert differing([*RUNS, alone], 9) == [SPEED]
    assert differing(RUNS[:1], 9) == []


def test_the_outcome_has_the_largest_compression_of_laws_for_tension_only() -> None:
    met = Compressed(part="tile", times=21.1, most=50.6e9, least=0.0, tets=509, tet=1, x=0.0, y=0.0, z=0.0, time=1e-6)
    out = io.StringIO()
    for compressed in ([met], []):
        table = outcome_table(Outcome(state="succeeded", steps=851, compressed=compressed))
        PlainConsole(file=out, width=160, highlight=False).print(table)
    (line,) = [line for line in out.getvalue().splitlines() if "Griffith" in line]
    assert line.split(maxsplit=1)[1].strip() == (
        "tile up to 50.6 GPa, 21.10 times Griffith's criterion, 509 tets beyond the criterion at the same time"
    )


def test_the_outcome_has_the_serial_time_of_one_thread() -> None:
    ended = Outcome(
        state="succeeded", steps=1000, ranks=2, threads=3, helped=[9.0, 3.0],
        serial={"elements": [0.5, 1.0], "rest": [0.25, 1.0]}, parallel={"elements": [5.0, 6.0], "rest": [0.0, 0.0]},
    )  # fmt: skip
    for outcome, text in (
        (ended, "2.00 ms in serial code, 6.00 ms in parallel regions, in which the other threads are busy for 25 %"),
        (msgspec.structs.replace(ended, threads=1), "2.00 ms in serial code, 6.00 ms in parallel regions"),
    ):
        out = io.StringIO()
        PlainConsole(file=out, width=160, highlight=False).print(outcome_table(outcome))
        (line,) = [line for line in out.getvalue().splitlines() if line.startswith("a step")]
        assert line.removeprefix("a step").strip() == text


def test_the_end_of_a_run_has_its_probes_with_units_and_extremes() -> None:
    probes = [
        Measured(name="speed", value=120.0, unit="m/s", least=-5.0, most=400.0),
        Measured(name="count", value=3.0, least=0.0),
    ]
    out = io.StringIO()
    for part in end_tables(Outcome(state="succeeded", steps=10, probes=probes)):
        PlainConsole(file=out, width=120, highlight=False).print(part)
    head, _, *lines = out.getvalue().splitlines()[-4:]
    assert head.split() == ["probe", "at", "the", "end", "min", "max"]
    assert [line.split() for line in lines] == [
        ["speed", "120", "m/s", "-5", "m/s", "400", "m/s"], ["count", "3", "0", "–"]
    ]  # fmt: skip


def test_keys_are_shortened_while_they_stay_distinct() -> None:
    keys = ["parts[0].velocity[2]", "parts[1].velocity[2]", "run.end_time", "a.b.c", "x.b.c", "c"]
    assert list(short_names(keys).values()) == [*keys[:2], "end_time", "a.b.c", "x.b.c", "c"]


SWEEP = (
    "a.v [m/s],b.v [m/s],run,state,cause,probe.x [mm],probe.x.min [mm],fragments,broken,energy.kinetic [J],digest\n"
    + "".join(f"{v},{2 * v},r{v},succeeded,,{v / 3},{v / 9},{v},{v},{v * v},d{v}\n" for v in (100, 200))
)


def test_a_sweep_in_a_terminal_has_keys_state_and_what_differs() -> None:
    def printed(text: str, *, whole: bool) -> list[str]:
        out = io.StringIO()
        PlainConsole(file=out, width=120, highlight=False).print(
            points_table.table_of(text_rows(text), ["a.v", "b.v"], whole=whole)
        )
        return out.getvalue().splitlines()

    head, _, first, _, more = printed(SWEEP, whole=False)
    assert head.split() == [
        "a.v",
        "[m/s]",
        "b.v",
        "[m/s]",
        "state",
        "probe.x",
        "[mm]",
        "fragments",
        "broken",
        "energy.kinetic",
        "[J]",
    ]
    assert first.split() == ["100", "200", "succeeded", "33.3333", "100", "100", "10000"]
    assert more == "1 more result differs: --column NAME shows one, --out FILE.csv writes all"
    some = points_table.narrowed(SWEEP, ["a.v", "b.v"], ["broken", "probe.x [mm]"])
    assert some.splitlines()[0] == "a.v [m/s],b.v [m/s],run,state,broken,probe.x [mm]"
    assert printed(some, whole=True)[2].split() == ["100", "200", "succeeded", "100", "33.3333"]
    with pytest.raises(UsageError, match=r"'mass': not a column of the table; known: a.v, b.v, run"):
        points_table.narrowed(SWEEP, ["a.v"], ["mass"])
