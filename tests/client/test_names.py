"""Runs and sweeps are selected only by an id, by a prefix of an id, by 'last' or by a folder."""

import fcntl
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.client.cli import app
from conoid.client.errors import AnswerError, NotFoundError, UsageError
from conoid.client.remote.session import Session

from .hostile import Hostile, answering, hostile, run_info

IDS = ["1kbbx", "1kbbw", "1kaaa"]
NONE = answering({"detail": "run: there is none"}, 404)


@pytest.fixture
def server(quiet_home: Path) -> Iterator[Hostile]:
    """A fake server with three runs and three sweeps that have the same ids; it returns ids up to the requested id."""
    with hostile() as made:
        made.answers = {f"/v1/runs/{name}": answering(run_info(id=name)) for name in IDS}
        made.answers |= {f"/v1/sweeps/{name}": answering(sweep(name)) for name in IDS}
        made.answers["/v1/runs"] = answering({"runs": [run_info(id=name) for name in IDS], "next": None})
        made.answers["/v1/sweeps"] = answering({"sweeps": [sweep(name) for name in IDS], "next": None})
        yield made


def sweep(name: str) -> dict[str, Any]:
    return {"id": name, "name": "bar", "submitted": 0.0, "total": 0, "states": {}}


def conoid(*words: object) -> str:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.stdout


def refused(code: int, *words: object) -> str:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == code, result.output
    (line,) = result.stderr.splitlines()
    return line


def test_a_name_that_nothing_has_raises(server: Hostile) -> None:
    with Session(server.url) as session:
        for name in ("nosuch", "", "..", "a b", "ü", "-x", "x" * 300, "a/b", "\0"):
            with pytest.raises(NotFoundError):
                session.run(name)
            with pytest.raises(NotFoundError):
                session.find_sweep(name)


def test_a_unique_prefix_is_enough(server: Hostile) -> None:
    server.answers["/v1/runs"] = answering({"runs": [run_info(id="1kaaa")], "next": None})
    server.answers["/v1/sweeps"] = answering({"sweeps": [sweep("1kaaa")], "next": None})
    with Session(server.url) as session:
        assert session.run("1ka").id == "1kaaa"
        assert session.find_sweep("1ka").id == "1kaaa"
        assert session.run("last").id == "1kaaa"
    assert "1kaaa" in conoid("show", "1ka", "--url", server.url)
    assert "/v1/runs?limit=9&prefix=1ka" in server.asked


def test_an_ambiguous_prefix_is_one_line_with_all_matches(server: Hostile) -> None:
    with Session(server.url) as session:
        with pytest.raises(UsageError, match="run = '1kbb': several ids have this beginning: 1kbbx, 1kbbw"):
            session.run("1kbb")
        with pytest.raises(UsageError, match="sweep = '1kbb': several ids have this beginning: 1kbbx, 1kbbw"):
            session.find_sweep("1kbb")
        assert session.run("1kbbx").id == "1kbbx", "the whole id is that of one"
    assert "several ids have this beginning" in refused(2, "cancel", "1kbb", "--url", server.url)


def test_the_message_of_a_server_without_prefix_search_is_shown(server: Hostile) -> None:
    server.answers["/v1/runs"] = answering({"detail": "prefix: no such parameter"}, 400)
    with Session(server.url) as session, pytest.raises(NotFoundError, match="there is none"):
        session.run("1kb")


