"""A run's folder as the server uses it: the submission, the outcome, the process record; all readable without it."""

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

from conoid.cases import layout, whole
from conoid.cases.messages import Status, to_json
from conoid.cases.outcome import Outcome
from conoid.cases.outcome import from_json as outcome_from_json
from conoid.cases.outcome import to_json as outcome_to_json
from conoid.cases.run import Cause, State

from . import durable, journal
from .events import Run

_ID = re.compile(r"[0-9a-z]{22}")
_LETTERS = "0123456789abcdefghjkmnpqrstvwxyz"
_NEW, _GONE = ".new-", ".gone-"
APART = f"{_NEW}files-"
"""What the names of folders begin with that are there for a moment; a server removes them when it starts."""
_TELLING = (layout.SUBMISSION, layout.JOURNAL, layout.WORKER)
"""One of these is left where a run has been, whatever was damaged."""
_UNREADABLE = "outcome.unreadable.json"
_TITLE = 200
"""Characters of a title that lists have. Chosen: a line or two."""
DAMAGED = (FileNotFoundError, IsADirectoryError, NotADirectoryError, PermissionError)
"""What the system says of a file that is gone, or is none any more (``whole.opened``), or not for this user."""
_NO_FILE = (FileNotFoundError, IsADirectoryError, NotADirectoryError)


class Copy(msgspec.Struct, kw_only=True, frozen=True):
    """A file that the case names, of which the run has its own copy: ``files/<sha256>`` and how its name ends."""

    path: str
    """As the case has it: a name."""
    sha256: str


class Submission(msgspec.Struct, kw_only=True, frozen=True):
    """submission.json: what the server must know again when its database is gone. Times are Unix s."""

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
    """s after which the run is stopped."""
    estimate: dict[str, int | float]
    labels: dict[str, str] = {}
    """Words of the submitter."""
    profile: str = ""
    """Of the batch system; empty where there is none."""
    priority: int = 0
    """Among the runs of its owner."""
    wishes_sha256: str = ""
    """Of labels, profile and priority as they were asked for; empty in what earlier servers wrote."""
    threads: int = 1
    """Of each rank."""
    files: list[Copy] = []

    @property
    def cores(self) -> int:
        """That the run takes."""
        return self.ranks * self.threads


class Process(msgspec.Struct, kw_only=True, frozen=True):
    """worker.json: which process runs it. ``started`` and ``boot`` tell it from a later one with the same number."""

    pid: int
    started: int
    """Clock ticks after the boot."""
    boot: str
    launched: float


_submission = msgspec.json.Decoder(Submission)
_process = msgspec.json.Decoder(Process)
_last_stamp, _stamping = 0, threading.Lock()


