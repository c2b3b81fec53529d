"""Order in which requests begin: one request in each turn of the event loop, with the users in rotation."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from conoid.server.app import opened
from conoid.server.requests.admission import ALIVE, Admission
from conoid.server.requests.request_order import RequestOrder
from conoid.server.requests.tokens import create_token
from conoid.server.service import Service
from conoid.server.settings import Settings

FLOOD = 30


@pytest.fixture
def service(settings: Settings) -> Iterator[Service]:
    with opened(settings) as made:
        yield made


def begun(*who: str, cancelled: int | None = None) -> list[tuple[str, int]]:
    """Returns the users of requests that waited at the same time, in the order in which the requests began, each with
    the turn of the loop.
    """
    order: list[tuple[str, int]] = []

    async def ask(turns: RequestOrder, clock: list[int], one: str) -> None:
        await turns.wait(one)
        order.append((one, clock[0]))

    async def all_() -> None:
        turns, clock = RequestOrder(), [0]
        tick(asyncio.get_running_loop(), clock)
        tasks = [asyncio.create_task(ask(turns, clock, one)) for one in who]
        await asyncio.sleep(0)
        if cancelled is not None:
            tasks[cancelled].cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(all_())
    return order


def tick(loop: asyncio.AbstractEventLoop, clock: list[int]) -> None:
    """Counts the turns of the loop."""
    clock[0] += 1
    loop.call_soon(tick, loop, clock)


def test_users_begin_in_rotation_and_each_in_the_order_of_its_requests() -> None:
    assert [who for who, _ in begun(*["ann"] * 4, "bob", "eve", "bob")] == [
        "ann",
        "bob",
        "eve",
        "ann",
        "bob",
        "ann",
        "ann",
    ]


def test_one_request_begins_in_a_turn_of_the_loop() -> None:
    turns = [turn for _, turn in begun(*["ann"] * 20, *["bob"] * 20)]
    assert turns == list(range(turns[0], turns[0] + 40))


def test_a_request_that_is_gone_takes_no_turn() -> None:
    order = begun("ann", "bob", "ann", cancelled=1)
    assert [who for who, _ in order] == ["ann", "ann"]
    assert order[1][1] == order[0][1] + 1


def entered(service: Service, flood: dict[str, str], late: dict[str, str]) -> int:
    """Returns the number of requests that began before the request ``late``, which came after ``FLOOD`` requests of
    another client.
    """
    order: list[str] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        order.append(scope["client"][0])

    async def receive() -> Message:
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        order.append("refused")

    def ask(door: Admission, one: dict[str, str]) -> Awaitable[Any]:
        headers = [(b"authorization", f"Bearer {one['token']}".encode())] if "token" in one else []
        path, client = one.get("path", "/v1/me"), (one["from"], 1)
        scope: Scope = {"type": "http", "path": path, "headers": headers, "client": client}
        return door(scope, receive, send)

    async def all_() -> None:
        door = Admission(app, service)
        for one in (flood, late):
            await ask(door, one)  # from now on the server has the token in its cache
        order.clear()
        await asyncio.gather(*(ask(door, one) for one in [*[flood] * FLOOD, late]))

    asyncio.run(all_())
    return order.index(late["from"])


@pytest.mark.parametrize(
    "flood",
    [
        lambda token: {"from": "192.0.2.1", "token": token},
        lambda token: {"from": "192.0.2.1"},
        lambda token: {"from": "192.0.2.1", "path": ALIVE},
        lambda token: {"from": "192.0.2.1", "token": "conoid_guessed"},
    ],
    ids=["a user", "an address without a token", "requests of health", "guessed tokens"],
)
def test_a_request_begins_after_one_of_a_flood_and_not_after_all(
    service: Service, flood: Callable[[str], dict[str, str]]
) -> None:
    mallory, bob = (create_token(service.store, name, frozenset({"read"})) for name in ("mallory", "bob"))
    assert entered(service, flood(mallory), {"from": "192.0.2.2", "token": bob}) <= 2
