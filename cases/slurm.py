"""Slurm by its commands, with output for machines: hand a job over once, look at the queue, end jobs.

A command that fails says one of two things: RefusedError, the controller has read the request and will not have it;
or AwayError, nobody knows. After that a job may be there all the same, so it is looked for before it is handed over
again. The controller writes a new job to disk some seconds after it has said yes, and a crash in between forgets it.
"""

import fcntl
import os
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from . import batch, layout
from .batch import Job, Profile

PENDING = frozenset({"PENDING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESV_DEL_HOLD", "SPECIAL_EXIT"})
NOT_LAUNCHED = "launch failed requeued held"
"""Reason of a pending job, with spaces or underscores: its node did not start it, and Slurm waits for somebody to look
at that."""
FINAL = frozenset(
    {"BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED",
     "TIMEOUT"}
)  # fmt: skip
"""States of squeue(1); in all others a job has its cores."""
_LONGEST = 30.0
"""s that a command may take. Chosen: three times Slurm's own MessageTimeout."""
_REFUSALS = (
    "invalid", "not permitted", "unspecified", "violates", "not available", "unrecognized", "denied", "more processors",
    "not supported", "exceeds", "disabled", "limit", "unknown", "ambiguous", "too ",
)  # fmt: skip
"""Words of sbatch's refusals. What is none of these (a connection, a socket, munge) may be over in a minute."""
_PASSED_ON = (
    "PATH", "HOME", "USER", "LOGNAME", "SHELL", "LANG", "SLURM_CONF", "CONOID_CACHE_DIR", "MODULEPATH", "MODULESHOME",
    "LD_LIBRARY_PATH", "BASH_ENV", "MPI4PY_LIBMPI", "MPI4PY_MPIABI", "PYTHONPATH",
)  # fmt: skip
"""Variables that a job inherits from who hands it over. No token, database or default for sbatch is among them."""


class SlurmError(Exception):
    """A command of Slurm failed; the text is one line."""


class AwayError(SlurmError):
    """The controller was not reached, or not in time: nobody knows."""


class RefusedError(SlurmError):
    """The controller will not do it."""


class Entry(NamedTuple):
    """A job in squeue's list."""

    job: str
    state: str
    start: float
    """Unix s; of a pending job an estimate, 0 when there is none."""
    name: str
    """Of the job; of a task of an array with its place, as ``batch.key_of`` has it."""
    reason: str

    @property
    def not_launched(self) -> bool:
        """Whether it waits because a node did not start it."""
        return self.state in PENDING and self.reason.replace("_", " ").lower() == NOT_LAUNCHED


