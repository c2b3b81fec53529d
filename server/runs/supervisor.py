"""Supervisor: passes events to ``lifecycle`` and performs the returned actions, for all open runs in one thread."""

import logging
import queue
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass

from sqlalchemy.exc import SQLAlchemyError

from conoid.cases.messages import Progress
from conoid.cases.run import State

from ..database.store import Store
from ..launch import Launcher, LaunchError
from ..queue import scheduling
from ..queue.scheduling import Need
from ..queue.waitlist import Held, Waitlist
from ..settings import Settings
from ..telemetry import Telemetry, TelemetryError
from .earlier_runs import EarlierRuns
from .events import ONCE, Admitted, Broken, CancelAsked, Event, Granted, LaunchPutOff, Run
from .index import Index
from .lifecycle import advance
from .perform import Performer, of_launch
from .recovery import Left
from .retries import Retries, words

_log = logging.getLogger("conoid.server")
_LOOK = 0.02
"""Time in s between two checks of the running workers, the longest delay of a message to clients."""
_TIDY = 5.0
"""Time in s between two checks whether tokens have changed."""
_AGAIN = 1.0
"""Time in s between two checks while a failed change waits for its next attempt."""
_GONE, _DAMAGED = "the folder of the run has been removed", "the folder of the run cannot be used"
_ANSWER = 10.0
"""Time in s within which the supervisor's thread must answer a request (chosen value)."""


@dataclass(frozen=True)
class _Cancel:
    run: str
    done: Future[None]


