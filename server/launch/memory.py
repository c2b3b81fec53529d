"""Finds out whether the kernel has killed a process because memory was short.

The kernel counts such processes, for the machine and for each control group, and writes their process numbers into its
log. A service may not be allowed to read the log of the kernel. Therefore a lack of memory is reported only if the
counts or the log prove it.
"""

import ctypes
import re
import time
from collections import deque
from pathlib import Path

_PROC, _CGROUPS = Path("/proc"), Path("/sys/fs/cgroup")
_READ_ALL, _LOG = 3, 1 << 20
"""Arguments of klogctl(3): the command, and the number of bytes to read from the end of the kernel's log."""
_KILLED = re.compile(rb"Killed process (\d+) \(")
_PAUSE, _RECENT = 0.25, 3.0
"""Time in s between two readings of the count, and time in s before the end of the ranks within which the count must
have increased. Hydra ends the other ranks within a second (reason of the chosen value)."""
_FIRST_NAMESPACE = "pid:[4026531836]"
"""Name of the initial namespace of process numbers. The process numbers in the kernel's log belong to this namespace
(linux/proc_ns.h, PROC_PID_INIT_INO)."""


def kills() -> int:
    """Returns the number of processes that the kernel has killed because memory was short. The number is that of this
    control group if the kernel counts by control group, otherwise that of the machine.
    """
    own = _of_the_group()
    return own if own is not None else _count(_PROC / "vmstat") or 0


def _of_the_group() -> int | None:
    for line in (_PROC / "self/cgroup").read_text().splitlines():
        _, controllers, path = line.split(":", 2)
        if not controllers:
            found = _count(_CGROUPS / path.lstrip("/") / "memory.events")
        elif "memory" in controllers.split(","):
            found = _count(_CGROUPS / "memory" / path.lstrip("/") / "memory.oom_control")
        else:
            continue
        if found is not None:
            return found
    return None


def _count(path: Path) -> int | None:
    try:
        words = dict(line.split(None, 1) for line in path.read_text().splitlines())
        return int(words["oom_kill"])
    except (OSError, KeyError, ValueError):
        return None


class Kills:
    """Finds out which workers the kernel has killed because memory was short. The class is used only in the
    supervisor's thread.
    """

    def __init__(self) -> None:
        """Creates the object and reads the count."""
        self._counts: deque[tuple[float, int]] = deque([(time.monotonic(), kills())])

    def count(self) -> None:
        """Reads the count of killed processes; call it repeatedly while workers run."""
        now = time.monotonic()
        if now < self._counts[-1][0] + _PAUSE:
            return
        self._counts.append((now, kills()))
        while len(self._counts) > 1 and self._counts[1][0] < now - _RECENT:
            self._counts.popleft()

    def ended(self, pid: int | None) -> bool:
        """Whether the kernel has just killed process ``pid`` because memory was short. The kernel's log decides; if it
        cannot be read, an increase of the count decides.
        """
        if kills() == self._counts[0][1]:
            return False
        named = logged()
        return named is None or pid is None or pid in named


def logged() -> set[int] | None:
    """Returns the process numbers of killed processes in the kernel's log; None if the log cannot be read, or if this
    process is in another namespace of process numbers.
    """
    room = ctypes.create_string_buffer(_LOG)
    size = ctypes.CDLL(None).klogctl(_READ_ALL, room, _LOG)
    if size <= 0 or (_PROC / "self/ns/pid").readlink().name != _FIRST_NAMESPACE:
        return None
    return {int(number) for number in _KILLED.findall(room.raw[:size])}
