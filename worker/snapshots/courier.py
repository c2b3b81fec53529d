"""Side thread of a rank. The courier thread writes the copied state of the rank to disk. On rank 0 it also sends tasks
to the packer, which makes snapshots from the shares.
"""

import contextlib
import json
import logging
import os
import queue
import signal
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from typing import Any

from conoid.cases.output import layout

from ..run.signals import REQUESTS
from . import share
from .share import Share

_FAREWELL = 30.0
"""Time for the last snapshots after the last step, s. Chosen value: a hundred times the duration of one snapshot of
150,000 tets."""
_SECRETS = ("CONOID_ZENOH_USER", "CONOID_ZENOH_PASSWORD")

log = logging.getLogger("conoid.worker")


class Courier:
    """Queue and thread for the shares of a rank. The solver never waits for the thread."""

    def __init__(self, folder: Path, rank: int) -> None:
        self._folder, self._rank = folder, rank
        self._tasks: queue.SimpleQueue[tuple[dict[str, Any], Share] | None] = queue.SimpleQueue()
        self._packer: subprocess.Popen[str] | None = None
        self._thread: threading.Thread | None = None
        self.answers: deque[tuple[dict[str, Any], bytes]] = deque()
        """Answers on rank 0, one for each task: the fields of the task with the snapshot, or an ``error``."""
        self.under_way = 0
        """Number of tasks without an answer."""

    @property
    def packer(self) -> int | None:
        """Id of the process that makes the snapshots, or None."""
        return None if self._packer is None else self._packer.pid

    def send(self, task: dict[str, Any], given: Share) -> None:
        """Queue a share for the snapshot ``task["n"]``."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="snapshots", daemon=True)
            self._thread.start()
        self.under_way += 1
        self._tasks.put((task, given))

    def close(self) -> None:
        """Return when all tasks are done, or after a time limit."""
        if self._thread is not None:
            self._tasks.put(None)
            self._thread.join(_FAREWELL)
        self._end()

    def _end(self) -> None:
        """End the packer; the next task starts another packer."""
        if self._packer is not None:
            with contextlib.suppress(OSError):
                self._packer.kill()
            with contextlib.suppress(OSError):
                self._packer.communicate()
        self._packer = None

    def _work(self) -> None:
        """Work on the tasks of the queue.

        Launchers send the requests to stop to all processes of a rank, and the packer must make the last snapshot.
        Therefore the packer inherits the blocked signals of this thread from its start, and ends with its standard
        input.
        """
        signal.pthread_sigmask(signal.SIG_BLOCK, REQUESTS)
        while (task := self._tasks.get()) is not None:
            try:
                (self._folder / layout.SNAPSHOTS).mkdir(exist_ok=True)  # the folder may have been removed
                share.write(layout.share(self._folder, task[0]["n"], self._rank), task[1])
                if self._rank == 0:
                    self._ask(task[0])
            except (OSError, ValueError) as error:
                log.warning("snapshot %d: %s", task[0]["n"], error)
                if self._rank == 0:
                    self.answers.append(({**task[0], "error": str(error)}, b""))

    def _ask(self, task: dict[str, Any]) -> None:
        """Have the packer make a snapshot. Raises OSError, ValueError."""
        if self._packer is None:
            self._packer = _started(self._folder)
        assert self._packer.stdin is not None
        assert self._packer.stdout is not None
        try:
            self._packer.stdin.write(json.dumps(task) + "\n")
            self._packer.stdin.flush()
            answer = json.loads(self._packer.stdout.readline() or '{"error": "its process has ended"}')
        except OSError:
            answer = {"error": "its process has ended"}
        if "n" not in answer:
            self._end()
        data = b"" if "error" in answer else (self._folder / answer["path"]).read_bytes()
        self.answers.append(({**task, **answer}, data))


def _started(folder: Path) -> "subprocess.Popen[str]":
    environment = {name: value for name, value in os.environ.items() if name not in _SECRETS}
    environment["OMP_NUM_THREADS"] = environment["OPENBLAS_NUM_THREADS"] = "1"
    words = [sys.executable, "-P", "-m", "conoid.worker.snapshots.packer", str(folder.resolve())]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
