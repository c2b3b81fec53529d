"""Hostile bodies: each gets its one line, costs little, and nobody else notices."""

import json
import math
import threading
import time
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from conoid.server.reading import CPU
from conoid.server.settings import Caps, Settings

from .hostile import Body, corpus, quadratic
from .running import Running, User, processes

ALLOWED = {202, 400, 413, 415, 422}
ALL = corpus()
STEP = len(ALL) // 20
"""Every how manieth body is in the sample."""


def finite(value: Any) -> bool:
    """Whether nothing in it is NaN or infinite."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def send(user: User, body: Body) -> httpx2.Response:
    """Submits it."""
    return user.http.post("/v1/runs", content=body[2], headers={"Content-Type": body[1]})


def hold_true(user: User, body: Body) -> None:
    """What must be so for any body."""
    answer = send(user, body)
    assert answer.status_code in ALLOWED, f"{body[0]}: {answer.status_code} {answer.text[:300]}"
    told = json.loads(answer.content)
    assert finite(told), body[0]
    if answer.status_code == 202:
        seen = user.http.get(told["url"])
        assert seen.status_code == 200, f"{body[0]}: {seen.text[:300]}"
        assert finite(json.loads(seen.content)), body[0]
        user.http.post(f"{told['url']}:cancel")


def test_there_are_hundreds_of_them() -> None:
    assert len(ALL) >= 300
    assert len({name for name, _, _ in ALL}) == len(ALL)


def test_a_sample_of_hostile_bodies_is_answered(server: Running) -> None:
    for body in ALL[::STEP]:
        hold_true(server.ann, body)


@pytest.mark.parametrize("size", ["1e160", "1e-160", "5e-324"])
def test_what_cannot_be_counted_is_not_accepted(tmp_path_factory: pytest.TempPathFactory, size: str) -> None:
    """Also where the site has set no caps at all."""
    from conoid.cases.load import CaseError
    from conoid.server import limits
    from conoid.server.reading import Question, read

    from .running import case_text

    none = Caps(elements=None, steps=None, memory=None)
    site = limits.of(Settings(runs=tmp_path_factory.getbasetemp(), caps=none, slots=2))
    answer = read(Question(body=case_text().replace('"0.5 mm"', size).encode(), json=False, limits=site))
    assert answer.reading is None or finite(answer.reading.estimate)
    assert answer.problems or answer.reading
    assert not answer.crash
    assert isinstance(CaseError(answer.problems), ValueError)


@pytest.mark.slow
def test_a_case_that_takes_too_long_is_given_up(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of bodies in one place, each compared with each."""
    from .hostile import good

    part = good()["parts"][0]
    many = {**good(), "parts": [{**part, "name": f"p{i}"} for i in range(3000)]}
    began = time.monotonic()
    answer = send(server.ann, ("", "application/json", json.dumps(many).encode()))
    assert answer.status_code == 422
    assert answer.json()["code"] in {"too_costly", "invalid_case"}
    assert time.monotonic() - began < 20.0 * CPU


# The drill ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def users(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[User, User]]:
    with processes(tmp_path_factory.mktemp("hostile")) as make:
        server = make("--no-zenoh")
        url = server.start()["url"]
        yield server.user(url, "ann"), server.user(url, "bob")


@pytest.mark.slow
def test_no_hostile_body_harms_the_server(users: tuple[User, User]) -> None:
    ann, _ = users
    ann.http.timeout = httpx2.Timeout(300.0)
    for body in ALL:
        hold_true(ann, body)
    assert ann.wait_for(ann.submit())["state"] == "succeeded"


@pytest.mark.slow
def test_fifty_at_once_keep_nobody_waiting(users: tuple[User, User]) -> None:
    ann, bob = users
    run = bob.submit()
    bob.wait_for(run)
    quiet, bodies = latencies(bob, run, 100)[98], quadratic()
    ann.http.timeout = httpx2.Timeout(300.0)
    senders = [threading.Thread(target=send, args=(ann, bodies[n % len(bodies)])) for n in range(50)]
    for sender in senders:
        sender.start()
    times: list[float] = []
    while any(sender.is_alive() for sender in senders):
        times += latencies(bob, run, 20)
    times.sort()
    p99 = times[int(0.99 * (len(times) - 1))]
    print(
        f"GET of another user: p99 {quiet * 1e3:.1f} ms alone; p99 {p99 * 1e3:.1f} ms, worst {times[-1] * 1e3:.1f} ms"
    )
    print(f"of {len(times)} while 50 hostile bodies were read")
    assert p99 <= 0.2
    assert times[-1] <= 5.0


def latencies(user: User, run: str, count: int) -> list[float]:
    """s of so many GETs, the shortest first."""
    found = []
    for _ in range(count):
        began = time.monotonic()
        assert user.http.get(f"/v1/runs/{run}").status_code == 200
        found.append(time.monotonic() - began)
    return sorted(found)
