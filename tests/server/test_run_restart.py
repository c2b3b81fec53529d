"""The request ``:restart`` makes a new run that continues from a checkpoint of another run."""

import json
import os
import shutil
from pathlib import Path

import pytest

from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.cases.output.checkpoints import MANIFEST, SEAL
from conoid.cases.run import Cause, State
from conoid.server.errors import ServiceError
from conoid.server.runs import restarts
from conoid.server.runs.folder import write_outcome
from conoid.worker.migration.checkpoint import latest

from .checkpointed import made, with_checkpoint, with_checkpoint_in
from .running import Running


def test_a_new_run_copies_the_checkpoints(server: Running, tmp_path: Path) -> None:
    run = server.ann.submit(wait=str(tmp_path / "go"))
    server.ann.wait_for(run, State.RUNNING)
    with_checkpoint(server, run, 7)
    source = with_checkpoint(server, run, 40)
    server.ann.http.post(f"/v1/runs/{run}:cancel")
    server.ann.wait_for(run)
    (tmp_path / "go").touch()
    ask = f"/v1/runs/{run}:restart?ranks=1&threads=2"
    made = [server.ann.http.post(ask, headers={"Idempotency-Key": "k"}) for _ in range(2)]
    assert [answer.status_code for answer in made] == [202, 202]
    fresh = made[0].json()["id"]
    assert fresh == made[1].json()["id"] != run
    assert (made[0].json()["ranks"], made[0].json()["threads"]) == (1, 2)
    folder = server.ann.runs / fresh
    assert sorted(path.name for path in (folder / layout.CHECKPOINTS).iterdir()) == ["000000007", "000000040"]
    frame, history = folder / layout.FRAMES / "000000.vtkhdf", folder / layout.HISTORY
    assert frame.stat().st_ino == (source / layout.FRAMES / "000000.vtkhdf").stat().st_ino, "it takes no room"
    assert history.stat().st_ino != (source / layout.HISTORY).stat().st_ino, "this one is appended to"
    assert server.ann.show(fresh)["labels"] == {"restart": run}
    assert server.ann.wait_for(run)["state"] == "cancelled"


def test_a_run_that_has_used_up_its_steps_needs_more_of_them(server: Running) -> None:
    run = server.ann.submit(end="crash")
    server.ann.wait_for(run)
    source = with_checkpoint(server, run, 40)
    write_outcome(source, Outcome(state=State.TIMED_OUT, cause=Cause.STEPS, steps=40))
    for more, given in (("", ""), ("?max_steps=40", "max_steps = 40: "), ("?ranks=1&max_steps=7", "max_steps = 7: ")):
        answer = server.ann.http.post(f"/v1/runs/{run}:restart{more}")
        assert (answer.status_code, answer.json()["code"]) == (409, "no_steps_left")
        assert answer.json()["detail"] == f"{given}run {run} has gone 40 steps; give max_steps a number above 40"
    answer = server.ann.http.post(f"/v1/runs/{run}:restart?max_steps=41")
    assert answer.status_code == 202
    case = server.ann.runs / answer.json()["id"] / "case.json"
    assert json.loads(case.read_text())["run"]["max_steps"] == 41


def test_without_a_checkpoint_there_is_nothing_to_go_on_from(server: Running) -> None:
    run = server.ann.submit()
    server.ann.wait_for(run)
    answer = server.ann.http.post(f"/v1/runs/{run}:restart")
    assert (answer.status_code, answer.json()["code"]) == (409, "no_checkpoint")
    assert answer.json()["detail"] == f"run {run} has no checkpoint: a run that has succeeded keeps no checkpoint"
    assert len(server.ann.http.get("/v1/runs").json()["runs"]) == 1
    assert not list(server.ann.runs.glob(".new-*"))
    assert server.bob.http.post(f"/v1/runs/{run}:restart").status_code == 404
    with_checkpoint(server, run, 3)
    assert server.ann.http.post(f"/v1/runs/{run}:restart?ranks=3").status_code == 422, "there are 2 slots"
    assert server.ann.http.post(f"/v1/runs/{run}:restart?ranks=2&threads=2").status_code == 422


def test_a_run_without_checkpoints_explains_how_to_get_some(server: Running) -> None:
    run = server.ann.submit(end="crash", extra='checkpoint_every = "60 s"')
    server.ann.wait_for(run)
    detail = server.ann.http.post(f"/v1/runs/{run}:restart").json()["detail"]
    assert detail.startswith(
        f"run {run} has no checkpoint: it has written none; one is written every run.checkpoint_every"
    )
    assert "(60 s in its case)" in detail


def remade(path: Path, kind: str) -> None:
    """Replaces a file with something else, for example a folder."""
    path.unlink()
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "endless":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()


@pytest.mark.parametrize("name", [MANIFEST, SEAL, "rank-0.h5"])
@pytest.mark.parametrize("kind", ["gone", "empty", "half", "null", "pipe", "endless", "folder"])
def test_where_the_newest_is_damaged_a_new_run_gets_the_one_before(tmp_path: Path, name: str, kind: str) -> None:
    source = made(tmp_path / "a", 10, 20)
    path = layout.checkpoint(source, 20) / name
    if kind in {"empty", "half", "null"}:
        path.write_bytes({"empty": b"", "half": path.read_bytes()[: path.stat().st_size // 2], "null": b"null"}[kind])
    else:
        remade(path, kind)
    restarts.fill(source, tmp_path / "b")
    place, _, warnings = latest(tmp_path / "b")
    assert place.name == "000000010"
    (warning,) = warnings
    assert warning.startswith("checkpoint 000000020 is damaged: ")
    shutil.rmtree(layout.checkpoint(source, 10))
    with pytest.raises(ServiceError, match="no checkpoint: all are damaged; 000000020: ") as raised:
        restarts.fill(source, tmp_path / "c")
    assert raised.value.status == 409


def test_results_that_are_not_files_are_left_out(tmp_path: Path) -> None:
    source = with_checkpoint_in(made(tmp_path / "a", 10))
    remade(source / "fragments" / "000000.csv", "pipe")
    remade(source / layout.HISTORY, "endless")
    restarts.fill(source, tmp_path / "b")
    assert not (tmp_path / "b" / layout.HISTORY).exists()
    assert (tmp_path / "b" / layout.FRAMES / "000000.vtkhdf").exists()


def test_a_checkpoint_that_is_replaced_meanwhile_is_searched_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run in progress keeps only its newest checkpoints, and may write another checkpoint at any time."""
    source, real = made(tmp_path / "a", 10), os.link

    def replaced(one: str, other: str) -> None:
        if layout.checkpoint(source, 10).exists():
            shutil.rmtree(layout.checkpoint(source, 10))
            made(source, 20)
        real(one, other)

    monkeypatch.setattr(os, "link", replaced)
    restarts.fill(source, tmp_path / "b")
    assert [path.name for path in (tmp_path / "b" / layout.CHECKPOINTS).iterdir()] == [
        layout.checkpoint(source, 20).name
    ]


def test_checkpoints_that_are_replaced_all_the_time_are_asked_for_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = made(tmp_path / "a", 10)

    def replaced(one: str, other: str) -> None:
        step = int(Path(one).parent.name)
        shutil.rmtree(layout.checkpoint(source, step))
        made(source, step + 10)
        raise FileNotFoundError(one)

    monkeypatch.setattr(os, "link", replaced)
    with pytest.raises(ServiceError, match="replaced faster") as raised:
        restarts.fill(source, tmp_path / "b")
    assert (raised.value.status, raised.value.body["retryable"]) == (503, True)
