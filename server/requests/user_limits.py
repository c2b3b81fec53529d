"""Limits for each user: number of requests in progress, and number of long answers (event streams, downloads).

A request is in progress until its answer is sent. The limit therefore also bounds the memory of request bodies and
answers.
"""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.requests import Request

from conoid.cases.site.policy import Http

from .thread_pool import busy

PATIENCE = 60.0
"""Largest time in s that a request waits before it begins (chosen value); most answers take less."""


class Place:
    """One request in the counts of its user."""

    def __init__(self, user_limits: "UserLimits", who: str) -> None:
        """Creates the entry of a request. ``who``: the user of the request."""
        self._user_limits, self._who = user_limits, who
        self.is_long = False

    def lengthen(self) -> None:
        """Counts the answer as a long answer from now on: it may last as long as a run or a download.

        Raises ServiceError with status 429 if the user has too many long answers.
        """
        if not self.is_long:
            self._user_limits.lengthen(self._who)
            self.is_long = True


class UserLimits:
    """Counts of the requests of each user. The class is used only in the thread of the event loop."""

    def __init__(self, limits: Http, connections: int) -> None:
        """Creates the counts. ``connections``: largest number of connections of all users. The waiting requests and
        long answers of one user may have at most half of these connections.
        """
        self._requests = limits.requests
        self._waiting, self._streams = min(limits.waiting, connections // 4), min(limits.streams, connections // 4)
        self._turns: dict[str, asyncio.Semaphore] = {}
        self._asked: Counter[str] = Counter()
        """Number of requests of each user that wait or are in progress."""
        self._long: Counter[str] = Counter()

    @asynccontextmanager
    async def place(self, who: str) -> AsyncIterator[Place]:
        """Waits until the request may begin. Raises ServiceError with status 429 if too many requests of the user wait,
        or if the request waits too long.
        """
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
                self._long += Counter()  # only counts above 0 stay
            else:
                turn.release()
                self._leave(who)

    def lengthen(self, who: str) -> None:
        """Counts a request as a long answer, no more as a request in progress. Raises ServiceError with status 429 if
        the user has too many long answers.
        """
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
    """Returns the entry of the request that is being answered."""
    place: Place = request.scope["state"]["place"]
    return place


async def _turn(turn: asyncio.Semaphore) -> None:
    try:
        async with asyncio.timeout(PATIENCE):
            await turn.acquire()
    except TimeoutError:
        raise busy(f"your other requests have been in progress for {PATIENCE:g} s") from None
