"""Slurm by its commands, with output for machines: hand a job over once, look at the queue, end jobs.

The controller writes a new job to disk some seconds after it has said yes, and a crash in between forgets it: a job is
looked for before it is handed over again (``slurm_call``).
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
"""Reason of a pending job, with spaces or underscores: its node did not start it, and Slurm waits for somebody to look
at that."""
FINAL = frozenset(
    {"BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED",
     "TIMEOUT"}
)  # fmt: skip
"""States of squeue(1); in all others a job has its cores."""
_ONE_BY_ONE = 200
"""Names that squeue is asked for at once. Chosen: 10 kB of its command line."""


_NUMBER = re.compile(r"\d+(_\d+|_\[[^|]*\])?(\+\d+)?")
"""Of a job, of a task of an array, of tasks that wait, of a part of a job of several."""


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


def jobs(place: str, *names: str) -> list[Entry]:
    """This user's jobs that Slurm remembers, of these names or all: other jobs may have names that break a list.

    Raises AwayError, RefusedError.
    """
    found: list[Entry] = []
    words = ["squeue", "--noheader", "--array", "--states=all", f"--user={os.getuid()}", "--format=%i|%T|%S|%j|%r"]
    for begin in range(0, max(1, len(names)), _ONE_BY_ONE):
        some = names[begin : begin + _ONE_BY_ONE]
        told = call(place, [*words, *([f"--name={','.join(some)}"] if some else [])])
        if told and not told.endswith("\n"):
            raise away("squeue", "squeue has broken off in the middle of its list")
        found += _entries(told.split("\n")[:-1], set(some))
    return found


def _entries(lines: Sequence[str], names: Set[str]) -> list[Entry]:
    """What is no line of a list makes the whole no list: a job that is not on it may be there all the same. A line that
    another job's name has broken is none of these jobs; what follows it belongs to it.
    """
    found, broken = [], False
    for line in lines:
        row = line.strip().split("|", 4)
        head = len(row) >= 4 and _NUMBER.fullmatch(row[0]) is not None and row[1].isupper()
        own = head and len(row) == 5 and (row[3] in names or not names)
        if own:
            found.append(Entry(row[0], row[1], _time(row[2]), _key(row[0], row[3]), row[4]))
        elif not head and not broken:
            raise away("squeue", f"squeue has answered what is no list: {line.strip()[:60]!r}")
        broken = not own if head else broken
    return found


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
    """Everything that the controller knows of a job; of a word that comes twice, the first: paths and comments come
    last. Raises AwayError, RefusedError when it knows none.
    """
    told = call(place, ["scontrol", "show", "job", "--oneliner", job])
    found: dict[str, str] = {}
    for name, equals, value in (word.partition("=") for word in told.split()):
        if equals:
            found.setdefault(name, value)
    return found


def accounting(place: str, job: str) -> dict[str, str]:
    """What a job that has ended took, as the controller has it."""
    wanted = ("JobState", "ExitCode", "RunTime", "StartTime", "EndTime", "NodeList", "Restarts")
    with suppress(SlurmError):
        return {name: value for name, value in details(place, job).items() if name in wanted}
    return {}


def taken(place: str, job: str) -> dict[str, str]:
    """What a job that has ended took, as the accounting database has it, where there is one."""
    found: dict[str, str] = {}
    fields = ("State", "ExitCode", "Elapsed", "TotalCPU", "MaxRSS", "NodeList")
    with suppress(SlurmError):
        told = call(place, ["sacct", "--noheader", "--parsable2", f"--jobs={job}", f"--format={','.join(fields)}"])
        for line in told.splitlines()[:1]:
            found |= {f"sacct {name}": value for name, value in zip(fields, line.split("|"), strict=False)}
    return found


def submit(place: str, folder: Path, job: Job, profile: Profile) -> str:
    """The number of the one job for ``job``: of one that is there already, else of a new one.

    sbatch holds a lock of the folder, even when who has started it dies; while it is held nobody submits.
    Raises AwayError, LaterError, RefusedError, OSError.
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
        except (RefusedError, LaterError):
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
