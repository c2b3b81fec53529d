"""Faults on demand at whatever the supervisor writes, and a launcher whose workers live in this process.

Python tells its audit hooks of every file that is opened, renamed, made or removed before it happens, and passes on
what a hook raises; ``os.write`` and ``os.fsync`` are replaced. So every place at which a disk can fail is found by
itself, also one that does not exist yet.
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
    """The server was killed at this place."""


@dataclass
class Plan:
    """Fails at the ``place``-th thing that is written below ``root``, ``times`` times from then on."""

    root: Path
    place: int
    error: BaseException
    times: int = 1
    reads: bool = False
    """Whether opening a file to read it counts: where no descriptor is left."""
    seen: int = 0
    fired: int = 0

    def look(self, path: object) -> None:
        """Raises the error when its time has come."""
        if not isinstance(path, str | bytes | Path) or not str(os.fsdecode(path)).startswith(str(self.root)):
            return
        self.touch()

    def touch(self) -> None:
        """Counts one place."""
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
    """In place of ``os.fsync``."""
    if _current.plan is not None and not _current.plan.reads:
        _current.plan.touch()
    _fsync(descriptor)


def write(descriptor: int, data: bytes) -> int:
    """In place of ``os.write``: half of the data are on disk when it fails."""
    if _current.plan is not None and not _current.plan.reads:
        try:
            _current.plan.touch()
        except BaseException:
            _write(descriptor, data[: len(data) // 2])
            raise
    return _write(descriptor, data)


@contextmanager
def faults(plan: Plan) -> Iterator[None]:
    """This thread meets the faults of the plan inside the block."""
    _current.plan = plan
    try:
        yield
    finally:
        _current.plan = None


@dataclass
class Puppet:
    """A worker that does what a test says. It writes without faults, as a process of its own would."""

    run: str
    folder: Path
    ends: str = "succeeded"
    alive: bool = True
    stopped: bool = False
    looks: int = 0

    def phase(self) -> Phase:
        """It has its cores from the start."""
        return "runs"

    def began(self) -> float:
        """Nobody asks."""
        return 0.0

    def note(self) -> str:
        """There is nothing to add."""
        return ""

    def exited(self) -> Exit | None:
        """Runs at the second look, ends at the fourth, or when it is asked to stop."""
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
        """Obeys at the next look."""
        self.stopped = True

    def kill(self) -> None:
        """Ends at once."""
        self.alive = False


@dataclass
class Puppets:
    """Launches puppets; knows how many live."""

    ends: str = "succeeded"
    refuses: bool = False
    made: list[Puppet] = field(default_factory=list)
    queues: bool = False

    def start(self, job: Job) -> Worker:
        """Like a real launcher: starts, then records."""
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
        """By the record, or among the living."""
        living = next((puppet for puppet in self.made if puppet.run == run and puppet.alive), None)
        return Trace(living, living is not None or folder.process(path) is not None, False)

    def tidy(self) -> None:
        """Nothing to remove."""


class House:
    """A server's inside on a folder."""

    def __init__(self, runs: Path) -> None:
        runs.mkdir(mode=0o700)
        self.settings = Settings(runs=runs, zenoh_port=None, slots=1, grace=60.0)
        self.store = Store(self.settings.database_url)
        self.puppets = Puppets()
        self.supervisor = self.begin()

    def begin(self) -> Supervisor:
        """A supervisor that has taken up what is there; its thread does not run."""
        made = Supervisor(self.settings, self.store, self.puppets, None, lambda _: None)
        made._take_up()
        return made

    def accept(self) -> Run:
        """A run as the desk accepts it."""
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
