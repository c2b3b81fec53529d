"""Side thread of a rank (courier), which writes the copied state of the rank to disk. On rank 0 the side thread also
sends tasks to the packer, which is the process that makes snapshots from the copies of all ranks.
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
"""Longest wait for the last snapshots after the last step, s. Chosen value: a hundred times the time of one snapshot of
150,000 tets."""
_SECRETS = ("CONOID_ZENOH_USER", "CONOID_ZENOH_PASSWORD")

log = logging.getLogger("conoid.worker")


class Courier:
    """Queue and side thread for the copied state of a rank. The solver never waits for the thread."""

    def __init__(self, folder: Path, rank: int) -> None:
        self._folder, self._rank = folder, rank
        self._tasks: queue.SimpleQueue[tuple[dict[str, Any], Share] | None] = queue.SimpleQueue()
        self._packer: subprocess.Popen[str] | None = None
        self._thread: threading.Thread | None = None
        self.answers: deque[tuple[dict[str, Any], bytes]] = deque()
        """Answers to the tasks, on rank 0. An answer has the fields of the task, and the snapshot or the field
        ``error``."""
        self.under_way = 0
        """Number of tasks that have no answer yet."""

    @property
    def packer(self) -> int | None:
        """Id of the process that makes the snapshots; None if there is no process."""
        return None if self._packer is None else self._packer.pid

    def send(self, task: dict[str, Any], given: Share) -> None:
        """Queue the copied state of the rank for the snapshot number ``task["n"]``."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="snapshots", daemon=True)
            self._thread.start()
        self.under_way += 1
        self._tasks.put((task, given))

    def close(self) -> None:
        """Wait until all tasks are done, or until a time limit, and return."""
        if self._thread is not None:
            self._tasks.put(None)
            self._thread.join(_FAREWELL)
        self._end()

    def _end(self) -> None:
        """End the packer process. A later task starts another packer process."""
        if self._packer is not None:
            with contextlib.suppress(OSError):
                self._packer.kill()
            with contextlib.suppress(OSError):
                self._packer.communicate()
        self._packer = None

    def _work(self) -> None:
        """Process the tasks of the queue.

        A launcher sends the requests to stop to all processes of a rank, but the packer must make the last snapshot.
        Therefore the packer inherits the blocked signals of this thread, and ends when its standard input ends.
        """
        signal.pthread_sigmask(signal.SIG_BLOCK, REQUESTS)
        while (task := self._tasks.get()) is not None:
            try:
                (self._folder / layout.SNAPSHOTS).mkdir(exist_ok=True)  # a user may have removed the folder
                share.write(layout.share(self._folder, task[0]["n"], self._rank), task[1])
                if self._rank == 0:
                    self._ask(task[0])
            except (OSError, ValueError) as error:
                log.warning("snapshot %d: %s", task[0]["n"], error)
                if self._rank == 0:
                    self.answers.append(({**task[0], "error": str(error)}, b""))

    def _ask(self, task: dict[str, Any]) -> None:
        """Send the task to the packer and wait for the snapshot. Raises OSError, ValueError."""
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
