"""Tests of the benchmark of ranks times threads: the benchmark continues from stored runs, and stops when its time is
used up.
"""

from pathlib import Path

import pytest

from conoid.cases import outcome
from conoid.cases.messages import to_json
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.client.remote.submission import case_of
from conoid.client.studies.scaling import Trial
from tests.client import studies

from . import threads


@pytest.mark.parametrize("name", threads.SCENES)
def test_a_scene_is_a_case(name: str) -> None:
    scene = threads.SCENES[name]
    assert case_of(scene.case, [*scene.changes, *threads._QUIET]).name == scene.case


def made(folder: Path, trial: Trial, state: str = "succeeded") -> None:
    """Writes the files of a finished run."""
    place = folder / trial.folder
    place.mkdir(parents=True)
    ended = Outcome(state=state, steps=4, elapsed=9.0, setup=0.0, digest="abc", threads=trial.threads)
    (place / layout.OUTCOME).write_bytes(outcome.to_json(ended))
    line = studies.load(
        phases={"elements": [5.0], "exchange": [0.0]}, waiting=[0.0], steps=4, messages=[0], bytes=[0],
        collectives=[0], collective_bytes=[0],
    )  # fmt: skip
    (place / layout.JOURNAL).write_bytes(to_json(line) + b"\n")


def test_ended_points_are_kept_and_others_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, str]] = []

    def run(case: str, changes: list[str], trial: Trial, folder: Path, seconds: float) -> None:
        if not (folder / trial.folder).exists():
            asked.append((folder.name, trial.folder))
            made(folder, trial)

    monkeypatch.setattr(threads, "run", run)
    monkeypatch.setattr(threads, "CORES", 16)
    made(tmp_path / "rod", Trial(1, 1))
    made(tmp_path / "rod", Trial(1, 16), "cancelled")
    words = [str(tmp_path), "--scenes", "rod,bar", "--ranks", "1x16,1x2"]
    assert threads.main(words) == 0
    assert asked == [("bar", "ranks-1"), ("rod", "ranks-1x16"), ("bar", "ranks-1x16"), ("rod", "ranks-1x2"),
                     ("bar", "ranks-1x2")]  # fmt: skip
    assert "| 1x16 " in capsys.readouterr().out
    assert threads.main([*words, "--minutes", "0"]) == 0, "all are there"
    assert threads.main([str(tmp_path), "--scenes", "large", "--minutes", "0"]) == 3
