"""The folder of a run: its submission, case, outcome and process record. All files can be read without a server."""

import hashlib
import os
import re
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import reduce
from pathlib import Path

import msgspec

from conoid.cases.messages import Status, to_json
from conoid.cases.outcome import Outcome
from conoid.cases.outcome import from_json as outcome_from_json
from conoid.cases.outcome import to_json as outcome_to_json
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State

from .. import durable
from . import journal
from .events import Run

_ID = re.compile(r"[0-9a-z]{22}")
_LETTERS = "0123456789abcdefghjkmnpqrstvwxyz"
_NEW, _GONE = ".new-", ".gone-"
APART = f"{_NEW}files-"
"""Beginnings of the names of temporary folders; a server removes such folders when it starts."""
_TELLING = (layout.SUBMISSION, layout.JOURNAL, layout.WORKER)
"""Names of files by which a folder is recognised as that of a run. At least one of them exists, possibly damaged."""
_UNREADABLE = "outcome.unreadable.json"
_TITLE = 200
"""Largest number of characters of a title in lists (chosen value)."""
DAMAGED = (FileNotFoundError, IsADirectoryError, NotADirectoryError, PermissionError)
"""Errors of the operating system that mean that a file is missing, not regular (``whole.opened``), or not readable."""
_NO_FILE = (FileNotFoundError, IsADirectoryError, NotADirectoryError)


class Copy(msgspec.Struct, kw_only=True, frozen=True):
    """A file that the case names. The run has a copy of the file: ``files/<sha256>`` with the ending of its name."""

    path: str
    """Name of the file in the case."""
    sha256: str


class Submission(msgspec.Struct, kw_only=True, frozen=True):
    """The file submission.json: the data of a run that a server needs if it has lost its database. All times are Unix
    times, s.
    """

    id: str
    owner: str
    name: str
    title: str
    ranks: int
    submitted: float
    case_file: str
    body_sha256: str
    idempotency_key: str | None
    wall_time: float | None
    """Time limit of the run, s."""
    estimate: dict[str, int | float]
    labels: dict[str, str] = {}
    """Labels that were given at submission."""
    profile: str = ""
    """Profile of the batch system; empty without a batch system."""
    priority: int = 0
    """Priority of the run among the runs of its owner."""
    wishes_sha256: str = ""
    """Hash of the labels, the profile and the priority of the request; empty in files of earlier servers."""
    threads: int = 1
    """Number of threads of each rank."""
    files: list[Copy] = []

    @property
    def cores(self) -> int:
        """Number of cores that the run uses."""
        return self.ranks * self.threads


class Process(msgspec.Struct, kw_only=True, frozen=True):
    """The file worker.json: the process of the run. A later process with the same number has another ``started``."""

    pid: int
    started: int
    """Start of the process in clock ticks after the boot."""
    boot: str
    launched: float


_submission = msgspec.json.Decoder(Submission)
_process = msgspec.json.Decoder(Process)
_last_stamp, _stamping = 0, threading.Lock()