class Supervisor:
    """The supervisor of all open runs. The public methods of the supervisor may be called from any thread."""

    def __init__(
        self,
        settings: Settings,
        store: Store,
        launcher: Launcher,
        telemetry: Telemetry | None,
        ring: Callable[[str], None],
    ) -> None:
        """Creates the supervisor without its thread. ``ring`` gets the id of each run that changes."""
        self._settings, self._store, self._launcher = settings, store, launcher
        self._telemetry, self._ring = telemetry, ring
        self._inbox: queue.SimpleQueue[_Cancel | None] = queue.SimpleQueue()
        self._open: dict[str, Run] = {}
        self._hands = Performer(settings, launcher, telemetry)
        self._watches = self._hands.watches
        self._batch = launcher.queues
        self._retries = Retries()
        self._index = Index(store)
        self._earlier_runs = EarlierRuns(settings.runs, store, self._index, launcher, self._found)
        self._waitlist = Waitlist(settings, launcher.queues)
        self.held_back: Callable[[Need, Iterable[Need]], str] = lambda need, active: ""
        self._thread = threading.Thread(target=self._work, name="supervisor", daemon=True)
        self._leaving = False
        self._tidied = time.monotonic()

    # From any thread --------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Reads the runs of an earlier server, then starts the thread. Raises OSError, SQLAlchemyError."""
        self._launcher.tidy()
        self._take_up()
        self._waitlist.usage.begin(self._store.taken())
        self._thread.start()

    def close(self) -> None:
        """Ends the supervision of runs. The workers continue, and the next server supervises them."""
        self._leaving = True
        self._inbox.put(None)
        self._thread.join(_ANSWER)

    def end_all(self) -> None:
        """Cancels every open run. Returns when all have ended, or after twice the grace period."""
        deadline = time.monotonic() + 2 * self._settings.grace
        for run_id in tuple(self._open):
            self._inbox.put(_Cancel(run_id, Future()))
        while self._open and self.alive and time.monotonic() < deadline:
            time.sleep(_LOOK)

    @property
    def alive(self) -> bool:
        """Whether the thread runs; otherwise no run is supervised."""
        return self._thread.is_alive()

    def admit(self, run: Run) -> None:
        """Adds a new run, which must already be on disk and in the database."""
        self._open[run.id] = run
        self._waitlist.changed()
        self._inbox.put(None)

    def cancel(self, run_id: str) -> None:
        """Requests a cancel; returns when the request is recorded. Raises TimeoutError or an error of the record."""
        asked = _Cancel(run_id, Future())
        self._inbox.put(asked)
        asked.done.result(_ANSWER)

    def current(self, run_id: str) -> Run | None:
        """Returns the present state of an open run; None for a run that has ended or is unknown."""
        return self._open.get(run_id)

    def is_open(self, run_id: str) -> bool:
        """Whether the run has not ended, or its last line is not in the journal yet."""
        run = self._open.get(run_id)
        return run is not None and not run.state.final

    def progress(self, run_id: str) -> Progress | None:
        """Returns the newest progress of a running worker."""
        watch = self._watches.get(run_id)
        return None if watch is None else watch.progress

    def slots_used(self) -> int:
        """Returns the number of cores in use by runs."""
        return sum(run.cores for run_id in tuple(self._watches) if (run := self._open.get(run_id)))

    def reason(self, run_id: str) -> str:
        """Returns why a waiting run waits, or the remark of a batch system; empty for other runs."""
        if why := self._retries.why(run_id):
            return f"tried again soon: {why}"
        watch = self._watches.get(run_id)
        if watch is not None and (note := watch.worker.note()):
            return note
        return self._waitlist.why(run_id)

    def taken(self, owner: str) -> tuple[int, float]:
        """Returns an owner's number of runs with cores or in a batch system, and used core-seconds, reduced by age."""
        own = [run for run in tuple(self._open.values()) if run.owner == owner]
        return sum(run.id in self._watches for run in own), self._waitlist.used(owner, own)

    def stranded(self) -> list[str]:
        """Returns the open runs without supervision, place in the queue or planned attempt; each one is an error."""
        looked_after = {*self._watches, *self._index.unsaved, *self._retries.timed()}
        return scheduling.stranded(tuple(self._open.values()), looked_after)

    # The supervisor's own thread --------------------------------------------------------------------------------------

    def _work(self) -> None:
        while not self._leaving:
            try:
                self._turn()
            except Exception:
                _log.exception("the supervisor continues in %g s", _AGAIN)
                time.sleep(_AGAIN)

    def _turn(self) -> None:
        self._answer()
        for run_id in tuple(self._watches):
            self._attend(run_id)
        for run_id, event in self._retries.due():
            self._apply(run_id, event)
        for run in scheduling.in_state(tuple(self._open.values()), State.ACCEPTED):
            if not self._retries.held(run.id):
                self._apply(run.id, Admitted())
        self._grant()
        if time.monotonic() - self._tidied > _TIDY:
            self._tidy()

    def _answer(self) -> None:
        """Handles the requests of other threads until the time of the next check."""
        try:
            asked = self._inbox.get(timeout=_LOOK if self._watches else _AGAIN if self._retries else _TIDY)
        except queue.Empty:
            return
        if asked is not None:
            failed = self._apply(asked.run, CancelAsked(handed=asked.run in self._watches))
            asked.done.set_exception(failed) if failed else asked.done.set_result(None)

    def _attend(self, run_id: str) -> None:
        watch = self._watches[run_id]
        if self._retries.held(run_id):
            return
        try:
            for event in watch.look():
                self._apply(run_id, event)
        except OSError as error:
            self._fail(self._open[run_id], None, error)
        if watch.news:
            self._ring(run_id)

    def _grant(self) -> None:
        """Starts the runs that the queue selects; a failed start delays no other run."""
        held = Held(self._retries.held, self.held_back)
        for run_id in self._waitlist.turn(tuple(self._open.values()), tuple(self._watches), held):
            try:
                self._hands.probe(run_id)
            except OSError as error:
                self._fail(self._open[run_id], Granted(self._batch), error)
            else:
                self._apply(run_id, Granted(self._batch))

    def _apply(self, run_id: str, event: Event) -> Exception | None:
        """Changes a run by an event; returns the error if this fails, otherwise None.

        If it fails, for example because of a full disk, the run stays as it was and the change is tried again: a
        waiting run is selected again, the end of a worker is detected again, and an event that occurs only once waits
        in ``retries``. The next attempt uses what the first attempt has written, so that nothing is done twice.
        """
        before = self._open.get(run_id)
        if before is None:
            return None
        now = time.time()
        after, actions = advance(before, event, now)
        try:
            for action in actions:
                self._hands.perform(after, action, now)
        except LaunchError as error:
            self._settle(after)
            return self._apply(run_id, of_launch(error))
        except Exception as error:
            return self._fail(before, event, error)
        if isinstance(event, LaunchPutOff):
            self._retries.rest(run_id, event.message)
        else:
            self._retries.done(run_id, event)
        if after != before:
            self._settle(after)
        return None

    def _fail(self, run: Run, event: Event | None, error: Exception) -> Exception | None:
        """Handles a failed change. If the folder of the run cannot be used, the run ends; otherwise the change is tried
        again later.
        """
        if not isinstance(event, Broken):
            if (hands := self._hands).gone(run.id):
                return self._apply(run.id, Broken(_GONE))
            if self._retries.damaged(run.id, error) and not hands.lives(run.id) and hands.beyond_use(run.id):
                return self._apply(run.id, Broken(f"{_DAMAGED}: {words(error)}"))
        self._waitlist.changed()
        return self._retries.put_off(run.id, error, event if isinstance(event, ONCE) else None)

    def _settle(self, run: Run) -> None:
        """Completes a change: stores the run in memory, then in the database, then wakes the listeners of the run."""
        self._waitlist.settled(self._open.get(run.id), run)
        self._open[run.id] = run
        if run.state.final:
            self._watches.pop(run.id, None)
            self._retries.forget(run.id)
        self._save(run)
        self._ring(run.id)

    def _save(self, run: Run) -> None:
        if self._index.save(run) and run.state.final:
            del self._open[run.id]

    # Housekeeping -----------------------------------------------------------------------------------------------------

    def _tidy(self) -> None:
        """Repeats failed changes, and gives new tokens to the Zenoh router."""
        self._tidied = time.monotonic()
        self._earlier_runs.again()
        for run_id in tuple(self._index.unsaved):
            self._save(self._open[run_id])
        for run_id, run in tuple(self._open.items()):
            if not run.state.final and self._hands.gone(run_id):
                self._apply(run_id, Broken(_GONE))
        for run_id in self.stranded():
            _log.error("run %s was not supervised; it is read again", run_id)
            self._earlier_runs.take_up(self._settings.runs / run_id)
        if self._telemetry is not None:
            try:
                self._telemetry.follow(self._store.tokens())
            except (SQLAlchemyError, TelemetryError) as error:
                _log.error("the router does not have the newest tokens: %s", error)

    def _take_up(self) -> None:
        """Reads the folders of all runs into memory and database, and continues the runs of an earlier server."""
        self._earlier_runs.all()
        for run_id, run in self._store.open().items():
            if run_id not in self._open and self._hands.gone(run_id):
                self._open[run_id] = run
                self._apply(run_id, Broken(_GONE))

    def _found(self, left: Left) -> None:
        """Adds a run of an earlier server. A run that has ended stays in memory until the database has its end."""
        if left.worker is not None:
            self._hands.found[left.run.id] = left.worker
        if not left.run.state.final or left.run.id in self._index.unsaved:
            self._open[left.run.id] = left.run
            self._apply(left.run.id, left.found)
