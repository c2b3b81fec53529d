"""Performs the actions of the module ``lifecycle``: writes the journal and the outcome; starts, supervises and stops
workers.
"""

import logging
import os
from contextlib import suppress
from pathlib import Path

import msgspec

from conoid.cases.messages import Status
from conoid.cases.output import layout
from conoid.cases.run import Cause, State

from .. import durable
from ..launch import DamagedError, Job, Launcher, LaunchError, Worker
from ..settings import Settings
from ..telemetry import Telemetry
from . import ends, folder, journal
from .events import Action, Adopt, Journal, Kill, Launch, LaunchFailed, LaunchPutOff, Run, Stop, WriteOutcome
from .retries import passing
from .watch import Watch

_log = logging.getLogger("conoid.server")


class Performer:
    """Performs actions. The performer is used in the supervisor's thread; ``watches`` may be read from any thread."""

    def __init__(self, settings: Settings, launcher: Launcher, telemetry: Telemetry | None) -> None:
        """Creates the object without workers."""
        self._settings, self._launcher, self._telemetry = settings, launcher, telemetry
        self._root = os.stat(settings.runs).st_ino
        self.watches: dict[str, Watch] = {}
        """The supervision of each running worker, by the id of the run."""
        self.found: dict[str, Worker] = {}
        """Workers that an earlier server has started and that are not supervised yet."""

    def perform(self, run: Run, action: Action, now: float) -> None:
        """Performs an action for ``run`` at the Unix time ``now``, s. Raises LaunchError, OSError and other errors."""
        path = self._settings.runs / run.id
        match action:
            case Journal(state, cause, message):
                wall = run.finished if state.final else now
                self._tell(run, Status(run=run.id, wall=wall, state=state, cause=cause, message=message))
            case WriteOutcome(outcome):
                ended = outcome if outcome.steps is not None else ends.so_far(outcome, run, path)
                folder.write_outcome(path, ended)
            case Launch():
                self.watches[run.id] = self._launch(run, path)
            case Adopt():
                self.watches[run.id] = self._watch(path, self.found[run.id], _allowed(path))
                del self.found[run.id]
                if run.state is State.STOPPING:
                    self.watches[run.id].stop(self._settings.grace)
            case Stop(why):
                self._stop(run.id, path, why)
            case Kill():
                self._kill(run.id, path)

    def probe(self, run_id: str) -> None:
        """Tests whether files of the run can be written. Raises OSError if they cannot be written."""
        durable.probe(self._settings.runs / run_id)

    def gone(self, run_id: str) -> bool:
        """Whether the folder of the run is missing. If the folder of all runs was replaced, for example because its
        disk is not mounted, the result is False.
        """
        try:
            same = os.stat(self._settings.runs).st_ino == self._root
            return same and not (self._settings.runs / run_id).is_dir()
        except OSError:
            return False

    def lives(self, run_id: str) -> bool:
        """Whether this server has a running worker of the run."""
        watch = self.watches.get(run_id)
        return watch is not None and watch.worker.exited() is None

    def beyond_use(self, run_id: str) -> bool:
        """Whether the folder of the run cannot be used: it is missing, or files cannot be written in it although they
        can be written in the folder of all runs.
        """
        if self.gone(run_id):
            return True
        try:
            durable.probe(self._settings.runs)
        except OSError:
            return False
        return True

    def _stop(self, run_id: str, path: Path, why: Cause) -> None:
        """Records the request to stop a run in its folder; if the disk is full, only the database has the request."""
        try:
            folder.write_stop(path, why)
        except OSError as error:
            _log.warning("run %s: %s cannot be written: %s", run_id, layout.STOP_REQUEST, error.strerror)
        if run_id in self.watches:
            self.watches[run_id].stop(self._settings.grace)

    def _kill(self, run_id: str, path: Path) -> None:
        watch = self.watches.get(run_id)
        worker = watch.worker if watch is not None else self.found.pop(run_id, None)
        if worker is None:
            with suppress(OSError):
                worker = self._launcher.find(run_id, path).worker
        if worker is not None:
            worker.kill()

    def _tell(self, run: Run, status: Status) -> None:
        written = journal.append(self._settings.runs / run.id / layout.JOURNAL, status)
        if self._telemetry is not None:
            self._telemetry.publish(run.owner, written)

    def _launch(self, run: Run, path: Path) -> Watch:
        access = None if self._telemetry is None else self._telemetry.worker(run.owner, run.id)
        try:
            made = folder.submission(path)
            for left in (layout.OUTCOME, layout.STOP_REQUEST):
                folder.put_away(path / left)
            if not folder.is_as_accepted(path, made):
                raise DamagedError(f"{made.case_file} differs from the accepted case")
            case = path / made.case_file
            group = f"{made.owner}/{made.labels['sweep']}" if "sweep" in made.labels else ""
            job = Job(run.id, run.ranks, case, path, access, made.profile, made.wall_time, group, run.threads)
            worker = self._launcher.start(job)
        except (OSError, msgspec.MsgspecError) as error:
            raise DamagedError(str(error)) from error
        return self._watch(path, worker, made.wall_time)

    def _watch(self, path: Path, worker: Worker, allowed: float | None) -> Watch:
        """Returns the supervision of a worker, with the time limit at which the server stops it. The worker itself
        stops at ``run.max_wall_time``. The server stops it a grace period later; a batch system stops it at the limit
        of the job.
        """
        left = (
            None if allowed is None or self._launcher.queues else allowed + self._settings.grace - folder.runs_for(path)
        )
        return Watch(path, worker, left, self._settings.caps.output_bytes)


def _allowed(path: Path) -> float | None:
    """Returns the time limit of a run from its submission, s; None: no limit. The worker has its own time limit in any
    case.
    """
    try:
        return folder.submission(path).wall_time
    except (OSError, msgspec.MsgspecError):
        return None


def of_launch(error: LaunchError) -> LaunchFailed | LaunchPutOff:
    """Returns the event of a failed launch. The launch is put off if the error is temporary, or if an error of the disk
    makes the case unreadable.
    """
    if passing(error):
        return LaunchPutOff(f"the launch is tried again: {error}")
    return LaunchFailed(str(error), Cause.STORAGE if isinstance(error, DamagedError) else Cause.LAUNCH)