def new_id() -> tuple[str, float]:
    """An id of 22 letters and digits, and the Unix time in s. Half of each id is random, and ids sort in the order in
    which they are made, also where the clock is set back.
    """
    global _last_stamp
    with _stamping:
        _last_stamp = stamp = max(time.time_ns() // 1000, _last_stamp + 1)
    return _letters(stamp, 11) + _letters(secrets.randbits(55), 11), time.time()


def begin_after(run_id: str) -> None:
    """Ids to come sort after this one, whatever the clock says."""
    global _last_stamp
    stamp = 0
    for letter in run_id[:11]:
        stamp = stamp << 5 | _LETTERS.index(letter)
    _last_stamp = max(_last_stamp, stamp)


def is_id(text: str) -> bool:
    """True for what ``new_id`` could have made."""
    return _ID.fullmatch(text) is not None


def _letters(number: int, length: int) -> str:
    return "".join(_LETTERS[number >> 5 * place & 31] for place in reversed(range(length)))


def create(
    runs: Path, submission: Submission, case: bytes, resolved: bytes, fill: Callable[[Path], None] | None = None
) -> Path:
    """Makes the folder of an accepted run, in which ``fill`` puts what else belongs there; it appears whole, and is on
    disk when this returns. Raises OSError, and what ``fill`` raises.
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
    """Removes what ``create`` made of a run that nobody was promised."""
    for path in (runs / f"{_NEW}{run_id}", runs / run_id):
        shutil.rmtree(path, ignore_errors=True)


def purge(runs: Path, run_id: str) -> None:
    """Removes the folder of a run: at once for everybody, file by file after that. Raises OSError."""
    beside = runs / f"{_GONE}{run_id}"
    os.rename(runs / run_id, beside)
    durable.sync_folder(runs)
    shutil.rmtree(beside, ignore_errors=True)


def runs_in(runs: Path) -> list[Path]:
    """The folders of all runs, oldest first."""
    return sorted(path for path in runs.iterdir() if is_id(path.name))


def scan(runs: Path) -> Iterator[Path]:
    """The folders of all runs, oldest first; what a killed server left half made, or half removed, is removed."""
    for path in sorted(runs.iterdir()):
        if path.name.startswith((_NEW, _GONE)):
            shutil.rmtree(path, ignore_errors=True)
        elif is_id(path.name) and any(there(path / name) for name in _TELLING):
            yield path


def there(path: Path) -> bool:
    """Whether there is such a file; also where that is nobody's business, since its folder is locked away."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except PermissionError:
        return True
    return True


def submission(folder: Path) -> Submission:
    """Raises OSError, or msgspec.MsgspecError when the file is not one."""
    return _submission.decode(whole.read(folder / layout.SUBMISSION))


def run(folder: Path) -> Run:
    """The run as its folder tells it: the submission, and the Status lines of the journal."""
    return replay(first(submission(folder)), journal.statuses(folder / layout.JOURNAL))


def first(made: Submission) -> Run:
    """The run as it was accepted."""
    return Run(
        made.id, made.owner, made.name, made.ranks, made.submitted, threads=made.threads, title=made.title[:_TITLE]
    )  # fmt: skip


def replay(accepted: Run, told: Iterable[Status]) -> Run:
    """The run as the Status lines of its journal tell it."""
    return reduce(_after, told, accepted)


def _after(told: Run, status: Status) -> Run:
    state, cause = State(status.state), Cause(status.cause) if status.cause else None
    after = replace(told, state=state, cause=cause, message=status.message)
    if state in {State.QUEUED, State.STARTING} and state is not told.state:
        return replace(after, started=status.wall if state is State.STARTING else 0.0)
    return replace(after, finished=status.wall) if state.final else after


def outcome(folder: Path) -> Outcome | None:
    """What outcome.json says; None when there is none, or none that can be read."""
    try:
        return outcome_from_json(whole.read(folder / layout.OUTCOME))
    except (*_NO_FILE, msgspec.MsgspecError, UnicodeDecodeError):
        return None


def outcome_error(folder: Path) -> str:
    """Why outcome.json cannot be read; empty when it can, or when there is none."""
    try:
        outcome_from_json(whole.read(folder / layout.OUTCOME))
    except FileNotFoundError:
        return ""
    except (IsADirectoryError, NotADirectoryError, PermissionError) as error:
        return str(error.strerror)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        return str(error)
    return ""


def write_outcome(folder: Path, ended: Outcome) -> None:
    """Writes outcome.json whole; one that nobody can read is kept beside it. Raises OSError."""
    if outcome_error(folder):
        put_away(folder / layout.OUTCOME, folder / _UNREADABLE)
    durable.write(folder / layout.OUTCOME, outcome_to_json(ended))


def put_away(path: Path, kept: Path | None = None) -> None:
    """Makes the name free, for a file that is to be written whole; what stands there is kept where that is named.

    Raises OSError.
    """
    if kept is not None and not kept.exists():
        os.replace(path, kept)
    elif path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def is_as_accepted(folder: Path, made: Submission) -> bool:
    """Whether the case is the one that was read and checked. Raises OSError."""
    return made.body_sha256 in {"", digest_of(made.case_file, whole.read(folder / made.case_file))}


def digest_of(case_file: str, body: bytes) -> str:
    """Of a case as it was handed in, and of its kind."""
    return hashlib.sha256(case_file.encode() + b"\0" + body).hexdigest()


def write_stop(folder: Path, why: Cause) -> None:
    """Records that a stop was asked for. Raises OSError."""
    durable.write(folder / layout.STOP_REQUEST, why.value.encode())


def stop_asked(folder: Path) -> Cause | None:
    """Why a stop was asked for; None when none was."""
    try:
        return Cause(whole.read(folder / layout.STOP_REQUEST, 80).decode())
    except (OSError, ValueError):
        return None


def process(folder: Path) -> Process | None:
    """The process that was started for the run; None when there was none."""
    try:
        return _process.decode(whole.read(folder / layout.WORKER))
    except (*DAMAGED, msgspec.MsgspecError):
        return None


def write_process(folder: Path, started: Process) -> None:
    """Records the process. Raises OSError."""
    durable.write(folder / layout.WORKER, msgspec.json.encode(started))


def runs_for(folder: Path) -> float:
    """s since the recorded process was started, by the clock of the machine's start; 0 where there is no record."""
    made = process(folder)
    if made is None or not made.started:
        return 0.0
    return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - made.started / os.sysconf("SC_CLK_TCK"))
