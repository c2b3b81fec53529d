"""Does what ``lifecycle`` decides: writes the journal and the outcome, starts, adopts and ends workers."""

from pathlib import Path

import msgspec

from conoid.cases import layout
from conoid.cases.messages import Status
from conoid.cases.run import State

from . import folder, journal
from .launch import Job, Launcher, LaunchError, Worker
from .lifecycle import Action, Adopt, Journal, Kill, Launch, Run, Stop, WriteOutcome
from .settings import Settings
from .telemetry import Telemetry
from .watch import Watch


class Performer:
    """Belongs to the thread of the supervisor; ``watches`` may be read from any thread."""

    def __init__(self, settings: Settings, launcher: Launcher, telemetry: Telemetry | None) -> None:
        """Watches nobody yet."""
        self._settings, self._launcher, self._telemetry = settings, launcher, telemetry
        self.watches: dict[str, Watch] = {}
        """The workers that live, by run."""
        self.found: dict[str, Worker] = {}
        """Workers that an earlier server started, until they are adopted."""

    def perform(self, run: Run, action: Action, now: float) -> None:
        """One action of a step to ``run`` at the Unix time ``now``. Raises LaunchError, OSError and others."""
        path = self._settings.runs / run.id
        match action:
            case Journal(state, cause, message):
                self._tell(run, Status(run=run.id, wall=now, state=state, cause=cause, message=message))
            case WriteOutcome(outcome):
                folder.write_outcome(path, outcome)
            case Launch():
                self.watches[run.id] = self._launch(run, path)
            case Adopt():
                self.watches[run.id] = self._watch(run, path, self.found.pop(run.id))
                if run.state is State.STOPPING:
                    self.watches[run.id].stop(self._settings.grace)
            case Stop():
                self.watches[run.id].stop(self._settings.grace)
            case Kill():
                self.watches[run.id].worker.kill()

    def _tell(self, run: Run, status: Status) -> None:
        written = journal.append(self._settings.runs / run.id / layout.JOURNAL, status)
        if self._telemetry is not None:
            self._telemetry.publish(run.owner, written)

    def _launch(self, run: Run, path: Path) -> Watch:
        access = None if self._telemetry is None else self._telemetry.worker(run.owner, run.id)
        try:
            (path / layout.OUTCOME).unlink(missing_ok=True)
            made = folder.submission(path)
            case = path / made.case_file
            job = Job(run.id, run.ranks, case, path, access, made.profile, made.wall_time)
            worker = self._launcher.start(job)
            return self._watch(run, path, worker)
        except (OSError, msgspec.MsgspecError) as error:
            raise LaunchError(str(error)) from error

    def _watch(self, run: Run, path: Path, worker: Worker) -> Watch:
        """The worker itself ends at ``run.max_wall_time``; the server steps in a grace later, a batch system at the
        limit of the job.
        """
        allowed = None if self._launcher.queues else folder.submission(path).wall_time
        deadline = None if allowed is None else run.started + allowed + self._settings.grace
        return Watch(path, worker, deadline)
