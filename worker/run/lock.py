"""One writer a folder: rank 0 holds a lock of the run's folder while it lives, on whatever node."""

import fcntl
import time
from pathlib import Path
from typing import IO

from conoid.cases.output import layout

_PATIENCE = 20.0
"""s that the one before gets to leave. Chosen: a killed run is gone within seconds, a lock on a network within ten."""
_PAUSE = 0.2
"""s between two tries. Chosen."""


def hold(folder: Path, patience: float = _PATIENCE) -> IO[str] | None:
    """The open file, which holds the lock until it is closed or the process dies; None when another process has it."""
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
