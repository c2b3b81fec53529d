"""The end of a Slurm job, from its record, from the run's folder, and from the list of jobs of Slurm."""

from pathlib import Path

from conoid.cases.run import Cause, State
from conoid.cases.site.batch import Job
from conoid.cases.site.slurm import Entry

from ..runs import launcher_log
from . import Exit, Reading

_READINGS: dict[str, Reading] = {
    "CANCELLED": (State.CANCELLED, Cause.CANCELLED, "was cancelled"),
    "TIMEOUT": (State.TIMED_OUT, Cause.WALLTIME, "has reached its time limit"),
    "DEADLINE": (State.TIMED_OUT, Cause.WALLTIME, "has missed its deadline"),
    "OUT_OF_MEMORY": (State.FAILED, Cause.MEMORY, "has used more memory than it has"),
    "BOOT_FAIL": (State.LOST, Cause.NODE, "has lost its node"),
    "NODE_FAIL": (State.LOST, Cause.NODE, "has lost its node"),
    "REVOKED": (State.LOST, Cause.NODE, "was revoked"),
}


def exit_of(folder: Path, job: Job, entry: Entry) -> Exit:
    """Returns how the job ``entry`` of the run in ``folder`` ended. ``job``: record of the job with the accounting
    data.
    """
    return Exit(_code(job), False, _last_words(folder, job), _reading(entry))


def _code(job: Job) -> int | None:
    """Returns the exit code of the job script, or minus the number of the signal that ended it; None if unknown."""
    code, _, number = job.accounting.get("ExitCode", "").partition(":")
    if not code.isdigit() or not number.isdigit():
        return None
    return -int(number) if int(number) else int(code)


def _last_words(folder: Path, job: Job) -> str:
    """Returns the last line of the log of the ranks. For a task of a job array whose ranks have written no log, returns
    the last line of the log of the task.
    """
    own = launcher_log.last_words(folder)
    if own or not job.array:
        return own
    return launcher_log.last_words(folder, Path(job.array) / f"{job.task}.log")


def _reading(entry: Entry) -> Reading | None:
    if entry.state not in _READINGS:
        return None
    state, cause, message = _READINGS[entry.state]
    return state, cause, f"Slurm job {entry.job} {message}"
