"""A lock that admits at most one server for a folder of runs."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from .settings import StartError

_LOCK = "server.lock"


class AloneError(StartError):
    """Error: another server uses the folder. The text of this error is one line."""


@contextmanager
def only_one(runs: Path) -> Iterator[None]:
    """Takes the lock of a folder of runs. Two servers with the same folder would start every run twice. Both the folder
    of runs and a lock file in the folder are locked: a lock file alone could be deleted, and some file systems cannot
    lock folders.
    """
    with ExitStack() as stack:
        folder = os.open(runs, os.O_RDONLY | os.O_DIRECTORY)
        stack.callback(os.close, folder)
        file = os.open(runs / _LOCK, os.O_WRONLY | os.O_CREAT, 0o600)
        stack.callback(os.close, file)
        for descriptor in (folder, file):
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise AloneError(
                    f"--runs {runs}: another server or 'conoid run' uses this folder; "
                    "wait until it ends, or choose another folder"
                ) from None
            except OSError:
                if descriptor == file:
                    raise AloneError(f"--runs {runs}: this file system has no locks") from None
        yield
