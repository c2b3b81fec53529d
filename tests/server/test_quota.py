"""Shares, priorities and quotas of a site, with a running server."""

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from conoid.cases.run import State
from conoid.cases.site.batch import Site, SiteError, read_site
from conoid.cases.site.policy import Queue, Quota, RunCaps, Share
from conoid.server.app import build_app, opened
from conoid.server.queue.usage import Took
from conoid.server.requests.tokens import create_token
from conoid.server.settings import Caps, Settings, capped

from .running import FAKE, PATIENCE, TOML, Running, User, case_text

SITE = Site(
    queue=Queue(users={"eve": Share(priority=1)}),
    quota=Quota(running=1, queued=6),
    caps=RunCaps(output_bytes=200_000),
)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    caps = Caps(free_disk=0, **capped(SITE))  # type: ignore[arg-type]
    return Settings(
        runs=tmp_path / "runs", port=0, zenoh_port=None, slots=2, worker=FAKE, grace=0.5, caps=caps, site=SITE
    )


def test_one_waits_for_his_quota_while_another_runs(server: Running, tmp_path: Path) -> None:
    """Reasons, priorities and quotas are the same over HTTP; the order of the queue is the same after a restart."""
    ann, bob = server.ann, server.bob
    runs = [ann.submit(wait=str(tmp_path / "go")) for _ in range(3)]
    ann.wait_for(runs[0], State.RUNNING)
    urgent = ann.http.post("/v1/runs?priority=7", content=case_text(), headers=TOML).json()["id"]
    other = bob.submit()
    assert bob.wait_for(other)["state"] == "succeeded", "two of ann's wait, and one slot is free"
    assert ann.show(runs[1])["reason"] == "1 of your runs are running; this server allows 1 at a time"
    me = ann.http.get("/v1/me").json()
    assert (me["quota"]["running"], me["used"]["running"], me["used"]["queued"]) == (1, 1, 4)
    assert me["used"]["core_seconds"] > 0.0
    (tmp_path / "go").touch()
    ended = {run: ann.wait_for(run)["started"] for run in (*runs, urgent)}
    assert ended[runs[0]] < ended[urgent] < ended[runs[1]] < ended[runs[2]]
    assert ann.http.post("/v1/runs?priority=101", content=case_text(), headers=TOML).status_code == 400


def test_too_many_open_runs_are_refused(server: Running, tmp_path: Path) -> None:
    for _ in range(6):
        server.ann.submit(wait=str(tmp_path / "go"))
    answer = server.ann.http.post("/v1/runs", content=case_text(), headers=TOML)
    assert (answer.status_code, answer.json()["code"]) == (429, "queue_full")
    assert server.bob.http.post("/v1/runs", content=case_text(), headers=TOML).status_code == 202
    (tmp_path / "go").touch()