def test_a_list_without_end_is_given_up(server: Hostile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.client.remote.session._MOST_PAGES", 5)
    server.answers["/v1/runs"] = answering({"runs": [], "next": "x"})
    server.answers["/v1/sweeps"] = answering({"sweeps": [], "next": "x"})
    server.answers["/v1/runs/1kaaa/events"] = answering({"events": [], "last": 0, "more": True})
    with Session(server.url) as session:
        for endless in (session.runs, session.sweeps, session.run("1kaaa").events):
            with pytest.raises(AnswerError, match="has no end"):
                endless()


# Folders --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def folder(quiet_home: Path) -> Path:
    """Makes a running run in a folder whose name is not an id."""
    made = quiet_home / "my runs" / "a%b ü"
    made.mkdir(parents=True)
    journal: list[messages.AnyMessage] = [
        messages.Status(run="r", seq=1, wall=1.7e9, state="queued"),
        messages.Status(run="r", seq=2, wall=1.7e9 + 5, state="running"),
    ]
    (made / layout.JOURNAL).write_bytes(b"".join(messages.to_json(each) + b"\n" for each in journal))
    (made / layout.RESOLVED_CASE).write_text(json.dumps({"name": "bar", "title": "A bar", "run": {"ranks": 3}}))
    return made


@pytest.fixture
def worker(folder: Path) -> Iterator[None]:
    """Holds the lock of a run's folder, as rank 0 does."""
    with open(folder / layout.LOCK, "a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.mark.usefixtures("worker")
def test_a_run_in_a_folder_is_shown_and_asked(folder: Path) -> None:
    answer = json.loads(conoid("show", folder, "--json"))
    assert (answer["id"], answer["state"], answer["ranks"], answer["name"]) == ("a%b ü", "running", 3, "bar")
    assert "A bar" in conoid("show", folder)
    assert "checkpoint requested" in conoid("checkpoint", folder)
    assert "snapshot requested" in conoid("snapshot", folder)
    assert "requested to stop" in conoid("cancel", folder)
    assert {layout.CHECKPOINT_REQUEST, layout.SNAPSHOT_REQUEST, layout.STOP_REQUEST} <= {
        p.name for p in folder.iterdir()
    }


def test_a_run_in_a_folder_without_a_worker_is_lost(folder: Path) -> None:
    assert json.loads(conoid("show", folder, "--json"))["state"] == "lost"
    assert "no worker writes into this folder" in refused(1, "checkpoint", folder)


def test_the_end_of_a_run_in_a_folder_is_shown(folder: Path) -> None:
    (folder / layout.OUTCOME).write_text('{"state": "failed", "cause": "energy", "message": "made energy", "steps": 7}')
    text = conoid("show", folder)
    assert "failed (energy)" in text
    assert "made energy" in text
    assert "7 steps" in text


def test_files_of_a_folder_are_copied(folder: Path, quiet_home: Path) -> None:
    assert conoid("get", folder, layout.JOURNAL, "--out", "copy").strip() == f"copy/{layout.JOURNAL}"
    assert Path("copy", layout.JOURNAL).read_bytes() == (folder / layout.JOURNAL).read_bytes()
    listed = json.loads(conoid("get", folder, "--json"))
    assert {each["path"] for each in listed} == {layout.JOURNAL, layout.RESOLVED_CASE}
    assert "has no none" in refused(1, "get", folder, "none", "--out", "copy")


def test_a_command_that_needs_a_server_is_refused_for_a_folder(folder: Path) -> None:
    assert "this command needs a server" in refused(2, "restart", folder)
    assert "not found; an id has letters and digits" in refused(1, "sweep-table", folder)


def test_a_copy_of_a_run_does_not_stand_for_the_one_of_the_server(folder: Path, server: Hostile) -> None:
    """The command conoid get makes a folder with the id of the run as its name."""
    name = "1kaaa".ljust(22, "0")
    folder.rename(Path(name))
    server.answers[f"/v1/runs/{name}"] = answering(run_info(id=name))
    server.answers[f"/v1/runs/{name}:cancel"] = answering(run_info(id=name, state="stopping"))
    assert conoid("cancel", name, "--url", server.url) == f"{name} stopping\n"
    assert "no worker writes into this folder" in conoid("cancel", f"./{name}/../{name}")


@pytest.mark.parametrize("name", ["-x", "a%b", "a\\b", "a b", "ü", "[red]", "%s{0}"])
def test_a_folder_may_have_any_name(name: str, folder: Path, quiet_home: Path) -> None:
    (folder / layout.OUTCOME).write_text('{"state": "succeeded"}')
    folder.rename(quiet_home / name)
    for command in ("watch", "show"):
        assert CliRunner().invoke(app, [command, "--", name]).exit_code == 0
    assert name in conoid("show", f"./{name}")
