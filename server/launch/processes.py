"""The processes in /proc of Linux: which of them exist, and to which run each belongs."""

import os
import signal
import time
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

RUN_VARIABLE = "CONOID_RUN"
"""Environment variable that every process of a run has, including those that a rank starts. A process group would not
contain all processes of a run, because MPI launchers start ranks in sessions of their own."""

_PROC = Path("/proc")
_AFTER_NAME_STATE, _AFTER_NAME_PARENT, _AFTER_NAME_START = 0, 1, 19
"""Positions of state, parent and start time among the fields of /proc/PID/stat that follow the name (proc(5))."""


def boot() -> str:
    """Returns the id of the present boot of the machine."""
    return (_PROC / "sys/kernel/random/boot_id").read_text().strip()


def start_time(pid: int) -> int | None:
    """Returns the time from the boot to the start of process ``pid`` in clock ticks; None if the process has ended."""
    fields = _stat(pid)
    if fields is None or fields[_AFTER_NAME_STATE] in {"Z", "X"}:
        return None
    return int(fields[_AFTER_NAME_START])


def parent(pid: int) -> int:
    """Returns the parent of process ``pid``; 0 if the process has ended."""
    fields = _stat(pid)
    return 0 if fields is None else int(fields[_AFTER_NAME_PARENT])


def _stat(pid: int) -> list[str] | None:
    try:
        text = (_PROC / str(pid) / "stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return None
    return text.rpartition(")")[2].split()


def of_run(run: str) -> list[int]:
    """Returns the running processes of a run that belong to this user, smallest process number first."""
    marker = f"{RUN_VARIABLE}={run}".encode()
    found = []
    for entry in _PROC.iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                if marker in (entry / "environ").read_bytes().split(b"\0"):
                    found.append(int(entry.name))
    return sorted(found)


def leader_of(members: Collection[int]) -> int | None:
    """Returns the first process of a run, the one that the server has started: its parent does not belong to the
    run.
    """
    return next((pid for pid in sorted(members) if parent(pid) not in members), None)


def of_all_runs() -> dict[str, set[int]]:
    """Returns the running processes of all runs of this user, by run."""
    found: dict[str, set[int]] = {}
    marker = f"{RUN_VARIABLE}=".encode()
    for entry in _PROC.iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                for word in (entry / "environ").read_bytes().split(b"\0"):
                    if word.startswith(marker):
                        found.setdefault(os.fsdecode(word[len(marker) :]), set()).add(int(entry.name))
    return found


def end_run(run: str) -> int:
    """Kills the running processes of a run; returns the number of killed processes."""
    members = of_run(run)
    for pid in members:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return len(members)


def unused_shared_memory(folder: Path, prefix: str, age: float) -> list[Path]:
    """Returns the files of this user in ``folder`` that are older than ``age``, s, and that no process has mapped into
    its memory.
    """
    old = time.time() - age
    found = {}
    for path in folder.glob(f"{prefix}*"):
        with suppress(OSError):
            status = path.lstat()
            if status.st_uid == os.getuid() and status.st_mtime < old:
                found[str(path)] = path
    for maps in _PROC.glob("[0-9]*/maps") if found else ():
        with suppress(OSError):
            for line in maps.read_text().splitlines():
                found.pop(line.partition("/")[1] + line.partition("/")[2], None)
    return sorted(found.values())
