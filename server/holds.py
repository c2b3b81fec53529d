"""What could not be done now and is tried again: which run, when, and why it waits. The supervisor's timers."""

import errno
import logging
import time
from dataclasses import dataclass

from .events import Event

_log = logging.getLogger("conoid.server")
_AGAIN, _LONGEST = 1.0, 8.0
"""s after which a step that failed is tried again: at first, and at most; the time doubles in between. Chosen."""
_QUIET = 60.0
"""s for which the same trouble of the same run is not logged again. Chosen."""
_PASSING = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.ESTALE, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
     errno.EAGAIN}
)  # fmt: skip
_LASTING = 4.0
"""s of delay from which trouble that is none of the machine lasts. Chosen: the fourth try, 7 s after the first."""
DAMAGE = frozenset({errno.EISDIR, errno.ENOTDIR, errno.EACCES, errno.EPERM, errno.ELOOP, errno.EROFS})
"""Trouble of one folder, which does not pass by itself where others can be written."""


def passing(error: BaseException) -> bool:
    """True for trouble of the machine that comes and goes, wherever in the chain of causes it stands."""
    cause = error.__cause__ or error.__context__
    if isinstance(error, OSError) and error.errno in _PASSING:
        return True
    return cause is not None and passing(cause)


def words(error: BaseException) -> str:
    """What is wrong, in one line."""
    said = error.strerror if isinstance(error, OSError) else str(error)
    return (said or type(error).__name__).splitlines()[0]


@dataclass(frozen=True)
class _Hold:
    until: float
    delay: float
    why: str
    event: Event | None
    logged: float


class Holds:
    """Belongs to the supervisor's thread; ``why`` may be asked from any."""

    def __init__(self) -> None:
        """Nothing waits."""
        self._holds: dict[str, _Hold] = {}

    def __len__(self) -> int:
        """How many runs wait to be tried again."""
        return len(self._holds)

    def put_off(self, run_id: str, error: Exception, event: Event | None = None) -> Exception:
        """Tries again later: what the run waits for anyway, or ``event``, which would not come by itself."""
        before = self._holds.get(run_id)
        self._hold(run_id, words(error), event or (before.event if before else None))
        return error

    def rest(self, run_id: str, why: str) -> None:
        """The run does not get its turn for a while."""
        self._hold(run_id, why, None)

    def _hold(self, run_id: str, why: str, event: Event | None) -> None:
        before, now = self._holds.get(run_id), time.monotonic()
        delay = _AGAIN if before is None else min(_LONGEST, 2.0 * before.delay)
        known = before is not None and before.why == why and now < before.logged + _QUIET
        if not known:
            _log.error("run %s: tried again in %g s: %s", run_id, delay, why)
        self._holds[run_id] = _Hold(now + delay, delay, why, event, before.logged if before and known else now)

    def held(self, run_id: str) -> bool:
        """True while it is too early to try again."""
        hold = self._holds.get(run_id)
        return hold is not None and hold.until > time.monotonic()

    def due(self) -> list[tuple[str, Event]]:
        """The events whose time has come."""
        now = time.monotonic()
        return [(run_id, hold.event) for run_id, hold in self._holds.items() if hold.event and hold.until <= now]

    def timed(self) -> set[str]:
        """The runs of which an event will come up again."""
        return {run_id for run_id, hold in tuple(self._holds.items()) if hold.event is not None}

    def done(self, run_id: str, event: Event) -> None:
        """The run has made a step; an event that is still due stays."""
        hold = self._holds.get(run_id)
        if hold is not None and hold.event in (None, event):
            del self._holds[run_id]

    def lasts(self, run_id: str) -> bool:
        """True when the run was tried again some times, in vain."""
        hold = self._holds.get(run_id)
        return hold is not None and hold.delay >= _LASTING

    def damaged(self, run_id: str, error: Exception) -> bool:
        """Whether the trouble is of the run's own files, and has lasted."""
        return isinstance(error, OSError) and error.errno in DAMAGE and self.lasts(run_id)

    def forget(self, run_id: str) -> None:
        """The run has ended."""
        self._holds.pop(run_id, None)

    def why(self, run_id: str) -> str:
        """What kept the run from its last step; empty when nothing did."""
        hold = self._holds.get(run_id)
        return hold.why if hold is not None else ""