def test_a_run_that_writes_too_much_is_stopped(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("conoid.server.runs.watch._WEIGHED", 0.05)
    run = server.ann.submit(steps=100_000, pace=0.01)
    server.ann.wait_for(run, State.RUNNING)
    (server.ann.runs / run / "log" / "rank-0.log").write_bytes(b"x" * 300_000)
    ended = server.ann.wait_for(run)
    assert (ended["state"], ended["cause"]) == ("failed", "storage")
    allowed = r"the files of the run have 3\d\d kB; this server allows 200 kB for a run: reduce run.frames, "
    assert re.match(allowed, ended["message"])


def test_core_seconds_and_output_are_quotas_too(server: Running) -> None:
    """Runs of a user without quota wait, and this user cannot submit further runs."""
    quota = Quota(core_seconds=5.0, output_bytes=1000)
    waitlist, desk = server.service.supervisor._waitlist, server.service.desk
    waitlist._quota = quota
    waitlist.usage.add(Took("ann", 1, 0.0, time.time()))
    run = server.ann.submit()
    server.ann.http.get(f"/v1/runs/{run}", params={"wait": 0.3})
    assert "core-seconds lately; this server allows 5" in server.ann.show(run)["reason"]
    assert server.bob.wait_for(server.bob.submit())["state"] == "succeeded"
    desk._settings = replace(server.service.settings, site=Site(quota=quota))
    desk.kept = lambda owner: 2000
    answer = server.ann.http.post("/v1/runs", content=case_text(), headers=TOML)
    assert (answer.status_code, answer.json()["code"]) == (429, "output_quota")


def test_the_order_survives_a_restart_without_the_database(tmp_path: Path) -> None:
    """The data that decide the order of the queue are in the folders of the runs."""
    settings = Settings(
        runs=tmp_path / "runs", port=0, zenoh_port=None, slots=1, worker=FAKE, grace=0.5, caps=Caps(free_disk=0),
    )  # fmt: skip
    children: list[Any] = []
    with users_of(settings, children) as (ann, bob):
        assert ann.wait_for(ann.submit(steps=20, pace=0.01))["state"] == "succeeded"
        bob.wait_for(bob.submit(wait=str(tmp_path / "go")), State.RUNNING)
        urgent = ann.http.post("/v1/runs?priority=3", content=case_text(), headers=TOML)
        waiting = [(ann, ann.submit()), (bob, bob.submit()), (ann, ann.submit()), (ann, urgent.json()["id"])]
        before = reasons(waiting)
        assert before[3] == "waiting for 1 of 1 slots; 0 free"
        assert len(set(before)) == 4
    for left in settings.runs.glob("server.sqlite*"):
        left.unlink()
    with users_of(settings, []) as again:
        waiting = [(again[user.name == "bob"], run) for user, run in waiting]
        assert reasons(waiting) == before
        (tmp_path / "go").touch()
        for user, run in waiting:
            assert user.wait_for(run)["state"] == "succeeded"
    assert [child.wait(PATIENCE) for child in children] == [0]


def reasons(waiting: list[tuple[User, str]]) -> list[str]:
    """Returns the reason for which each run waits, after a turn of the queue."""
    deadline = time.monotonic() + PATIENCE
    while not all(found := [user.show(run)["reason"] for user, run in waiting]) or len(set(found)) < len(found):
        assert time.monotonic() < deadline, found
        time.sleep(0.05)
    return found


@contextmanager
def users_of(settings: Settings, children: list[Any]) -> Iterator[tuple[User, User]]:
    """Returns a server and two users; workers that still run at the end of the test are in ``children``."""
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        found = []
        for name in ("ann", "bob"):
            token = create_token(service.store, name, frozenset({"read", "submit"}))
            http = TestClient(client.app, base_url="http://127.0.0.1", headers={"Authorization": f"Bearer {token}"})
            http.portal = client.portal
            found.append(User(http, name, settings.runs))
        yield found[0], found[1]
        children += [watch.worker._child for watch in service.supervisor._watches.values()]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[queue]\nhalf_life = "3 kg"', "queue.half_life"),
        ("[queue.users.ann]\nshare = 0", "queue.users.ann.share = 0: above 0"),
        ("[queue.users.ann]\npriority = 200", "queue.users.ann.priority = 200: -100 to 100"),
        ("[quota]\nrunning = 0", "quota.running = 0: above 0"),
        ("[quota]\nruning = 3", "runing"),
        ("[caps]\noutput_bytes = -1", "caps.output_bytes = -1: above 0"),
        ('[retention]\nage = "soon"', "retention.age"),
        ("[retention]\nbytes = 0", "retention.bytes = 0: above 0"),
    ],
)
def test_a_wrong_setting_is_named(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "site.toml").write_text(text)
    with pytest.raises(SiteError, match=re.escape(words)):
        read_site(tmp_path / "site.toml")


def test_a_case_that_the_queue_could_never_hold_is_refused(settings: Settings) -> None:
    site = Site(queue=Queue(memory=1_000_000))
    with opened(replace(settings, site=site)) as service, TestClient(build_app(service)) as client:
        client.headers["Authorization"] = f"Bearer {create_token(service.store, 'ann', frozenset({'submit'}))}"
        answer = client.post("/v1/runs", content=case_text(), headers=TOML)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_case")
    assert "of memory; this server allows 1.00 MB" in answer.json()["detail"]
