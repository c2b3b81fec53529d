"""The Python API with a real server in a separate process, over Zenoh and over SSE."""

from pathlib import Path

import pytest

from conoid.cases.reading.problems import CaseError
from conoid.cases.run import State
from conoid.client.errors import NotFoundError, ServiceError, UnfinishedError
from conoid.client.local.own_server import LocalServer
from conoid.client.remote.session import Session
from conoid.client.remote.stream import SseLink, ZenohLink

from .fakes import case_file


@pytest.fixture
def session(server: LocalServer) -> Session:
    return server.session


def test_a_run_is_submitted_watched_and_read(
    session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = session.submit(case_file(tmp_path, steps=4, pace=0.02))
    known = run.watch()
    assert (known.state, known.link, known.title) == (State.SUCCEEDED, "Zenoh", "A steel bar")
    printed = capsys.readouterr().out.splitlines()
    assert [line.split()[2] for line in printed][:4] == ["accepted", "queued", "starting", "running"]
    assert printed[-1].split()[2] == "succeeded"
    result = run.result()
    assert result.outcome.steps == 4
    assert list(result.history["t"]) == [0.5, 1.0]
    assert result.case["name"] == "bar"
    with pytest.raises(UnfinishedError, match="has not written any frame"):
        result.frame()


@pytest.mark.parametrize("lose", [0, 3])
def test_zenoh_delivers_every_message_once_and_in_order(session: Session, tmp_path: Path, lose: int) -> None:
    run = session.submit(case_file(tmp_path, steps=40, pace=0.01, lose=lose))
    link = run.link()
    assert isinstance(link, ZenohLink)
    received = list(run.messages(link=link))
    assert [message.seq for message in received] == list(range(1, len(received) + 1))
    assert received == run.events()


def test_a_late_subscriber_receives_all_messages(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, steps=60, pace=0.01))
    first = run.messages()
    while next(first).seq < 40:
        pass
    first.close()
    joined = [message.seq for message in run.messages()]
    assert joined == list(range(1, len(run.events()) + 1))
    assert [message.seq for message in run.messages(after=joined[-1] - 2)] == joined[-2:]


def test_sse_sends_the_same_messages(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, steps=20, pace=0.01))
    received = list(run.messages(link=SseLink(lambda: session.stream(f"{run.path}/stream"))))
    assert received == run.events()


def test_without_a_router_the_stream_falls_back_to_sse(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    me = session.me()
    monkeypatch.setattr(session, "me", lambda: type(me)(owner=me.owner, zenoh=None))
    known = session.submit(case_file(tmp_path)).watch()
    assert (known.state, known.link) == (State.SUCCEEDED, "SSE")


def test_a_run_is_cancelled(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path, steps=1000, pace=0.02))
    with pytest.raises(TimeoutError, match="is still"):
        run.wait(0.05)
    run.cancel()
    assert run.wait(20).state is State.CANCELLED
    assert run.cancel().state is State.CANCELLED, "to ask twice does no harm"


def test_files_are_listed_and_copied(session: Session, tmp_path: Path) -> None:
    run = session.submit(case_file(tmp_path))
    run.wait(20)
    names = [file.path for file in run.files()]
    assert {"case.toml", "journal.jsonl", "outcome.json"} <= set(names)
    assert run.download(tmp_path / "one", "outcome.json").read_bytes().startswith(b"{")
    copy = run.download(tmp_path / "all")
    assert sorted(path.relative_to(copy).as_posix() for path in copy.rglob("*") if path.is_file()) == sorted(names)
    assert (copy / "case.toml").read_bytes() == (tmp_path / "bar.toml").read_bytes()
    with pytest.raises(UnfinishedError, match=r"has no frames/000000\.vtkhdf"):
        run.download(tmp_path, "frames/000000.vtkhdf")
    with pytest.raises(NotFoundError, match="run 'nosuch': there is none"):
        session.run("nosuch")
    assert session.run(run.id[:-1]).id == run.id


def test_the_same_key_makes_one_run(session: Session, tmp_path: Path) -> None:
    case = case_file(tmp_path)
    assert session.submit(case, key="once").id == session.submit(case, key="once").id
    with pytest.raises(ServiceError, match="used for another case"):
        session.submit(case, ["run.end_time=2 us"], key="once")


def test_runs_are_listed_newest_first(session: Session, tmp_path: Path) -> None:
    ids = [session.submit(case_file(tmp_path)).id for _ in range(3)]
    assert [run.id for run in session.runs(limit=3)] == ids[::-1]
    for run_id in ids:
        session.run(run_id).wait(20)
    assert {run.state for run in session.runs(["succeeded"], limit=200)} == {State.SUCCEEDED}


def test_the_message_of_the_server_is_shown(session: Session, tmp_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        session.submit(case_file(tmp_path, ranks=64), ["run.end_tim=1"])
    assert list(map(str, caught.value.problems)) == ["run.end_tim: unknown key; did you mean 'end_time'?"]
    with pytest.raises(CaseError, match=r"run\.ranks"):
        session.submit(case_file(tmp_path, ranks=64))
    with pytest.raises(NotFoundError, match="there is none"):
        session.run("nothing")
    with Session(session.url, "conoid_0_guess") as stranger, pytest.raises(ServiceError, match="valid token"):
        stranger.runs()


def test_runs_are_found_by_their_labels(session: Session, tmp_path: Path) -> None:
    made = [
        session.submit(case_file(tmp_path), {"run": {"end_time": "2 us"}}, labels={"batch": "7", "speed": f"{k} m/s"})
        for k in range(2)
    ]
    session.submit(case_file(tmp_path))
    assert made[0].wait(20).labels == {"batch": "7", "speed": "0 m/s"}
    assert [run.id for run in session.runs(labels={"batch": "7"})] == [made[1].id, made[0].id]
    assert [run.id for run in session.runs(labels={"batch": "7", "speed": "1 m/s"})] == [made[1].id]
    assert "batch=7" in made[0]._repr_html_()
    with pytest.raises(ServiceError, match="label = 'a b=1': not a label"):
        session.submit(case_file(tmp_path), labels={"a b": "1"})
