"""Calls of Slurm commands with a time limit, and the errors that a failed command raises.

A failed command raises one of three errors. RefusedError: the controller of Slurm refuses the request for ever.
LaterError: it refuses the request at present. AwayError: the result of the command is unknown. After an AwayError a
submitted job may exist; therefore it is searched for before it is submitted again.
"""

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

_LONGEST = {"squeue": 30.0, "sbatch": 30.0, "scancel": 15.0, "scontrol": 15.0, "sacct": 10.0}
"""Time limits of the Slurm commands, s: one to three times the MessageTimeout of Slurm (chosen values)."""
_RESTS = 20.0
"""Time for which a Slurm command that has exceeded its time limit is not called again, s, so that it does not delay
other commands (chosen value)."""
_REFUSALS = (
    "invalid", "not permitted", "unspecified", "violates", "not available", "unrecognized", "denied", "more processors",
    "not supported", "exceeds", "disabled", "limit", "unknown", "ambiguous", "too ",
)  # fmt: skip
"""Words in the last line of the output of sbatch that mean a final refusal. All other failures of sbatch may be
temporary (connection, socket, authentication)."""
_PASSING = (
    "submit limit", "submitjob", "not available now", "inactive", "is down", "drain", "temporarily", "try again",
    "standby", "maintenance", "i/o error writing", "maxjobs", "grpjobs", "perusers", "peruser", "peraccount",
)  # fmt: skip
"""Words anywhere in the output of sbatch that mean a temporary refusal. The causes are limits that other jobs in the
queue have reached, or a partition that is not up (slurm_errno.c; reasons of squeue(1))."""
_LASTING = ("perjob", "wall", "minc", "mintres", "pernode", "perminute")
"""Words in the output of sbatch for limits that a job exceeds at any time, so that waiting does not help."""
_PASSED_ON = (
    "PATH", "HOME", "USER", "LOGNAME", "SHELL", "LANG", "SLURM_CONF", "CONOID_CACHE_DIR", "MODULEPATH", "MODULESHOME",
    "LD_LIBRARY_PATH", "BASH_ENV", "MPI4PY_LIBMPI", "MPI4PY_MPIABI", "PYTHONPATH",
)  # fmt: skip
"""Environment variables that a job inherits from the process that submits it. Tokens, addresses of databases and
defaults of sbatch are not among them."""


class SlurmError(Exception):
    """Error: a command of Slurm failed. The text of this error is one line."""


class AwayError(SlurmError):
    """Error: the controller of Slurm did not answer, or not in time; the result of the command is unknown. ``command``:
    the Slurm command that got no answer.
    """

    command = ""


class LaterError(SlurmError):
    """Error: the controller of Slurm refuses the request at present: a limit of the user, the account or the QOS
    (quality of service) is reached, or a partition is down.
    """


class RefusedError(SlurmError):
    """Error: the controller of Slurm refuses the request for ever."""


def call(place: str, words: Sequence[str], keep: int | None = None) -> str:
    """Returns the output of a Slurm command. ``place``: folder of the Slurm commands, or empty; ``keep``: open file
    that the command inherits. Raises AwayError, LaterError or RefusedError with the message of the command.
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
"""Time of the monotonic clock, s, until which a command is not called again, by the name of the command."""


def away(command: str, why: str) -> AwayError:
    """Returns the error for a Slurm command that got no answer."""
    error = AwayError(why)
    error.command = command
    return error


def _failure(command: str, lines: Sequence[str]) -> SlurmError:
    """Returns the error for a Slurm command that has failed. sbatch prints the limit that is exceeded in a line before
    the last one.
    """
    text, last = " ".join(lines).lower(), lines[-1][:300]
    named = lines[-2].rpartition(": ")[2] if len(lines) > 1 else ""
    message = f"{last} ({named[:100]})" if named and " " not in named else last
    if command == "sbatch" and any(word in text for word in _PASSING) and not any(word in text for word in _LASTING):
        return LaterError(message)
    return RefusedError(message) if any(word in last.lower() for word in _REFUSALS) else away(command, last)


def environment(base: Mapping[str, str]) -> dict[str, str]:
    """Environment of a Slurm command: the variables that a job may inherit, and the setting with which Slurm prints
    times as Unix times in s.
    """
    kept = {name: value for name, value in base.items() if name in _PASSED_ON or name.startswith("LC_")}
    return {**kept, "SLURM_TIME_FORMAT": "%s"}
