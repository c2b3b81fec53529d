"""Checks whether the database and the folder of the runs can be written."""

import asyncio
import shutil
import time
from collections.abc import Callable

from sqlalchemy.exc import SQLAlchemyError

from . import durable
from .database.store import Store
from .errors import ServiceError
from .requests.thread_pool import ThreadPool
from .settings import Settings

_FRESH = 1.0
"""Time in s for which the result of a check is used again: /readyz needs no token, and each check writes to the disk
(chosen value)."""
_LIMIT = 2.0
"""Time in s after which a check has failed; a disk that works answers within 0.1 s (reason of the chosen value)."""


class Readiness:
    """Checks of the disk and the database. The class is used only in the thread of the event loop."""

    def __init__(self, settings: Settings, store: Store) -> None:
        """Creates the object without making a check."""
        self._settings, self._store = settings, store
        self._checks = {
            name: _Check(look)
            for name, look in (("database", self._database), ("runs", self._runs), ("disk", self._disk))
        }

    async def checks(self) -> dict[str, bool]:
        """Results of the checks by name. ``database``: the database can be written; ``runs``: the folder of the runs
        can be written; ``disk``: the disk has the free space that the site reserves.
        """
        passed = await asyncio.gather(*(check.passes() for check in self._checks.values()))
        return dict(zip(self._checks, passed, strict=True))

    def _database(self) -> bool:
        try:
            self._store.probe()
        except SQLAlchemyError:
            return False
        return True

    def _runs(self) -> bool:
        try:
            durable.probe(self._settings.runs)
        except OSError:
            return False
        return True

    def _disk(self) -> bool:
        try:
            return shutil.disk_usage(self._settings.runs).free >= self._settings.caps.free_disk
        except OSError:
            return False


class _Check:
    """One check in a thread of its own; requests at the same time share its result."""

    def __init__(self, look: Callable[[], bool]) -> None:
        self._look, self._thread = look, ThreadPool(each=1, waiting=1, patience=_LIMIT, most=1)
        self._until, self._passed = 0.0, False
        self._asked: asyncio.Task[None] | None = None

    async def passes(self) -> bool:
        """Returns the result of the check, at most ``_FRESH`` s old. A check that takes longer than ``_LIMIT`` s counts
        as failed.
        """
        if time.monotonic() >= self._until:
            if self._asked is None or self._asked.done():
                self._asked = asyncio.create_task(self._ask())
            await asyncio.shield(self._asked)
        return self._passed

    async def _ask(self) -> None:
        try:
            self._passed = await self._thread.run(self._look)
        except ServiceError:
            self._passed = False
        self._until = time.monotonic() + _FRESH
