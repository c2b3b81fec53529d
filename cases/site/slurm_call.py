"""Calls of Slurm commands with a time limit, and the classes of the failures of these commands.

A failed command raises one of three errors. RefusedError: the controller refuses the request; LaterError: the
controller refuses the request for now; AwayError: the result is unknown. After an AwayError the job may exist all the
same, so that the job is searched for before it is submitted again.
"""

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

_LONGEST = {"squeue": 30.0, "sbatch": 30.0, "scancel": 15.0, "scontrol": 15.0, "sacct": 10.0}
"""Time limit of a Slurm command, s: one to three times Slurm's own MessageTimeout (chosen value)."""
_RESTS = 20.0
"""Time, s, for which a Slurm command that exceeded its time limit is not repeated, so that it does not delay other
commands (chosen value)."""
_REFUSALS = (
    "invalid", "not permitted", "unspecified", "violates", "not available", "unrecognized", "denied", "more processors",
    "not supported", "exceeds", "disabled", "limit", "unknown", "ambiguous", "too ",
)  # fmt: skip
"""Words of final refusals in the last line of the output of sbatch. All other failures of sbatch (connection, socket,
munge) may be temporary."""
_PASSING = (
    "submit limit", "submitjob", "not available now", "inactive", "is down", "drain", "temporarily", "try again",
    "standby", "maintenance", "i/o error writing", "maxjobs", "grpjobs", "perusers", "peruser", "peraccount",
)  # fmt: skip
"""Words of temporary refusals, anywhere in the output of sbatch. The reasons are limits by other jobs in the queue, or
a partition that is not up (slurm_errno.c; reasons of squeue(1))."""
_LASTING = ("perjob", "wall", "minc", "mintres", "pernode", "perminute")
"""Words in the output of sbatch for limits that a job always exceeds."""
_PASSED_ON = (
    "PATH", "HOME", "USER", "LOGNAME", "SHELL", "LANG", "SLURM_CONF", "CONOID_CACHE_DIR", "MODULEPATH", "MODULESHOME",
    "LD_LIBRARY_PATH", "BASH_ENV", "MPI4PY_LIBMPI", "MPI4PY_MPIABI", "PYTHONPATH",
)  # fmt: skip
"""Environment variables that a job inherits from the process that submits it; tokens, databases and defaults of sbatch
are left out."""


class SlurmError(Exception):
    """Error: a command of Slurm failed. The text of this error is one line."""


class AwayError(SlurmError):
    """Error: the controller was not reached, or not in time, so that the result is unknown. ``command``: the Slurm
    command that has not answered.
    """

    command = ""


class LaterError(SlurmError):
    """Error: the controller refuses the request for now, because a limit of user, account or QOS is reached, or a
    partition is down."""


class RefusedError(SlurmError):
    """Error: the controller refuses the request."""


def call(place: str, words: Sequence[str], keep: int | None = None) -> str:
    """Returns the output of a Slurm command. ``place``: folder of the command, or empty; ``keep``: a file that the
    command keeps open. Raises AwayError, LaterError or RefusedError with the message of the command.
    """
    path, longest = str(Path(place) / words[0]) if place else words[0], _LONGEST[words[0]]
    if _hung.get(path, 0.0) > time.monotonic():
        raise away(words[0], f"{words[0]} has not answered within {longest:g} s, and is tried again soon")
    try:
        done = subprocess.run(
            [path, *words[1:]], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
            timeout=longest, check=False, env=environment(os.environ), pass_fds=() if keep is None else (keep,),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        if words[0] != "squeue":
            _hung[path] = time.monotonic() + _RESTS
        raise away(words[0], f"{words[0]} has not answered within {longest:g} s") from None
    except OSError as error:
        raise away(words[0], f"{path}: {error.strerror}") from None
    if done.returncode == 0:
        return done.stdout
    raise _failure(words[0], done.stderr.strip().splitlines() or [f"{words[0]} ended with code {done.returncode}"])


_hung: dict[str, float] = {}
"""Time of the monotonic clock until which a command is not repeated."""


def away(command: str, why: str) -> AwayError:
    """Returns the error for a command without a response."""
    error = AwayError(why)
    error.command = command
    return error


def _failure(command: str, lines: Sequence[str]) -> SlurmError:
    """Returns the error for a failed command. The command sbatch prints the exceeded limit in a separate line before
    the last line.
    """
    text, last = " ".join(lines).lower(), lines[-1][:300]
    named = lines[-2].rpartition(": ")[2] if len(lines) > 1 else ""
    message = f"{last} ({named[:100]})" if named and " " not in named else last
    if command == "sbatch" and any(word in text for word in _PASSING) and not any(word in text for word in _LASTING):
        return LaterError(message)
    return RefusedError(message) if any(word in last.lower() for word in _REFUSALS) else away(command, last)


def environment(base: Mapping[str, str]) -> dict[str, str]:
    """Environment of a Slurm command: variables that a job may inherit, and the format of times as Unix time in s."""
    kept = {name: value for name, value in base.items() if name in _PASSED_ON or name.startswith("LC_")}
    return {**kept, "SLURM_TIME_FORMAT": "%s"}
