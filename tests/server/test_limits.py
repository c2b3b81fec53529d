"""Limits of one user's share of the server: bytes and processor time of answers, request bodies, connections."""

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from conoid.cases.messages import Log, to_json
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.answers import digests, series, view
from conoid.server.answers.filters import Chosen
from conoid.server.app import opened
from conoid.server.database.store import Store
from conoid.server.queue.usage import Took
from conoid.server.routes import events
from conoid.server.routes.cases import _gallery
from conoid.server.runs import folder
from conoid.server.runs.events import Run

from .running import TOML, Running, case_text


@pytest.fixture
def run(server: Running) -> str:
    made = server.ann.submit()
    server.ann.wait_for(made)
    return made


def labelled(server: Running, *labels: str) -> str:
    """Adds a run of the user ann with labels."""
    answer = server.ann.http.post("/v1/runs", params={"label": labels}, content=case_text(), headers=TOML)
    return str(answer.json()["id"])


def listed(server: Running, *labels: str, limit: int = 50) -> list[str]:
    runs = server.ann.http.get("/v1/runs", params={"label": labels, "limit": limit}).json()["runs"]
    return [one["id"] for one in runs]


# Answers --------------------------------------------------------------------------------------------------------------


def test_events_are_paged_by_their_bytes(server: Running, run: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "_PAGE", 3000)
    before = server.ann.http.get(f"/v1/runs/{run}/events").json()["last"]
    with (server.ann.runs / run / layout.JOURNAL).open("ab") as file:
        for n in range(20):
            size = 10_000 if n == 7 else 500
            file.write(to_json(Log(run=run, seq=before + 1 + n, level="info", text="x" * size)) + b"\n")
    found: list[dict[str, Any]] = []
    last, more, pages = before, True, 0
    while more:
        page = server.ann.http.get(f"/v1/runs/{run}/events", params={"after": last}).json()
        found, last, more, pages = found + page["events"], page["last"], page["more"], pages + 1
        assert len(page["events"]) == 1 or len(json.dumps(page["events"])) < 4000
    assert [event["seq"] for event in found] == list(range(before + 1, before + 21))
    assert pages >= 5


