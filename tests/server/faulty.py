"""Faults at each place at which the supervisor writes, and a launcher whose workers are objects in this process.

Python calls audit hooks before a file is opened, renamed, made or removed; an error of a hook becomes the error of the
call. The functions ``os.write`` and ``os.fsync`` are replaced. A test therefore finds all places in the code at which a
disk can fail, also places in later code.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from conoid.cases import outcome
from conoid.cases.messages import Status
from conoid.cases.output import layout
from conoid.server.database.store import Store
from conoid.server.launch import Exit, Job, LaunchError, Phase, Trace, Worker
from conoid.server.runs import folder, journal
from conoid.server.runs.events import Run
from conoid.server.runs.folder import Process, Submission
from conoid.server.runs.supervisor import Supervisor
from conoid.server.settings import Settings


class CrashError(BaseException):
    """Simulates a kill of the server at this place."""


@dataclass
class Plan:
    """Plan of a fault: the writes below ``root`` fail from number ``place`` on, ``times`` writes in all."""

    root: Path
    place: int
    error: BaseException
    times: int = 1
    reads: bool = False
    """True if opening a file for reading also counts. A process without free descriptors also fails when it opens a
    file for reading."""
    seen: int = 0
    fired: int = 0

    def look(self, path: object) -> None:
        """Counts an access to a file below the root."""
        if not isinstance(path, str | bytes | Path) or not str(os.fsdecode(path)).startswith(str(self.root)):
            return
        self.touch()

    def touch(self) -> None:
        """Counts one place; raises the error at the planned places."""
        self.seen += 1
        if self.place < self.seen <= self.place + self.times:
            self.fired += 1
            raise self.error


class _Current(threading.local):
    plan: Plan | None = None


_current = _Current()
_EVENTS = {"os.rename", "os.mkdir", "os.remove", "os.truncate"}
_fsync, _write = os.fsync, os.write
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def _audit(event: str, arguments: tuple[object, ...]) -> None:
    plan = _current.plan
    if plan is None:
        return
    if event == "open":
        flags = arguments[2]
        if plan.reads or (isinstance(flags, int) and flags & _WRITES):
            plan.look(arguments[0])
    elif event in _EVENTS and not plan.reads:
        plan.look(arguments[0])


sys.addaudithook(_audit)


def fsync(descriptor: int) -> None:
    """Replaces ``os.fsync`` with a call that may fail."""
    if _current.plan is not None and not _current.plan.reads:
        _current.plan.touch()
    _fsync(descriptor)


def write(descriptor: int, data: bytes) -> int:
    """Replaces ``os.write`` with a call that may fail. When the replaced write fails, half of the data are on disk."""
    if _current.plan is not None and not _current.plan.reads:
        try:
            _current.plan.touch()
        except BaseException:
            _write(descriptor, data[: len(data) // 2])
            raise
    return _write(descriptor, data)


@contextmanager
def faults(plan: Plan) -> Iterator[None]:
    """Context in which this thread gets the faults of the plan."""
    _current.plan = plan
    try:
        yield
    finally:
        _current.plan = None


@dataclass
class Puppet:
    """A worker with a planned end (puppet). The writes of a puppet do not fail, as if the puppet were another
    process.
    """

    run: str
    folder: Path
    ends: str = "succeeded"
    alive: bool = True
    stopped: bool = False
    looks: int = 0

    def phase(self) -> Phase:
        """Returns "runs": a puppet has its cores from the start."""
        return "runs"

    def began(self) -> float:
        """Returns 0; no test uses the time."""
        return 0.0

    def note(self) -> str:
        """Returns an empty note."""
        return ""

    def exited(self) -> Exit | None:
        """Polls the worker. The puppet runs from the second poll on, and ends at the fourth poll or after a request to
        stop.
        """
        plan, _current.plan = _current.plan, None
        try:
            self.looks += 1
            if self.alive and self.looks == 2:
                journal.append(self.folder / layout.JOURNAL, Status(run=self.run, state="running"))
            if self.alive and (self.stopped or (self.looks >= 4 and self.ends != "never")):
                self._end("cancelled" if self.stopped else self.ends)
        finally:
            _current.plan = plan
        return None if self.alive else Exit(9 if self.ends == "killed" else 0, False, "")

    def _end(self, state: str) -> None:
        self.alive = False
        if state != "killed":
            ended = outcome.Outcome(state=state, cause="cancelled" if self.stopped else None)
            (self.folder / layout.OUTCOME).write_bytes(outcome.to_json(ended))
        else:
            (self.folder / layout.LOGS / layout.LAUNCHER_LOG).write_text("=   EXIT CODE: 9\n")

    def stop(self) -> None:
        """Requests an end of the worker at the next poll."""
        self.stopped = True

    def kill(self) -> None:
        """Ends the worker at once."""
        self.alive = False


@dataclass
class Puppets:
    """Launcher of puppets, with a list of all puppets that it has started."""

    ends: str = "succeeded"
    refuses: bool = False
    made: list[Puppet] = field(default_factory=list)
    queues: bool = False

    def start(self, job: Job) -> Worker:
        """Starts a worker, and records it afterwards, in the order of a real launcher."""
        if self.refuses:
            raise LaunchError("no mpiexec")
        puppet = Puppet(job.run, job.folder, self.ends)
        self.made.append(puppet)
        try:
            folder.write_process(job.folder, Process(pid=1, started=0, boot="b", launched=0.0))
        except OSError as error:
            puppet.kill()
            raise LaunchError(f"the worker cannot be recorded: {error.strerror}") from None
        return puppet

    def find(self, run: str, path: Path) -> Trace:
        """Returns the worker of a run: a living puppet, or the trace of the process record."""
        living = next((puppet for puppet in self.made if puppet.run == run and puppet.alive), None)
        return Trace(living, living is not None or folder.process(path) is not None, False)

    def tidy(self) -> None:
        """Does nothing: puppets leave no files."""


class House:
    """The server's supervisor, database and launcher on a folder of runs, without HTTP."""

    def __init__(self, runs: Path) -> None:
        runs.mkdir(mode=0o700)
        self.settings = Settings(runs=runs, zenoh_port=None, slots=1, grace=60.0)
        self.store = Store(self.settings.database_url)
        self.puppets = Puppets()
        self.supervisor = self.begin()

    def begin(self) -> Supervisor:
        """Returns a supervisor that has loaded the runs of the folder. The thread of this supervisor does not run;
        tests call its turns.
        """
        made = Supervisor(self.settings, self.store, self.puppets, None, lambda _: None)
        made._take_up()
        return made

    def accept(self) -> Run:
        """Accepts a run in the same steps as a real submission."""
        run_id, now = folder.new_id()
        made = Submission(
            id=run_id, owner="ann", name="bar", title="", ranks=1, submitted=now, case_file="case.toml",
            body_sha256="", idempotency_key=None, wall_time=None, estimate={},
        )  # fmt: skip
        folder.create(self.settings.runs, made, b"", b"")
        run = folder.first(made)
        self.store.add(run, None)
        self.supervisor.admit(run)
        return run
