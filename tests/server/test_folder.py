"""Folder of a run: ids, creation in one step, and the files that can be read."""

import math
from pathlib import Path

from conoid.cases import messages
from conoid.cases.outcome import Check, Outcome, to_json
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.runs import folder
from conoid.server.runs.folder import Submission


def submission(run: str, now: float) -> Submission:
    return Submission(
        id=run, owner="ann", name="bar", title="", ranks=2, submitted=now, case_file="case.toml", body_sha256="x",
        idempotency_key="k", wall_time=3.0, estimate={"steps": 7, "dt": 1e-8},
    )  # fmt: skip


def test_ids_sort_by_time_and_are_never_the_same() -> None:
    made = [folder.new_id() for _ in range(2000)]
    ids = [run for run, _ in made]
    assert ids == sorted(set(ids))
    assert [now for _, now in made] == sorted(now for _, now in made)
    assert all(map(folder.is_id, ids))
    assert not any(map(folder.is_id, ["", "..", "x" * 22 + "/", ids[0].upper(), ids[0] + "\n"]))


def test_a_new_folder_contains_its_run(tmp_path: Path) -> None:
    run, now = folder.new_id()
    made = folder.create(tmp_path, submission(run, now), b"case", b"resolved")
    assert (made / "case.toml").read_bytes() == b"case"
    assert (made / layout.RESOLVED_CASE).read_bytes() == b"resolved"
    assert folder.submission(made) == submission(run, now)
    read = folder.run(made)
    assert (read.id, read.owner, read.state, read.submitted) == (run, "ann", State.ACCEPTED, now)
    assert (folder.outcome(made), folder.outcome_error(made), folder.process(made)) == (None, "", None)


def test_messages_of_the_start_do_not_restart_the_run(tmp_path: Path) -> None:
    run, now = folder.new_id()
    made = folder.create(tmp_path, submission(run, now), b"case", b"resolved")
    with (made / layout.JOURNAL).open("ab") as journal:
        for seq, (state, wall) in enumerate([("queued", 1.0), ("starting", 2.0), ("starting", 60.0)], 2):
            journal.write(messages.to_json(messages.Status(run=run, seq=seq, wall=now + wall, state=state)) + b"\n")
    read = folder.run(made)
    assert (read.state, read.started) == (State.STARTING, now + 2.0)


def test_a_scan_finds_runs_only_and_removes_what_was_never_promised(tmp_path: Path) -> None:
    runs = [folder.new_id() for _ in range(3)]
    for run, now in runs:
        folder.create(tmp_path, submission(run, now), b"", b"")
    (tmp_path / f".new-{folder.new_id()[0]}" / "log").mkdir(parents=True)
    (tmp_path / folder.new_id()[0]).mkdir()
    (tmp_path / "server.json").touch()
    assert [path.name for path in folder.scan(tmp_path)] == [run for run, _ in runs]
    assert not list(tmp_path.glob(".new-*"))


def test_an_outcome_with_an_invalid_number_can_be_read(tmp_path: Path) -> None:
    check = Check(name="mean", value=math.nan, expected=1.0, tolerance=0.1, passed=False)
    (tmp_path / layout.OUTCOME).write_bytes(to_json(Outcome(state="succeeded", time=math.nan, reference=[check])))
    outcome = folder.outcome(tmp_path)
    assert outcome is not None
    assert math.isnan(outcome.reference[0].value)
    assert math.isnan(outcome.time)
    assert outcome.reference[0].expected == 1.0
