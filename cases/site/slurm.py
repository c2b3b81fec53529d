"""Slurm through its commands, whose output is machine-readable: submission without duplicates, list of jobs, end of
jobs.

The controller of Slurm writes a new job to disk some seconds after confirming it. If it crashes before, the job is
lost. Therefore this module searches for a job before it submits the job again (module ``slurm_call``).
"""

import fcntl
import os
import re
from collections.abc import Sequence, Set
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ..output import layout
from . import batch
from .batch import Job, Profile
from .slurm_call import AwayError, LaterError, RefusedError, SlurmError, away, call

PENDING = frozenset({"PENDING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESV_DEL_HOLD", "SPECIAL_EXIT"})
NOT_LAUNCHED = "launch failed requeued held"
"""Reason, as Slurm prints it, for a pending job that a node failed to start. Slurm then holds the job until it is
released. The words may be separated by underscores."""
FINAL = frozenset(
    {"BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED",
     "TIMEOUT"}
)  # fmt: skip
"""Final states of a job in the output of squeue(1)."""
_ONE_BY_ONE = 200
"""Largest number of job names in one squeue command; its command line then has at most 10 kB (chosen value)."""


_NUMBER = re.compile(r"\d+(_\d+|_\[[^|]*\])?(\+\d+)?")
"""Pattern of the numbers that Slurm prints: a job, a task of a job array, the waiting tasks of a job array, or a
component of a heterogeneous job."""


class Entry(NamedTuple):
    """A job in the output of squeue."""

    job: str
    state: str
    start: float
    """Unix time of the start of the job, s. For a pending job Slurm estimates this time; 0 if unknown."""
    name: str
    """Name of the job; for a task of a job array, the name with the index of the task (``batch.key_of``)."""
    reason: str

    @property
    def not_launched(self) -> bool:
        """Whether the job waits because a node failed to start it."""
        return self.state in PENDING and self.reason.replace("_", " ").lower() == NOT_LAUNCHED


def jobs(place: str, *names: str) -> list[Entry]:
    """Returns the jobs of this user that Slurm still lists: all of them, or only those with the given names. Names of
    other jobs of the user may contain line breaks. Raises AwayError or RefusedError.
    """
    found: list[Entry] = []
    words = ["squeue", "--noheader", "--array", "--states=all", f"--user={os.getuid()}", "--format=%i|%T|%S|%j|%r"]
    for begin in range(0, max(1, len(names)), _ONE_BY_ONE):
        some = names[begin : begin + _ONE_BY_ONE]
        output = call(place, [*words, *([f"--name={','.join(some)}"] if some else [])])
        if output and not output.endswith("\n"):
            raise away("squeue", "the output of squeue ended in the middle of its list")
        found += _entries(output.split("\n")[:-1], set(some))
    return found


def _entries(lines: Sequence[str], names: Set[str]) -> list[Entry]:
    """Returns the jobs in the lines that squeue has printed. A line that is not in the expected form makes the whole
    list invalid, because a job could be missing. Only a line break in the name of another job is accepted: the text
    after it belongs to that name.
    """
    found, broken = [], False
    for line in lines:
        row = line.strip().split("|", 4)
        head = len(row) >= 4 and _NUMBER.fullmatch(row[0]) is not None and row[1].isupper()
        own = head and len(row) == 5 and (row[3] in names or not names)
        if own:
            found.append(Entry(row[0], row[1], _time(row[2]), _key(row[0], row[3]), row[4]))
        elif not head and not broken:
            raise away("squeue", f"the output of squeue is not a list: {line.strip()[:60]!r}")
        broken = not own if head else broken
    return found


def _key(job: str, name: str) -> str:
    """Returns the name of a job with the index of its task if its number has one, such as 123_4."""
    task = job.partition("_")[2]
    return batch.key_of(name, int(task) if task.isdigit() else None)


