"""Waiting for the end of a run, and following a run, continue while a server is not reachable for a while."""

import time

import httpx2
import msgspec
import pytest

from conoid.cases.messages import AnyMessage, Status
from conoid.cases.run import State
from conoid.client.errors import ServiceError, UnreachableError
from conoid.client.remote.http import Http
from conoid.client.remote.run_info import RunInfo
from conoid.client.remote.session import Session
from conoid.client.remote.stream import follow
from conoid.client.run import Run
from conoid.client.sweeps.sweep import SweepInfo


class Away(httpx2.BaseTransport):
    """A fake server that does not answer a number of requests, or is too busy for them, and then reports that the run
    has ended.
    """

    def __init__(self, times: int, status: int | None) -> None:
        self.left, self.status = times, status

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        self.left -= 1
        if self.left < 0:
            ended = RunInfo(id="a", owner="ann", name="bar", state=State.SUCCEEDED, ranks=1, submitted=0.0)
            return httpx2.Response(200, content=msgspec.json.encode(ended))
        if self.status is None:
            raise httpx2.ConnectError("refused")
        return httpx2.Response(self.status, json={"detail": "not now", "retryable": self.status == 503})


class Silent:
    """A fake subscription without messages."""

    name, trouble = "none", ""

    def get(self, timeout: float) -> AnyMessage | None:
        time.sleep(timeout)
        return None

    def close(self) -> None:
        """Replaces a method and does nothing."""


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fake clock whose time passes only in ``sleep``."""
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))


@pytest.mark.parametrize("status", [None, 503])
def test_a_server_may_be_away_for_a_minute(status: int | None) -> None:
    away = Away(60, status)
    assert Run(Http("http://x", transport=away), "a").wait().state is State.SUCCEEDED


def test_a_server_that_stays_away_is_given_up() -> None:
    began = time.monotonic()
    with pytest.raises(UnreachableError):
        Run(Http("http://x", transport=Away(10**6, None)), "a").wait()
    assert 60.0 < time.monotonic() - began < 200.0


def test_the_timeout_holds_while_the_server_is_away() -> None:
    with pytest.raises(TimeoutError):
        Run(Http("http://x", transport=Away(10**6, None)), "a").wait(timeout=5.0)


def test_a_refusal_is_no_absence() -> None:
    with pytest.raises(ServiceError):
        Run(Http("http://x", transport=Away(1, 403)), "a").wait()


@pytest.mark.parametrize("status", [None, 502, 503])
def test_a_follower_continues_after_a_restart_behind_a_proxy(status: int | None) -> None:
    """The shipped nginx configuration answers with status 502 while the server behind it restarts."""
    left = [20]

    def refill(after: int) -> list[AnyMessage]:
        left[0] -= 1
        if left[0] >= 0:
            raise UnreachableError("none") if status is None else ServiceError(status, {})
        journal: list[AnyMessage] = [Status(run="a", seq=1, state="succeeded")]
        return journal[after:]

    assert [message.seq for message in follow(Silent(), refill, lambda: False)] == [1]


@pytest.mark.parametrize("status", [502, 503])
def test_an_end_that_cannot_be_asked_for_now_is_asked_for_again(status: int) -> None:
    left = [3]

    def ended() -> bool:
        left[0] -= 1
        if left[0] >= 0:
            raise ServiceError(status, {})
        return True

    assert list(follow(Silent(), lambda after: [], ended)) == []


def test_a_user_without_permission_gets_an_error() -> None:
    def refill(after: int) -> list[AnyMessage]:
        raise ServiceError(401, {})

    with pytest.raises(ServiceError):
        list(follow(Silent(), refill, lambda: False))


def test_a_large_sweep_may_take_its_time() -> None:
    """The server reads, checks and writes each point of a sweep before it answers."""
    seconds = []

    class Slow(httpx2.BaseTransport):
        def handle_request(self, request: httpx2.Request) -> httpx2.Response:
            seconds.append(request.extensions["timeout"]["read"])
            made = SweepInfo(id="s", name="bar", submitted=0.0, total=1000, states={})
            return httpx2.Response(202, content=msgspec.json.encode(made))

    with Session("http://x", transport=Slow()) as session:
        session.sweep({"name": "bar"}, [{"run.ranks": 1}] * 1000)
        session.sweep({"name": "bar"}, [{"run.ranks": 1}])
    assert seconds == [530.0, 30.5]
