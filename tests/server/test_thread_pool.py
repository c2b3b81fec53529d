"""Threads for calls that may block: each user has few threads, users do not share threads, and the server never waits
for a thread.
"""

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from conoid.cases.site.batch import Site
from conoid.cases.site.policy import Http
from conoid.server import durable, readiness
from conoid.server.answers import view
from conoid.server.app import build_app, opened
from conoid.server.errors import ServiceError
from conoid.server.requests.thread_pool import ThreadPool, asking
from conoid.server.requests.tokens import create_token
from conoid.server.requests.user_limits import UserLimits
from conoid.server.settings import Caps, Settings

from .running import FAKE, PATIENCE, User

HANG = Http(patience="0.4 s")


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    """Event for which blocked calls wait."""
    made = threading.Event()
    yield made
    made.set()


@pytest.fixture
def users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[User, User]]:
    """Users of a server that waits 0.4 s for its disk."""
    monkeypatch.setattr(readiness, "_LIMIT", 0.3)
    settings = Settings(
        runs=tmp_path / "runs", port=0, zenoh_port=None, worker=FAKE, caps=Caps(free_disk=0), site=Site(http=HANG)
    )
    with opened(settings) as service, TestClient(build_app(service), base_url="http://127.0.0.1") as client:
        made = []
        for name in ("ann", "bob"):
            token = create_token(service.store, name, frozenset({"read", "submit"}))
            other = TestClient(client.app, base_url="http://127.0.0.1", headers={"Authorization": f"Bearer {token}"})
            other.portal = client.portal
            made.append(User(other, name, settings.runs))
        yield made[0], made[1]
        service.supervisor.end_all()


def together(works: Sequence[Callable[[], Awaitable[Any]]]) -> list[Any]:
    """Runs all calls at the same time and returns the results and errors of the calls."""

    async def all_() -> list[Any]:
        return await asyncio.gather(*(work() for work in works), return_exceptions=True)

    return asyncio.run(all_())


def as_(who: str, pool: ThreadPool, work: Callable[[], Any]) -> Callable[[], Awaitable[Any]]:
    async def run() -> Any:
        asking.set(who)
        return await pool.run(work)

    return run


def test_a_user_whose_work_hangs_does_not_delay_others(gate: threading.Event) -> None:
    pool = ThreadPool(each=2, waiting=100, patience=0.3, most=8)
    before = threading.active_count()
    results = together([as_("ann", pool, gate.wait) for _ in range(50)] + [as_("bob", pool, lambda: 7)] * 50)
    assert results[50:] == [7] * 50
    assert {error.status for error in results[:50]} == {503}
    assert threading.active_count() <= before + 8


def test_a_thread_that_hangs_stays_taken_and_is_free_when_its_work_ends(gate: threading.Event) -> None:
    pool = ThreadPool(each=1, waiting=10, patience=0.2)

    async def all_() -> int:
        for _ in range(3):
            with pytest.raises(ServiceError, match="did not answer"):
                await pool.run(gate.wait)
        gate.set()
        return await pool.run(lambda: 7)

    assert asyncio.run(all_()) == 7


def test_users_take_turns(gate: threading.Event) -> None:
    """With one thread, a user with ten calls gets one turn before the next user, not ten turns."""
    pool, order = ThreadPool(each=1, waiting=100, patience=PATIENCE, most=1), list[str]()
    together([as_("ann", pool, lambda: order.append("ann"))] * 10 + [as_("bob", pool, lambda: order.append("bob"))])
    assert order.index("bob") <= 2


def test_too_many_jobs_are_refused_at_once(gate: threading.Event) -> None:
    pool = ThreadPool(each=1, waiting=3, patience=0.2)
    results = together([as_("ann", pool, gate.wait) for _ in range(10)])
    assert sorted(error.status for error in results) == [429] * 6 + [503] * 4


def test_errors_of_the_work_are_those_of_the_caller() -> None:
    pool = ThreadPool(each=1, waiting=3, patience=PATIENCE)
    assert isinstance(together([as_("ann", pool, lambda: 1 // 0)])[0], ZeroDivisionError)


def test_requests_and_long_answers_of_a_user_are_counted() -> None:
    user_limits = UserLimits(Http(requests=2, waiting=3, streams=2), connections=1000)

    async def ask(long: bool, seconds: float) -> int:
        async with user_limits.place("ann") as place:
            if long:
                place.lengthen()
            await asyncio.sleep(seconds)
        return 200

    results = together([lambda: ask(False, 0.1) for _ in range(10)])
    assert [getattr(one, "status", one) for one in results] == [200] * 5 + [429] * 5
    results = together([lambda: ask(True, 0.2) for _ in range(4)] + [lambda: ask(False, 0.0)])
    assert [getattr(one, "status", one) for one in results] == [200, 200, 429, 429, 200]
    assert not user_limits._asked
    assert not user_limits._long


def test_a_disk_that_hangs_is_reported_in_time_and_health_never_waits(
    users: tuple[User, User], gate: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    ann, bob = users
    before = set(threading.enumerate())
    run = ann.submit()
    ann.wait_for(run)
    monkeypatch.setattr(durable, "probe", lambda _: gate.wait())
    monkeypatch.setattr(view, "snapshot", lambda *_: gate.wait())
    many = [threading.Thread(target=ann.http.get, args=(f"/v1/runs/{run}",)) for _ in range(20)]
    asked = [threading.Thread(target=bob.http.get, args=("/readyz",)) for _ in range(20)]
    for one in (*many, *asked):
        one.start()
    began = time.monotonic()
    for _ in range(10):
        assert bob.http.get("/healthz").status_code == 200
        assert bob.http.get("/v1/runs").status_code == 200
    assert time.monotonic() - began < 5.0
    for one in (*many, *asked):
        one.join(PATIENCE)
    assert time.monotonic() - began < 10.0
    refused = ann.http.get(f"/v1/runs/{run}")
    assert (refused.status_code, refused.json()["retryable"]) == (503, True)
    assert "did not answer" in refused.json()["detail"]
    ready = bob.http.get("/readyz")
    assert ready.status_code == 503
    assert ready.json()["checks"] == {"supervisor": True, "database": True, "runs": False, "disk": True}
    assert sum(thread.name == "pool" for thread in set(threading.enumerate()) - before) <= 20
    gate.set()
    deadline = time.monotonic() + PATIENCE
    while bob.http.get("/readyz").json()["checks"]["runs"] is False:
        assert time.monotonic() < deadline
