"""A server whose disk fails on demand: the command ``python -m tests.drill.server ORDER ...`` runs ``conoid.server``
with the other arguments.

While the file ORDER exists, file operations of the server below its folder of runs fail as the file ORDER describes, in
JSON. The key ``errno`` is the number of the error; with 0 the operation hangs until the file ORDER is removed. The key
``what`` selects operations: "write" (open for writing, rename, create, remove, write, flush), "open" (open any file, as
without descriptors), "fsync" or "rename". The key ``every`` is n if one of n operations fails.
"""

import errno
import json
import os
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
CHANGES = {"os.rename", "os.mkdir", "os.remove", "os.truncate"}
LOOK = 0.02
"""Time in s for which the content of the order file is cached."""
fsync, write = os.fsync, os.write


class Order:
    """The operations that fail at present."""

    def __init__(self, path: Path, root: str) -> None:
        self.path, self.root, self.looked, self.words = path, root, 0.0, {}  # type: tuple[Path, str, float, dict[str, Any]]
        self.calls, self.busy = count(), False

    def fail(self, kinds: set[str], path: object = None) -> None:
        """Raises the ordered error if one of the given kinds of operation on ``path`` shall fail."""
        if self.busy or (path is not None and not self._mine(path)):
            return
        words = self._read()
        if words and words["what"] in kinds and next(self.calls) % words["every"] == 0:
            if words["errno"]:
                raise OSError(words["errno"], os.strerror(words["errno"]))
            while self.path.exists():
                time.sleep(LOOK)

    def _mine(self, path: object) -> bool:
        return isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith(self.root)

    def _read(self) -> dict[str, Any]:
        now = time.monotonic()
        if now > self.looked + LOOK:
            self.looked, self.busy = now, True
            try:
                self.words = json.loads(self.path.read_text())
            except (OSError, ValueError):
                self.words = {}
            finally:
                self.busy = False
        return self.words


def install(order: Order) -> None:
    """Installs the faults: Python calls audit hooks before file operations, and an exception of a hook stops the
    operation."""

    def audit(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and isinstance(arguments[2], int):
            order.fail({"open", "write"} if arguments[2] & WRITES else {"open"}, arguments[0])
        elif event in CHANGES:
            order.fail({"write", "rename"} if event == "os.rename" else {"write"}, arguments[0])

    def failing_fsync(descriptor: int) -> None:
        order.fail({"write", "fsync"})
        fsync(descriptor)

    def failing_write(descriptor: int, data: bytes) -> int:
        if descriptor > 2:
            order.fail({"write"})
        return write(descriptor, data)

    sys.addaudithook(audit)
    os.fsync, os.write = failing_fsync, failing_write  # type: ignore[assignment]


def order(number: int, what: str = "write", every: int = 1) -> str:
    """Returns the text of an order file."""
    assert number in {0, *errno.errorcode}
    return json.dumps({"errno": number, "what": what, "every": every})


if __name__ == "__main__":
    from conoid.server.__main__ import main

    place = Path(sys.argv[1])
    install(Order(place, sys.argv[sys.argv.index("--runs") + 1]))
    sys.exit(main(sys.argv[2:]))