def _time(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def details(place: str, job: str) -> dict[str, str]:
    """Returns all properties of a job from the controller of Slurm. If a property is printed twice, the first value
    counts, because paths and comments come last. Raises AwayError; raises RefusedError if the job is unknown.
    """
    output = call(place, ["scontrol", "show", "job", "--oneliner", job])
    found: dict[str, str] = {}
    for name, equals, value in (word.partition("=") for word in output.split()):
        if equals:
            found.setdefault(name, value)
    return found


def accounting(place: str, job: str) -> dict[str, str]:
    """Returns the usage of a job that has ended, from the controller of Slurm."""
    wanted = ("JobState", "ExitCode", "RunTime", "StartTime", "EndTime", "NodeList", "Restarts")
    with suppress(SlurmError):
        return {name: value for name, value in details(place, job).items() if name in wanted}
    return {}


def taken(place: str, job: str) -> dict[str, str]:
    """Returns the usage of a job that has ended, from the accounting database of Slurm if there is one."""
    found: dict[str, str] = {}
    fields = ("State", "ExitCode", "Elapsed", "TotalCPU", "MaxRSS", "NodeList")
    with suppress(SlurmError):
        output = call(place, ["sacct", "--noheader", "--parsable2", f"--jobs={job}", f"--format={','.join(fields)}"])
        for line in output.splitlines()[:1]:
            found |= {f"sacct {name}": value for name, value in zip(fields, line.split("|"), strict=False)}
    return found


def submit(place: str, folder: Path, job: Job, profile: Profile) -> str:
    """Returns the number of the Slurm job for the record ``job``: that of an existing job with this name, otherwise
    that of a new job.

    The sbatch process holds a lock on the folder, also if the process that started it dies. While the lock is held, no
    other process submits the run. Raises AwayError, LaterError, RefusedError or OSError.
    """
    with open(folder / ".submit.lock", "a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise AwayError("an earlier sbatch for this run is under way") from None
        if known := jobs(place, job.name):
            return known[0].job
        try:
            output = call(place, ["sbatch", *batch.sbatch_words(job, profile, folder)], lock.fileno())
        except (RefusedError, LaterError):
            if known := jobs(place, job.name):
                return known[0].job
            raise
    return _number(output)


def _number(output: str) -> str:
    """Returns the number of a new job from the output of ``sbatch --parsable``. Raises AwayError if the output contains
    no number.
    """
    number = output.strip().partition(";")[0]
    if not number.isdecimal():
        raise AwayError(f"sbatch has not printed the number of the job, but {output.strip()[:60]!r}")
    return number


def submit_array(place: str, records: Sequence[Job], profile: Profile) -> dict[int, str]:
    """Returns, for each task of a job array, the number of its job. Jobs that exist already are kept; the other tasks
    are submitted as a new array. A lock of the job array prevents a second submission at the same time. Raises
    AwayError, RefusedError or OSError.
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
            output = call(place, ["sbatch", *batch.array_words(records[0], profile, lacking)], lock.fileno())
            number = _number(output)
            found |= {task: f"{number}_{task}" for task in lacking}
    return found


def cancel(place: str, job: str) -> None:
    """Ends a job, pending or running: Slurm sends TERM, and some time later KILL. Raises AwayError if the controller
    does not answer. A job that has already ended is no error.
    """
    with suppress(RefusedError):
        call(place, ["scancel", job])


def notify(place: str, entry: Entry) -> None:
    """Ends a job that was pending in the output of squeue; sends TERM to the script of any other job. Raises AwayError
    if the controller does not answer.

    The option ``--state=PENDING`` of scancel is not used: for one task of a job array it ends all pending tasks of the
    array.
    """
    if entry.state in PENDING:
        cancel(place, entry.job)
        return
    with suppress(RefusedError):
        call(place, ["scancel", "--batch", "--signal=TERM", entry.job])


def kill(place: str, job: str) -> None:
    """Ends a job at once. Raises AwayError if the controller does not answer."""
    with suppress(RefusedError):
        call(place, ["scancel", "--full", "--signal=KILL", job])
    cancel(place, job)


def release(place: str, job: str) -> None:
    """Releases a job that Slurm holds. Raises AwayError if the controller does not answer. A job that is not held or
    has ended is no error.
    """
    with suppress(RefusedError):
        call(place, ["scontrol", "release", job])


def requeue(place: str, job: str) -> None:
    """Puts a running job back into the queue. Raises AwayError or RefusedError."""
    call(place, ["scontrol", "requeue", job])


def held(folder: Path) -> bool:
    """Whether a rank 0, on any node, is writing into the folder of the run."""
    try:
        with open(os.open(folder / layout.LOCK, os.O_RDONLY | os.O_NONBLOCK), "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def begun(folder: Path, job: Job) -> str:
    """Returns the number of the job with this name that has started; empty if none has started."""
    try:
        return layout.claim(folder, job.name).read_text()
    except FileNotFoundError:
        return ""
