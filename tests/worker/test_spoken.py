"""Standard output of a worker without a server."""

from pathlib import Path
from typing import Any

import pytest

from conoid.cases import messages
from conoid.cases.outcome import Check, Outcome
from conoid.worker.output.spoken import Speaker

ENERGY = messages.Energy(
    kinetic=1.0, elastic=0.0, plastic=0.0, viscous=0.0, contact=0.0, external=0.0, initial=1.0, residual=2e-6
)


def printed(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Returns the lines of the output without the time of day."""
    return [line.split("  ", 1)[-1] for line in capsys.readouterr().out.splitlines()]


def test_start_progress_warnings_and_end_are_lines(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    speaker, head = Speaker(tmp_path), {"run": "r", "seq": 1, "wall": 0.0}

    def tell(kind: type[messages.Message], **fields: Any) -> None:
        speaker.tell(kind(**head, **fields))  # type: ignore[arg-type]

    tell(messages.Status, state="starting", message="compiling kernels: 1 of 3")
    tell(messages.Started, ranks=2, threads=3, elements=25920, nodes=5000, end_time=60e-6, setup=1.0, parts={})
    for n in range(40):
        tell(messages.Progress, step=100 + n, t=(30 + n / 100) * 1e-6, end_time=60e-6, dt=8.1e-9, limiter="tet 7",
             eta=42.0, energy=ENERGY, updates_per_second=1e6)  # fmt: skip
        tell(messages.Log, level="warning", text="the foot has folded")
        tell(messages.Log, level="info", text="step 3")
    check = Check(name="extent rod z", value=0.0215, expected=0.02, tolerance=1e-3, passed=False, unit="m")
    speaker.close(Outcome(
        state="succeeded", steps=848, elapsed=12.0, reference=[check], warnings=["the foot has folded", "dust"],
    ))  # fmt: skip
    assert [line.split("  ", 1)[-1] if ":" in line[:3] else line for line in capsys.readouterr().out.splitlines()] == [
        "compiling kernels: 1 of 3",
        f"running 25 920 tets, 5 000 nodes to 60.0 µs on 2 ranks x 3 threads; results in {tmp_path}",
        "50.0 %  t 30.0 µs of 60.0 µs  step 100  dt 8.10 ns (tet 7)  left 42 s  residual 2.0e-6",
        "warning: the foot has folded",
        "succeeded, 848 steps in 12 s",
        "reference missed: extent rod z 21.5 mm of 20.0 mm",
        "warning: dust",
        f"results in {tmp_path}: outcome.json, history.csv, journal.jsonl, log/",
    ]


def test_a_failure_names_its_cause(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    Speaker(tmp_path).close(Outcome(state="failed", cause="input", message="run.end = 3: unknown key\nrun.x = 1: no"))
    assert printed(capsys)[0] == "failed: run.end = 3: unknown key\\nrun.x = 1: no"
