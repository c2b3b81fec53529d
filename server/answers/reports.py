"""The HTML report of a run that has ended. A separate program makes the report once and stores it in the run's folder.
The program has limits of CPU time, memory and size.
"""

import logging
import math
import os
import tempfile
import time
import uuid
from pathlib import Path

from conoid.cases.output import report
from conoid.cases.reading import whole

from ..errors import ServiceError
from ..launch import bounded
from ..launch.bounded import Bounds
from ..requests.thread_pool import ThreadPool

_log = logging.getLogger("conoid.server")
_BOUNDS = Bounds(cpu=300, wall=300, memory=8 << 30, file=64 << 20)
"""Limits of the program that makes a report. The report of a run of 600,000 tets takes 40 s and 2 GB, and has a size of
5 MB (reason of the chosen limits)."""
_PATIENCE, _WAITING = 900.0, 8
"""Largest time in s that a user waits for a report, and largest number of reports that wait (chosen values)."""
_AGAIN = 600.0
"""Time in s after a failure for which no new attempt is made; until then the answer is the reason of the failure
(chosen value)."""
_MOST_FAILED = 1000
"""Largest number of failures that are stored (chosen value)."""
_LEFT = ".*report-*"
"""Pattern of the names of temporary files of reports, which a server leaves if it is killed."""


class Reporters(ThreadPool):
    """Makes the reports of all users, one at a time."""

    def __init__(self) -> None:
        """Creates the object; a pool with one thread runs the program."""
        super().__init__(each=1, waiting=_WAITING, patience=_PATIENCE, most=1)
        self._failed: dict[Path, tuple[float, ServiceError]] = {}
        """Failed reports by the folder of their run: time and reason of the failure."""

    async def size_of(self, path: Path) -> int:
        """Returns the size in bytes of the report of the run in the folder ``path``; makes the report if it is missing.
        A report that has failed is not attempted again for ten minutes.
        """
        return await self.run(self._once, path)

    def _once(self, path: Path) -> int:
        began, reason = self._failed.get(path, (-math.inf, None))
        if reason is not None and time.monotonic() < began + _AGAIN:
            raise reason.with_traceback(None)
        self._failed.pop(path, None)
        try:
            return made(path)
        except ServiceError as error:
            if error.status == 500:
                self._failed[path] = time.monotonic(), error
                while len(self._failed) > _MOST_FAILED:
                    del self._failed[next(iter(self._failed))]
            raise


def made(path: Path) -> int:
    """Returns the size in bytes of the report of the run in the folder ``path``; makes the report if it is missing. The
    method returns only when the report is made. Raises ServiceError: status 501 without the packages for drawing, 500
    for a report that cannot be made, 507 for a full disk.
    """
    target = path / report.NAME
    try:
        with whole.opened(target, links=False) as there:
            return os.fstat(there.fileno()).st_size
    except OSError:
        pass
    if lacking := report.missing():
        detail = f"the server lacks {', '.join(lacking)}: pip install 'conoid[client,view]' on the server"
        raise ServiceError(501, "no_drawing", detail, hint=f"conoid report {path.name}")
    for left in path.glob(_LEFT):
        left.unlink(missing_ok=True)
    beside = path / f".report-{uuid.uuid4().hex}.html"
    try:
        _make(path, beside)
        beside.replace(target)
        return target.stat().st_size
    except OSError as error:
        raise ServiceError(507, "storage", f"the report cannot be stored: {error.strerror}", retryable=True) from error
    finally:
        beside.unlink(missing_ok=True)


def _make(path: Path, out: Path) -> None:
    """Makes the report in the file ``out``. Raises ServiceError with status 500 and the reason if this fails."""
    with tempfile.TemporaryDirectory(prefix="conoid-report-") as folder:
        ended = bounded.run(
            report.PROGRAM, _BOUNDS, [str(path), str(out)], folder=Path(folder), LP_NUM_THREADS="1",
            OMP_NUM_THREADS="1", TMPDIR=folder,
        )  # fmt: skip
    if ended.code or not out.is_file():
        _log.warning("the report of run %s was not made: %s", path.name, ended.why)
        raise ServiceError(
            500, "no_report", f"the report was not made: {ended.why[:300]}", hint=f"conoid report {path.name}"
        )
