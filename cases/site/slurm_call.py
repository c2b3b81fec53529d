"""How a command of Slurm is called, with a limit of time, and what its failure means.

A command that fails says one of three things: RefusedError, the controller has read the request and will not have it;
LaterError, it will not have it now; or AwayError, nobody knows. After that a job may be there all the same, so it is
looked for before it is handed over again.
"""

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

_LONGEST = {"squeue": 30.0, "sbatch": 30.0, "scancel": 15.0, "scontrol": 15.0, "sacct": 10.0}
"""s that a command may take. Chosen: one to three times Slurm's own MessageTimeout."""
_RESTS = 20.0
"""s for which a command that took longer is not tried again, so that it holds up nobody else. Chosen."""
_REFUSALS = (
    "invalid", "not permitted", "unspecified", "violates", "not available", "unrecognized", "denied", "more processors",
    "not supported", "exceeds", "disabled", "limit", "unknown", "ambiguous", "too ",
)  # fmt: skip
"""Words of sbatch's refusals, in its last line. What is none of these (a connection, a socket, munge) may be over in a
minute."""
_PASSING = (
    "submit limit", "submitjob", "not available now", "inactive", "is down", "drain", "temporarily", "try again",
    "standby", "maintenance", "i/o error writing", "maxjobs", "grpjobs", "perusers", "peruser", "peraccount",
)  # fmt: skip
"""Words of refusals that pass, anywhere in what sbatch says: limits by what else is in the queue, a partition that is
not up (slurm_errno.c; reasons of squeue(1))."""
_LASTING = ("perjob", "wall", "minc", "mintres", "pernode", "perminute")
"""Words, in what sbatch says, of limits that this job will never keep."""
_PASSED_ON = (
    "PATH", "HOME", "USER", "LOGNAME", "SHELL", "LANG", "SLURM_CONF", "CONOID_CACHE_DIR", "MODULEPATH", "MODULESHOME",
    "LD_LIBRARY_PATH", "BASH_ENV", "MPI4PY_LIBMPI", "MPI4PY_MPIABI", "PYTHONPATH",
)  # fmt: skip
"""Variables that a job inherits from who hands it over. No token, database or default for sbatch is among them."""


class SlurmError(Exception):
    """A command of Slurm failed; the text is one line."""


class AwayError(SlurmError):
    """The controller was not reached, or not in time: nobody knows. ``command``: which one did not answer."""

    command = ""


class LaterError(SlurmError):
    """The controller will not do it now: a limit of user, account or QOS is reached, or a partition is down."""


class RefusedError(SlurmError):
    """The controller will not do it."""


def call(place: str, words: Sequence[str], keep: int | None = None) -> str:
    """What a command of Slurm prints. ``place``: its folder, or empty; ``keep``: a file that it holds open.

    Raises AwayError, or LaterError or RefusedError with what it said.
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
"""Until when, by the clock that nobody sets, a command is not tried again."""


def away(command: str, why: str) -> AwayError:
    """The error of a command that was not answered."""
    error = AwayError(why)
    error.command = command
    return error


def _failure(command: str, said: Sequence[str]) -> SlurmError:
    """What a command means that has failed. sbatch names the limit in a line of its own, before the last one."""
    text, last = " ".join(said).lower(), said[-1][:300]
    named = said[-2].rpartition(": ")[2] if len(said) > 1 else ""
    told = f"{last} ({named[:100]})" if named and " " not in named else last
    if command == "sbatch" and any(word in text for word in _PASSING) and not any(word in text for word in _LASTING):
        return LaterError(told)
    return RefusedError(told) if any(word in last.lower() for word in _REFUSALS) else away(command, last)


def environment(base: Mapping[str, str]) -> dict[str, str]:
    """For a command: what a job may inherit, and times as Unix s."""
    kept = {name: value for name, value in base.items() if name in _PASSED_ON or name.startswith("LC_")}
    return {**kept, "SLURM_TIME_FORMAT": "%s"}
