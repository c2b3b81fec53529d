"""How much each user holds of the server at a time: requests in progress, and long answers.

A request is in progress until its answer is sent: so this bounds the bodies and the answers that are in memory too.
"""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.requests import Request

from conoid.cases.policy import Http

from .lanes import busy

PATIENCE = 60.0
"""s for which a request waits for its turn. Chosen: longer than most answers take."""


class Place:
    """Of one request."""

    def __init__(self, crowd: "Crowd", who: str) -> None:
        """A request in progress."""
        self._crowd, self._who = crowd, who
        self.is_long = False

    def lengthen(self) -> None:
        """The answer takes as long as a run, or a download: it counts among the long ones from now on.

        Raises ServiceError 429.
        """
        if not self.is_long:
            self._crowd.lengthen(self._who)
            self.is_long = True


class Crowd:
    """Belongs to the event loop."""

    def __init__(self, limits: Http, connections: int) -> None:
        """``connections``: of all users; one of them takes at most half for what waits and what is long."""
        self._requests = limits.requests
        self._waiting, self._streams = min(limits.waiting, connections // 4), min(limits.streams, connections // 4)
        self._turns: dict[str, asyncio.Semaphore] = {}
        self._asked: Counter[str] = Counter()
        """Requests that wait or are in progress."""
        self._long: Counter[str] = Counter()

    @asynccontextmanager
    async def place(self, who: str) -> AsyncIterator[Place]:
        """Waits for the turn of a request. Raises ServiceError 429 when too many of the user's wait, or too long."""
        if self._asked[who] >= self._requests + self._waiting:
            raise busy(f"{self._requests} of your requests are in progress and {self._waiting} wait")
        place, turn = Place(self, who), self._turns.setdefault(who, asyncio.Semaphore(self._requests))
        self._asked[who] += 1
        try:
            await _turn(turn)
        except BaseException:
            self._leave(who)
            raise
        try:
            yield place
        finally:
            if place.is_long:
                self._long[who] -= 1
                self._long += Counter()  # keeps what is above 0
            else:
                turn.release()
                self._leave(who)

    def lengthen(self, who: str) -> None:
        """A request in progress becomes a long answer. Raises ServiceError 429."""
        if self._long[who] >= self._streams:
            raise busy(
                f"you have {self._streams} event streams, followed logs, waits or downloads; no more are allowed"
            )
        self._long[who] += 1
        self._turns[who].release()
        self._leave(who)

    def _leave(self, who: str) -> None:
        self._asked[who] -= 1
        if not self._asked[who]:
            del self._asked[who], self._turns[who]


def place_of(request: Request) -> Place:
    """Of the request that is being answered."""
    place: Place = request.scope["state"]["place"]
    return place


async def _turn(turn: asyncio.Semaphore) -> None:
    try:
        async with asyncio.timeout(PATIENCE):
            await turn.acquire()
    except TimeoutError:
        raise busy(f"your other requests are in progress since {PATIENCE:g} s") from None
