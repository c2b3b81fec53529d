"""Server-sent events from a real server: each event arrives once, in order, live, and after a resumption."""

import json
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from conoid.cases.run import State

from .running import PATIENCE, MakeProcess, User, processes


@pytest.fixture(scope="module")
def ann(tmp_path_factory: pytest.TempPathFactory) -> Iterator[User]:
    with processes(tmp_path_factory.mktemp("stream")) as make:
        server = make("--no-zenoh", "--slots", "8")
        yield server.user(server.start()["url"])


def listen(user: User, run: str, headers: dict[str, str] | None = None, **query: int) -> Iterator[dict[str, Any]]:
    """Yields the events of a stream when they arrive, each with the ``id`` and the ``event`` of its frame."""
    with user.http.stream("GET", f"/v1/runs/{run}/stream", headers=headers, params=query) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        for frame in httpx2.EventSource(answer):
            if frame.data:
                yield {**json.loads(frame.data), "id": frame.id, "event": frame.event}


def test_replay_and_live_without_a_gap(ann: User, tmp_path: Path) -> None:
    run = ann.submit(steps=300, pace=0.001, wait=str(tmp_path / "go"))
    ann.wait_for(run, State.RUNNING)
    seen: list[dict[str, Any]] = []
    readers = [threading.Thread(target=lambda: seen.extend(listen(ann, run))) for _ in range(3)]
    for reader in readers:
        reader.start()
    (tmp_path / "go").touch()
    late = list(listen(ann, run))
    for reader in readers:
        reader.join(PATIENCE)
    truth = ann.events(run, limit=1000)
    assert [event["seq"] for event in late] == list(range(1, len(truth) + 1))
    assert sorted(event["seq"] for event in seen) == sorted([*range(1, len(truth) + 1)] * 3)
    assert late[-1]["state"] == "succeeded"
    assert all((str(event["seq"]), event["type"]) == (event["id"], event["event"]) for event in late)
    assert [{**event, "id": 0, "event": 0} for event in late] == [{**event, "id": 0, "event": 0} for event in truth]


def test_events_come_while_the_run_lives(ann: User, tmp_path: Path) -> None:
    run = ann.submit(steps=1, wait=str(tmp_path / "go"))
    stream = listen(ann, run)
    assert next(event for event in stream if event.get("state") == "running")
    assert next(stream)["type"] == "started"
    (tmp_path / "go").touch()
    sent_at = time.time()
    progress = next(stream)
    assert progress["type"] == "progress"
    assert time.time() - sent_at < 2.0
    assert [event["type"] for event in stream] == ["finished", "status"]


def test_resume_after_an_event(ann: User) -> None:
    run = ann.submit()
    ann.wait_for(run)
    last = int(ann.events(run)[-1]["seq"])
    assert [event["seq"] for event in listen(ann, run, {"Last-Event-ID": "4"})] == list(range(5, last + 1))
    assert [event["seq"] for event in listen(ann, run, after=6)] == list(range(7, last + 1))
    assert [event["seq"] for event in listen(ann, run, {"Last-Event-ID": str(last - 1)}, after=1)] == [last]
    done = ann.http.get(f"/v1/runs/{run}/stream", headers={"Last-Event-ID": str(last)})
    assert (done.status_code, done.content) == (204, b"")
    bad = ann.http.get(f"/v1/runs/{run}/stream", headers={"Last-Event-ID": "yesterday"})
    assert (bad.status_code, bad.json()["pointer"]) == (400, "Last-Event-ID")


def test_replay_in_pages(ann: User) -> None:
    run = ann.submit(steps=20)
    ann.wait_for(run)
    seen, after, more = [], 0, True
    while more:
        page = ann.http.get(f"/v1/runs/{run}/events", params={"after": after, "limit": 7}).json()
        assert len(page["events"]) <= 7
        seen += [event["seq"] for event in page["events"]]
        after, more = page["last"], page["more"]
    assert seen == list(range(1, 28))
    assert ann.http.get(f"/v1/runs/{run}/events", params={"after": 999}).json() == {
        "events": [],
        "last": 999,
        "more": False,
    }


def test_a_log_is_followed_to_the_end_of_the_run(ann: User, tmp_path: Path) -> None:
    run = ann.submit(wait=str(tmp_path / "go"))
    ann.wait_for(run, State.RUNNING)
    with ann.http.stream("GET", f"/v1/runs/{run}/logs/0", params={"follow": True}) as answer:
        chunks = answer.iter_text()
        assert next(chunks) == "rank 0 greets\n"
        with (ann.runs / run / "log" / "rank-0.log").open("a") as log:
            log.write("and goodbye\n")
        assert next(chunks) == "and goodbye\n"
        (tmp_path / "go").touch()
        assert "".join(chunks) == ""


def test_small_answers_are_not_held_back(ann: User) -> None:
    times = []
    for _ in range(20):
        began = time.perf_counter()
        ann.http.get("/healthz")
        times.append(time.perf_counter() - began)
    assert min(times) < 0.035, "Nagle's algorithm and a delayed acknowledgement cost 0.04 s each time"


def test_a_stopping_server_ends_its_streams(process: MakeProcess, tmp_path: Path) -> None:
    server = process("--no-zenoh")
    ann = server.user(server.start()["url"])
    run = ann.submit(wait=str(tmp_path / "go"))
    stream = listen(ann, run)
    next(event for event in stream if event["type"] == "started")
    began = time.monotonic()
    assert server.end(signal.SIGTERM) == 0
    assert list(stream) == []
    assert time.monotonic() - began < 2.5
    assert not (server.runs / "server.json").exists()