def call(place: str, words: Sequence[str], keep: int | None = None) -> str:
    """What a command of Slurm prints. ``place``: its folder, or empty; ``keep``: a file that it holds open.

    Raises AwayError, or RefusedError with the last line that it said.
    """
    path = str(Path(place) / words[0]) if place else words[0]
    try:
        done = subprocess.run(
            [path, *words[1:]], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
            timeout=_LONGEST, check=False, env=environment(os.environ), pass_fds=() if keep is None else (keep,),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise AwayError(f"{words[0]} has not answered within {_LONGEST:g} s") from None
    except OSError as error:
        raise AwayError(f"{path}: {error.strerror}") from None
    if done.returncode == 0:
        return done.stdout
    said = done.stderr.strip().splitlines() or [f"{words[0]} ended with code {done.returncode}"]
    refused = any(word in said[-1].lower() for word in _REFUSALS)
    raise (RefusedError if refused else AwayError)(said[-1][:300])


def environment(base: Mapping[str, str]) -> dict[str, str]:
    """For a command: what a job may inherit, and times as Unix s."""
    kept = {name: value for name, value in base.items() if name in _PASSED_ON or name.startswith("LC_")}
    return {**kept, "SLURM_TIME_FORMAT": "%s"}


def jobs(place: str, name: str = "") -> list[Entry]:
    """This user's jobs that Slurm remembers, of one name or all. Raises AwayError, RefusedError."""
    words = ["squeue", "--noheader", "--array", "--states=all", f"--user={os.getuid()}", "--format=%i|%T|%S|%j|%r"]
    told = call(place, [*words, *([f"--name={name}"] if name else [])])
    if told and not told.endswith("\n"):
        raise AwayError("squeue has broken off in the middle of its list")
    return [_entry(line) for line in told.splitlines()]


def _entry(line: str) -> Entry:
    """What is no line of a list makes the whole no list: a job that is not on it may be there all the same."""
    row = line.strip().split("|", 4)
    if len(row) != 5 or not row[0][:1].isdigit() or not row[1].isupper():
        raise AwayError(f"squeue has answered what is no list: {line.strip()[:60]!r}")
    return Entry(row[0], row[1], _time(row[2]), _key(row[0], row[3]), row[4])


def _key(job: str, name: str) -> str:
    """A task of an array has a number such as 123_4."""
    task = job.partition("_")[2]
    return batch.key_of(name, int(task) if task.isdigit() else None)


def _time(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def details(place: str, job: str) -> dict[str, str]:
    """Everything that the controller knows of a job. Raises AwayError, RefusedError when it knows none."""
    told = call(place, ["scontrol", "show", "job", "--oneliner", job])
    pairs = (word.partition("=") for word in told.split())
    return {name: value for name, equals, value in pairs if equals}


def accounting(place: str, job: str) -> dict[str, str]:
    """What a job that has ended took: from the controller, and from the accounting database where there is one."""
    wanted = ("JobState", "ExitCode", "RunTime", "StartTime", "EndTime", "NodeList", "Restarts")
    found: dict[str, str] = {}
    with suppress(SlurmError):
        found = {name: value for name, value in details(place, job).items() if name in wanted}
    fields = ("State", "ExitCode", "Elapsed", "TotalCPU", "MaxRSS", "NodeList")
    with suppress(SlurmError):
        told = call(place, ["sacct", "--noheader", "--parsable2", f"--jobs={job}", f"--format={','.join(fields)}"])
        for line in told.splitlines()[:1]:
            found |= {f"sacct {name}": value for name, value in zip(fields, line.split("|"), strict=False)}
    return found


def submit(place: str, folder: Path, job: Job, profile: Profile) -> str:
    """The number of the one job for ``job``: of one that is there already, else of a new one.

    sbatch holds a lock of the folder, even when who has started it dies; while it is held nobody submits.
    Raises AwayError, RefusedError, OSError.
    """
    with open(folder / ".submit.lock", "a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise AwayError("an earlier sbatch for this run is under way") from None
        if known := jobs(place, job.name):
            return known[0].job
        try:
            told = call(place, ["sbatch", *batch.sbatch_words(job, profile, folder)], lock.fileno())
        except RefusedError:
            if known := jobs(place, job.name):
                return known[0].job
            raise
    return _number(told)


def _number(told: str) -> str:
    """Of a new job, as ``sbatch --parsable`` says it. Raises AwayError."""
    number = told.strip().partition(";")[0]
    if not number.isdecimal():
        raise AwayError(f"sbatch has not said the number of the job, but {told.strip()[:60]!r}")
    return number


def submit_array(place: str, records: Sequence[Job], profile: Profile) -> dict[int, str]:
    """The number of the one job of each task of an array: of those that are there already, and of a new array for
    the others. The lock is the array's. Raises AwayError, RefusedError, OSError.
    """
    with open(Path(records[0].array) / ".submit.lock", "a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise AwayError("an earlier sbatch for this array is under way") from None
        there = {entry.name: entry.job for entry in jobs(place, records[0].name)}
        found = {job.task: there[job.key] for job in records if job.task is not None and job.key in there}
        lacking = [job.task for job in records if job.task is not None and job.key not in there]
        if lacking:
            told = call(place, ["sbatch", *batch.array_words(records[0], profile, lacking)], lock.fileno())
            number = _number(told)
            found |= {task: f"{number}_{task}" for task in lacking}
    return found


def cancel(place: str, job: str) -> None:
    """Ends a job, pending or not: TERM, and KILL a while later. Raises AwayError; one that has ended is none to end."""
    with suppress(RefusedError):
        call(place, ["scancel", job])


def notify(place: str, job: str) -> None:
    """Ends the job when it is pending, else sends TERM to its script. Raises AwayError."""
    with suppress(RefusedError):
        call(place, ["scancel", "--state=PENDING", job])
    with suppress(RefusedError):
        call(place, ["scancel", "--batch", "--signal=TERM", job])


def kill(place: str, job: str) -> None:
    """Ends a job now. Raises AwayError."""
    with suppress(RefusedError):
        call(place, ["scancel", "--full", "--signal=KILL", job])
    cancel(place, job)


def release(place: str, job: str) -> None:
    """A job that is held may start again. Raises AwayError; one that is not held, or has ended, is none to release."""
    with suppress(RefusedError):
        call(place, ["scontrol", "release", job])


def requeue(place: str, job: str) -> None:
    """A running job waits for its turn again. Raises AwayError, RefusedError."""
    call(place, ["scontrol", "requeue", job])


def held(folder: Path) -> bool:
    """True while a rank 0 writes into the run's folder, on whatever node."""
    try:
        with open(os.open(folder / layout.LOCK, os.O_RDONLY | os.O_NONBLOCK), "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def begun(folder: Path, job: Job) -> str:
    """The number of the job that has started under this name; empty when none has."""
    try:
        return layout.claim(folder, job.name).read_text()
    except FileNotFoundError:
        return ""