def new_id() -> tuple[str, float]:
    """Returns an id of 22 letters and digits, and the Unix time, s. Later ids sort after earlier ids."""
    global _last_stamp
    with _stamping:
        _last_stamp = stamp = max(time.time_ns() // 1000, _last_stamp + 1)
    return _letters(stamp, 11) + _letters(secrets.randbits(55), 11), time.time()


def begin_after(run_id: str) -> None:
    """Ensures that later ids sort after ``run_id``."""
    global _last_stamp
    stamp = 0
    for letter in run_id[:11]:
        stamp = stamp << 5 | _LETTERS.index(letter)
    _last_stamp = max(_last_stamp, stamp)


def is_id(text: str) -> bool:
    """True if the text has the form of an id of ``new_id``."""
    return _ID.fullmatch(text) is not None


def _letters(number: int, length: int) -> str:
    return "".join(_LETTERS[number >> 5 * place & 31] for place in reversed(range(length)))


def create(
    runs: Path, submission: Submission, case: bytes, resolved: bytes, fill: Callable[[Path], None] | None = None
) -> Path:
    """Creates the folder of an accepted run. ``fill``: function that adds further files. The folder gets its name only
    when all files are in it and on disk. Raises OSError, and the errors of ``fill``.
    """
    beside, folder = runs / f"{_NEW}{submission.id}", runs / submission.id
    accepted = Status(run=submission.id, seq=1, wall=submission.submitted, state=State.ACCEPTED)
    beside.mkdir(0o700)
    (beside / layout.LOGS).mkdir(0o700)
    durable.write_new(beside / submission.case_file, case)
    durable.write_new(beside / layout.RESOLVED_CASE, resolved)
    durable.write_new(beside / layout.SUBMISSION, msgspec.json.format(msgspec.json.encode(submission), indent=2))
    durable.write_new(beside / layout.JOURNAL, to_json(accepted) + b"\n")
    if fill is not None:
        fill(beside)
    durable.sync_folder(beside)
    os.rename(beside, folder)
    durable.sync_folder(runs)
    return folder


def discard(runs: Path, run_id: str) -> None:
    """Removes the folder of a run whose submission was not acknowledged."""
    for path in (runs / f"{_NEW}{run_id}", runs / run_id):
        shutil.rmtree(path, ignore_errors=True)


def purge(runs: Path, run_id: str) -> None:
    """Removes the folder of a run: renames it, then removes its files. Raises OSError."""
    beside = runs / f"{_GONE}{run_id}"
    os.rename(runs / run_id, beside)
    durable.sync_folder(runs)
    shutil.rmtree(beside, ignore_errors=True)


def runs_in(runs: Path) -> list[Path]:
    """Returns the folders of all runs, oldest first."""
    return sorted(path for path in runs.iterdir() if is_id(path.name))


def scan(runs: Path) -> Iterator[Path]:
    """Yields the folders of all runs, oldest first, and removes incomplete folders that a killed server has left."""
    for path in sorted(runs.iterdir()):
        if path.name.startswith((_NEW, _GONE)):
            shutil.rmtree(path, ignore_errors=True)
        elif is_id(path.name) and any(there(path / name) for name in _TELLING):
            yield path


def there(path: Path) -> bool:
    """Whether a file exists; also True if its folder may not be read."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except PermissionError:
        return True
    return True


def submission(folder: Path) -> Submission:
    """Reads submission.json. Raises OSError, or msgspec.MsgspecError if the file is damaged."""
    try:
        return _submission.decode(whole.read(folder / layout.SUBMISSION, links=False))
    except (UnicodeDecodeError, RecursionError) as error:
        raise msgspec.DecodeError(str(error)) from None


def run(folder: Path) -> Run:
    """Returns the run from the files of its folder: submission.json, and the Status lines of the journal."""
    return replay(first(submission(folder)), journal.statuses(folder / layout.JOURNAL))


def first(made: Submission) -> Run:
    """Returns the run in the state in which it was accepted."""
    return Run(
        made.id, made.owner, made.name, made.ranks, made.submitted, threads=made.threads, title=made.title[:_TITLE]
    )  # fmt: skip


def replay(accepted: Run, statuses: Iterable[Status]) -> Run:
    """Returns the run after the changes in the Status lines of its journal."""
    return reduce(_after, statuses, accepted)


def _after(run: Run, status: Status) -> Run:
    state, cause = State(status.state), Cause(status.cause) if status.cause else None
    after = replace(run, state=state, cause=cause, message=status.message)
    if state in {State.QUEUED, State.STARTING} and state is not run.state:
        return replace(after, started=status.wall if state is State.STARTING else 0.0)
    return replace(after, finished=status.wall) if state.final else after


def outcome(folder: Path) -> Outcome | None:
    """Returns the outcome in outcome.json; None if the file is missing or damaged."""
    try:
        return outcome_from_json(whole.read(folder / layout.OUTCOME, links=False))
    except (*_NO_FILE, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None


def outcome_error(folder: Path) -> str:
    """Returns why outcome.json cannot be read; empty if the file can be read or is missing."""
    try:
        outcome_from_json(whole.read(folder / layout.OUTCOME, links=False))
    except FileNotFoundError:
        return ""
    except (*_NO_FILE, PermissionError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        return str(getattr(error, "strerror", error))
    return ""


def write_outcome(folder: Path, ended: Outcome) -> None:
    """Writes outcome.json completely or not at all; a damaged outcome.json is renamed before. Raises OSError."""
    if outcome_error(folder):
        put_away(folder / layout.OUTCOME, folder / _UNREADABLE)
    durable.write(folder / layout.OUTCOME, outcome_to_json(ended))


def put_away(path: Path, kept: Path | None = None) -> None:
    """Renames a file to ``kept``, if it exists, so that a new file can be written. Raises OSError."""
    if kept is not None and not kept.exists():
        os.replace(path, kept)
    elif path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def is_as_accepted(folder: Path, made: Submission) -> bool:
    """Whether the case on disk is the case that was checked at submission. Raises OSError."""
    return made.body_sha256 in {"", digest_of(made.case_file, whole.read(folder / made.case_file, links=False))}


def digest_of(case_file: str, body: bytes) -> str:
    """Returns the hash of a submitted case together with its content type."""
    return hashlib.sha256(case_file.encode() + b"\0" + body).hexdigest()


def write_stop(folder: Path, why: Cause) -> None:
    """Records that a stop of the run was requested. Raises OSError if the request cannot be written."""
    durable.write(folder / layout.STOP_REQUEST, why.value.encode())


def stop_asked(folder: Path) -> Cause | None:
    """Returns the reason of the requested stop; None if no stop was requested."""
    try:
        return Cause(whole.read(folder / layout.STOP_REQUEST, 80, links=False).decode())
    except (OSError, ValueError):
        return None


def process(folder: Path) -> Process | None:
    """Returns the process that was started for the run; None before the start."""
    try:
        return _process.decode(whole.read(folder / layout.WORKER, links=False))
    except (*DAMAGED, msgspec.MsgspecError):
        return None


def write_process(folder: Path, started: Process) -> None:
    """Records the process of the run. Raises OSError if the record cannot be written."""
    durable.write(folder / layout.WORKER, msgspec.json.encode(started))


def runs_for(folder: Path) -> float:
    """Returns the time since the start of the recorded process, s; 0 without a record."""
    made = process(folder)
    if made is None or not made.started:
        return 0.0
    return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - made.started / os.sysconf("SC_CLK_TCK"))
