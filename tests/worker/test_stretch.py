"""Quiet steps in one compiled program give the same result to the bit as single steps, and the same end of a run."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

import pytest

from conoid.cases import load
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.run import requests
from conoid.worker.run.compute import ALL, compute
from conoid.worker.stretch import Stretch, Until

BODY = """
name = "quiet"
contact = "none"
[materials.m]
density = "7850 kg/m^3"
elastic.young = "200 GPa"
elastic.poisson = 0.3
{law}
[[parts]]
name = "body"
material = "m"
velocity = ["0 m/s", "5 m/s", "-{speed} m/s"]
spin = {{ centre = ["2 mm", "2 mm", "2 mm"], rate = ["0 rad/s", "300 rad/s", "100 rad/s"] }}
{more}
[parts.mesh]
shape = "box"
low = ["0 mm", "0 mm", "0.1 mm"]
high = ["4 mm", "3 mm", "5.1 mm"]
generator = "structured"
element_size = "1 mm"
[numerics]
pressure = "{form}"
[run]
end_time = "{end}"
frames = 3
samples = 7
snapshots = 0
"""
PLASTIC = 'strength = { model = "linear_hardening", yield_stress = "400 MPa", hardening = "100 MPa" }'
WALL = '[[boundaries]]\nkind = "wall"\npoint = ["0 m", "0 m", "0 m"]\nnormal = [0.1, 0, 1]\nfriction = 0.3\n'
SYMMETRY = '[[boundaries]]\nkind = "symmetry"\naxis = "x"\n'
ASIDE = '[[boundaries]]\nkind = "symmetry"\naxis = "y"\nat = "-0.01 mm"\n'
GRAVITY = '[[boundaries]]\nkind = "gravity"\nacceleration = ["0 m/s^2", "1e6 m/s^2", "-1e7 m/s^2"]\n'
DRIVE = """
[[boundaries]]
kind = "velocity"
low = ["-1 m", "-1 m", "5 mm"]
high = ["1 m", "1 m", "6 mm"]
z = "3 m/s"
"""
COURSE = GRAVITY + "course = [[0, 1], ['3 us', 0.2]]\n"
SCENES = {
    "free": ("standard", "", 20, "", ""),
    "wall": ("standard", "", 150, "", WALL),
    "plastic wall": ("nodal", PLASTIC, 300, "", WALL + SYMMETRY),
    "split, symmetry": ("split", PLASTIC, 200, "", WALL + SYMMETRY + ASIDE),
    "gravity and drive": ("standard", "", 50, "", GRAVITY + DRIVE),
    "a load that changes": ("standard", "", 50, "", COURSE + WALL),
    "erosion": ("standard", PLASTIC, 400, "erosion.plastic_strain = 0.2", WALL),
    "crushed": ("standard", "", 0, "", DRIVE.replace("3 m/s", "-3000 m/s") + WALL),
}


class End:
    """Signals of a run without handlers."""

    raised = False


@dataclass
class Programs:
    """Counts the steps that are computed by programs."""

    steps: list[int] = field(default_factory=list)
    run = Stretch.run

    def __call__(self, stretch: Stretch, until: Until) -> int:
        self.steps.append(Programs.run(stretch, until))
        return self.steps[-1]


def text_of(scene: str, end: str = "12 us") -> str:
    form, law, speed, more, boundaries = SCENES[scene]
    return BODY.format(form=form, law=law, speed=speed, more=more, end=end) + boundaries


def run(text: str, folder: Path, threads: int = 1, signals: object = End) -> Outcome:
    folder.mkdir(parents=True)
    case = load.parse_case(load.apply_overrides(load.toml_data(text), [f"run.threads={threads}"]))
    return compute(case, folder, folder, SerialComm(), None, signals, time.monotonic(), False, ALL)  # type: ignore[arg-type]


def step_by_step(text: str, folder: Path) -> Outcome:
    with patch.object(Stretch, "run", lambda *_: 0):
        return run(text, folder)


@pytest.fixture(autouse=True)
def no_reports(monkeypatch: pytest.MonkeyPatch) -> None:
    """The runs of this test write no report, for any speed of the machine: every step with a report ends a program."""
    monkeypatch.setattr(requests, "_REPORT_EVERY", 1e6)


@pytest.mark.parametrize("scene", SCENES)
def test_programs_change_no_bit(scene: str, tmp_path: Path) -> None:
    alone, counted = step_by_step(text_of(scene), tmp_path / "alone"), Programs()
    with patch.object(Stretch, "run", lambda *given: counted(*given)):
        outcomes = [run(text_of(scene), tmp_path / str(threads), threads) for threads in (1, 3)]
    for threads, outcome in zip((1, 3), outcomes, strict=True):
        assert (outcome.digest, outcome.steps, outcome.eroded) == (alone.digest, alone.steps, alone.eroded)
        assert (outcome.state, outcome.cause, outcome.message) == (alone.state, alone.cause, alone.message)
        assert outcome.worst_residual == alone.worst_residual
        history = (tmp_path / str(threads) / layout.HISTORY).read_bytes()
        assert history == (tmp_path / "alone" / layout.HISTORY).read_bytes()
    assert any(counted.steps) == (scene != "a load that changes")


def test_snapshots_that_wait_for_a_wall_time_prevent_no_program(tmp_path: Path) -> None:
    text, counted = text_of("free").replace("snapshots = 0", "snapshots = 100"), Programs()
    with patch.object(Stretch, "run", lambda *given: counted(*given)):
        outcome = run(text, tmp_path / "snapshots")
    assert outcome.steps is not None
    assert sum(counted.steps) > 0.5 * outcome.steps


def test_a_run_ends_after_the_same_number_of_steps(tmp_path: Path) -> None:
    text = text_of("free").replace("frames = 3", "max_steps = 37")
    assert run(text, tmp_path / "program").steps == step_by_step(text, tmp_path / "alone").steps == 37


def test_a_signal_ends_the_run_at_the_end_of_a_program(tmp_path: Path) -> None:
    signals, counted = End(), Programs()

    def signalled(stretch: Stretch, until: Until) -> int:
        steps = counted(stretch, until)
        signals.raised = sum(counted.steps) > 1000
        return steps

    with patch.object(Stretch, "run", signalled):
        outcome = run(text_of("free", "1 s"), tmp_path / "cancelled", 1, signals)
    assert outcome.state == "cancelled"
    assert outcome.steps is not None
    alone = counted.steps.count(0)
    assert 0 <= outcome.steps - sum(counted.steps) - alone <= 1
    assert max(counted.steps) < outcome.steps
