"""Lock of a run's folder. Rank 0 holds the lock while its process lives, so that only one worker at a time writes into
the folder, on any node."""

import fcntl
import time
from pathlib import Path
from typing import IO

from conoid.cases.output import layout

_PATIENCE = 20.0
"""Time to wait for the former holder of the lock, s. Chosen value: a killed run ends within seconds, and a network file
system releases a lock within ten seconds."""
_PAUSE = 0.2
"""Interval between two attempts to get the lock, s. Chosen value."""


def hold(folder: Path, patience: float = _PATIENCE) -> IO[str] | None:
    """Returns the open file that holds the lock; None if another process holds it.

    The lock is held until the file is closed or the process ends."""
    file = (folder / layout.LOCK).open("a")
    deadline = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > deadline:
                file.close()
                return None
            time.sleep(_PAUSE)
        else:
            return file