def test_the_history_of_a_run_that_has_ended_is_made_once(
    server: Running, run: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = server.ann.http.get(f"/v1/runs/{run}/history")
    monkeypatch.setattr(series, "_body", lambda *_: 1 // 0)
    again = server.ann.http.get(f"/v1/runs/{run}/history")
    assert again.content == first.content
    known = server.ann.http.get(f"/v1/runs/{run}/history", headers={"If-None-Match": first.headers["etag"]})
    assert known.status_code == 304


def test_the_gallery_is_made_once(server: Running) -> None:
    _gallery.cache_clear()
    answers = {server.ann.http.get("/v1/cases").content for _ in range(5)}
    assert len(answers) == 1
    assert _gallery.cache_info().misses == 1


def test_a_file_that_grows_is_not_hashed_again_and_again(
    server: Running, run: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashed: list[int] = []
    real = digests._add

    def add(*words: Any) -> int:
        hashed.append(words[-1])
        return real(*words)

    monkeypatch.setattr(digests, "_add", add)
    going = server.ann.submit(wait=str(tmp_path / "go"))
    for owner in (going, run):
        (server.ann.runs / owner / "large.csv").write_bytes(b"x" * (3 << 20))
    tags = set()
    for _ in range(5):
        with (server.ann.runs / going / "large.csv").open("ab") as file:
            file.write(b"x")
        answer = server.ann.http.head(f"/v1/runs/{going}/files/large.csv")
        assert "repr-digest" not in answer.headers
        tags.add(answer.headers["etag"])
    assert len(tags) == 5
    assert not hashed
    ended = {server.ann.http.head(f"/v1/runs/{run}/files/large.csv").headers["repr-digest"] for _ in range(5)}
    assert len(ended) == 1
    assert sum(hashed) == 3 << 20, "once, and in slices"
    (tmp_path / "go").touch()


# Labels ---------------------------------------------------------------------------------------------------------------


def test_a_label_is_searched_in_the_database(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    red, both = labelled(server, "colour=red"), labelled(server, "colour=red", "size=2")
    blue = labelled(server, "colour=blue")
    for one in (red, both, blue):
        server.ann.wait_for(one)
    monkeypatch.setattr(folder, "submission", lambda *_: 1 // 0)
    assert listed(server, "colour=red") == [both, red]
    assert listed(server, "colour=red", "size=2") == [both]
    assert listed(server, "colour=red", limit=1) == [both]
    assert listed(server, "colour=green") == []
    assert server.bob.http.get("/v1/runs?label=colour%3Dred").json()["runs"] == []
    assert server.ann.http.get("/v1/runs").json()["runs"][0]["labels"] == {"colour": "blue"}


def test_a_run_that_is_kept_is_found_by_that(server: Running, run: str) -> None:
    assert server.ann.http.post(f"/v1/runs/{run}:keep").status_code == 200
    assert listed(server, "keep=yes") == [run]
    assert server.ann.http.post(f"/v1/runs/{run}:release").status_code == 200
    assert listed(server, "keep=yes") == []
    assert listed(server, "keep=no") == [run]


def test_a_database_without_labels_gets_them_from_the_folders(server: Running) -> None:
    """The database is that of an earlier version of the server, which stored no labels."""
    red = labelled(server, "colour=red")
    server.ann.wait_for(red)
    settings = server.service.settings
    with sa.create_engine(settings.database_url).begin() as connection:
        connection.execute(sa.text("drop table labels"))
    store = Store(settings.database_url)
    assert store.unlabelled
    store.close()
    with sa.create_engine(settings.database_url).begin() as connection:
        connection.execute(sa.text("drop table labels"))
    server.service.supervisor.close()
    with opened(settings) as service:
        assert [one.id for one in service.store.page("ann", Chosen(labels={"colour": "red"}), None, 10)] == [red]
        assert not Store(settings.database_url).unlabelled


def test_a_database_without_threads_has_runs_of_one_thread(tmp_path: Path) -> None:
    """The database is that of an earlier version of the server, which stored no numbers of threads."""
    url = f"sqlite:///{tmp_path / 'old.sqlite'}"
    run = Run("r1", "ann", "bar", 3, 0.0, State.SUCCEEDED, started=10.0, finished=20.0, threads=4)
    store = Store(url)
    store.add(run, None)
    assert store.taken() == [Took("ann", 12, 10.0, 20.0)]
    store.close()
    with sa.create_engine(url).begin() as connection:
        connection.execute(sa.text("alter table runs drop column threads"))
    store = Store(url)
    assert store.get("r1") == replace(run, threads=1)
    assert store.taken() == [Took("ann", 3, 10.0, 20.0)]
    store.close()


def test_three_thousand_runs_are_searched_in_a_moment(tmp_path: Path) -> None:
    """The runs are searched by their labels; the test limits the CPU time of the search."""
    store = Store(f"sqlite:///{tmp_path / 'many.sqlite'}")
    runs = [folder.first(_made(n)) for n in range(3000)]
    with store._engine.begin() as connection:
        for n, one in enumerate(runs):
            store._put(connection, one)
            store._label(connection, one, {"point": str(n), "sweep": "s"})
    began = time.process_time()
    for n in range(40):
        chosen = Chosen(labels={"sweep": "s", "point": str(n)})
        assert [one.id for one in store.page("ann", chosen, None, 51)] == [runs[n].id]
    assert time.process_time() - began < 1.0
    assert set(store.labels([one.id for one in runs[:700]])) == {one.id for one in runs[:700]}
    assert len(store.some([one.id for one in runs])) == 3000
    store.close()


def _made(n: int) -> folder.Submission:
    return folder.Submission(
        id=f"{n:022d}", owner="ann", name="bar", title="", ranks=1, submitted=float(n), case_file="case.toml",
        body_sha256="", idempotency_key=None, wall_time=None, estimate={},
    )  # fmt: skip


def test_sweeps_are_paged(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    from .sweep_bodies import handed_in, wish

    sweeps = [handed_in(server.ann, wish()) for _ in range(3)]
    made = [sweep["id"] for sweep in sweeps]
    for point in (point for sweep in sweeps for point in sweep["points"]):
        server.ann.wait_for(point["run"]["id"])
    monkeypatch.setattr(view, "brief", lambda *_: 1 // 0)
    first = server.ann.http.get("/v1/sweeps?limit=2").json()
    assert [one["id"] for one in first["sweeps"]] == made[:0:-1]
    rest = server.ann.http.get("/v1/sweeps", params={"limit": 2, "before": first["next"]}).json()
    assert [one["id"] for one in rest["sweeps"]] == made[:1]
    assert rest["next"] is None
