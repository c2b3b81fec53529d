"""Lock of a run's folder: rank 0 holds it while the process lives, so that one worker at a time writes into the
folder, on any node."""

import fcntl
import time
from pathlib import Path
from typing import IO

from conoid.cases.output import layout

_PATIENCE = 20.0
"""s to wait for the former holder. Chosen: a killed run is gone within seconds, a lock on a network within ten."""
_PAUSE = 0.2
"""s between two tries. Chosen."""


def hold(folder: Path, patience: float = _PATIENCE) -> IO[str] | None:
    """Returns the open file, which holds the lock until it is closed or the process ends; None if another process
    holds it."""
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
