"""Retries of the supervisor: changes of runs that have failed, with the time of the next attempt and the reason."""

import errno
import logging
import time
from dataclasses import dataclass

from .events import Event

_log = logging.getLogger("conoid.server")
_AGAIN, _LONGEST = 1.0, 8.0
"""Delay in s before the next attempt: the first and the largest delay (chosen values). The delay doubles after each
failure."""
_QUIET = 60.0
"""Time in s for which the same error of the same run is not logged again (chosen value)."""
_PASSING = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.ESTALE, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
     errno.EAGAIN}
)  # fmt: skip
_LASTING = 4.0
"""Delay in s from which on an error of the files of a run counts as permanent: the fourth failure, after 7 s (chosen
value)."""
DAMAGE = frozenset({errno.EISDIR, errno.ENOTDIR, errno.EACCES, errno.EPERM, errno.ELOOP, errno.EROFS})
"""Errors that are permanent if they occur in the folder of one run, while the folders of others can be written."""


def passing(error: BaseException) -> bool:
    """Whether the error, or a cause of it, is a temporary error of the machine, such as a full disk."""
    cause = error.__cause__ or error.__context__
    if isinstance(error, OSError) and error.errno in _PASSING:
        return True
    return cause is not None and passing(cause)


def words(error: BaseException) -> str:
    """Returns the text of the error as one line."""
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return (reason or type(error).__name__).splitlines()[0]


@dataclass(frozen=True)
class _Hold:
    until: float
    delay: float
    why: str
    event: Event | None
    logged: float


class Retries:
    """Failed changes of runs, and the times of the next attempts. The class is used in the supervisor's thread; ``why``
    may be called from any thread.
    """

    def __init__(self) -> None:
        """Creates the object without failed steps."""
        self._retries: dict[str, _Hold] = {}

    def __len__(self) -> int:
        """Number of runs that wait for another try."""
        return len(self._retries)

    def put_off(self, run_id: str, error: Exception, event: Event | None = None) -> Exception:
        """Plans another attempt at the change of a run, or at handling ``event`` if it occurs only once."""
        before = self._retries.get(run_id)
        self._hold(run_id, words(error), event or (before.event if before else None))
        return error

    def rest(self, run_id: str, why: str) -> None:
        """Plans the next attempt to start a run."""
        self._hold(run_id, why, None)

    def _hold(self, run_id: str, why: str, event: Event | None) -> None:
        before, now = self._retries.get(run_id), time.monotonic()
        delay = _AGAIN if before is None else min(_LONGEST, 2.0 * before.delay)
        known = before is not None and before.why == why and now < before.logged + _QUIET
        if not known:
            _log.error("run %s: tried again in %g s: %s", run_id, delay, why)
        self._retries[run_id] = _Hold(now + delay, delay, why, event, before.logged if before and known else now)

    def held(self, run_id: str) -> bool:
        """Whether the time of the next attempt has not come yet."""
        hold = self._retries.get(run_id)
        return hold is not None and hold.until > time.monotonic()

    def due(self) -> list[tuple[str, Event]]:
        """Returns the events whose time of the next attempt has come, with their runs."""
        now = time.monotonic()
        return [(run_id, hold.event) for run_id, hold in self._retries.items() if hold.event and hold.until <= now]

    def timed(self) -> set[str]:
        """Returns the runs with an event that waits for its next attempt."""
        return {run_id for run_id, hold in tuple(self._retries.items()) if hold.event is not None}

    def done(self, run_id: str, event: Event) -> None:
        """Forgets the failure of a run after a success. Another event of the run that waits is kept."""
        hold = self._retries.get(run_id)
        if hold is not None and hold.event in (None, event):
            del self._retries[run_id]

    def lasts(self, run_id: str) -> bool:
        """Whether the attempts have failed several times."""
        hold = self._retries.get(run_id)
        return hold is not None and hold.delay >= _LASTING

    def damaged(self, run_id: str, error: Exception) -> bool:
        """Whether the error concerns only the files of the run, and is permanent."""
        return isinstance(error, OSError) and error.errno in DAMAGE and self.lasts(run_id)

    def forget(self, run_id: str) -> None:
        """Forgets a run that has ended."""
        self._retries.pop(run_id, None)

    def why(self, run_id: str) -> str:
        """Returns the reason of the last failure; empty if the last attempt has succeeded."""
        hold = self._retries.get(run_id)
        return hold.why if hold is not None else ""
