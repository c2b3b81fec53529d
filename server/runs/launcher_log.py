"""The end of the ranks, read from the log of the launcher, for a server that is not the parent process of the
launcher.
"""

import errno
import os
import re
from pathlib import Path

from conoid.cases.output import layout
from conoid.cases.reading import whole

_TAIL = 1 << 14
"""Number of bytes at the end of the log in which the banner of the launcher is searched; a banner has 700 bytes (reason
of the chosen value)."""
_ABORTS = "Abort("
"""Beginning of the line that MPICH writes for a rank that ends all others."""
_LAST_WORDS = 300
"""Largest number of characters of the last line that are used (chosen value)."""
_COMPLAINTS = [
    os.strerror(number).encode()
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.ESTALE, errno.EFBIG)
]
_CODE = re.compile(rb"^=   EXIT CODE: (\d{1,3})$", re.MULTILINE)
_PID = re.compile(rb"^=   PID (\d+) RUNNING AT ", re.MULTILINE)
"""Line in the banner that Hydra, the launcher of MPICH, prints if a rank ends before the others. If a signal killed the
rank, the banner contains its number."""


def exit_code(folder: Path) -> int | None:
    """Returns the exit code of the rank that ended first, from the last banner; None if there is no banner."""
    found = _CODE.findall(_tail(folder))
    return int(found[-1]) if found else None


def rank_killed(folder: Path) -> int | None:
    """Returns the process number of the rank that ended first, from the last banner; None if there is no banner."""
    found = _PID.findall(_tail(folder))
    return int(found[-1]) if found else None


def last_words(folder: Path, log: Path | None = None) -> str:
    """Returns the last line of the log that is neither part of a banner nor a line of MPI; empty if there is none.
    ``log``: another log than that of the launcher.
    """
    text = _tail(folder, log).decode(errors="replace")
    lines = [line.strip() for line in text.partition("=====")[0].splitlines() if not line.startswith(_ABORTS)]
    return next((line[:_LAST_WORDS] for line in reversed(lines) if line), "")


def disk_failed(folder: Path) -> bool:
    """Whether a rank reported an error of its disk, or the disk of the log has no space for such a report."""
    text = _tail(folder)
    if any(words in text for words in _COMPLAINTS):
        return True
    try:
        disk = os.statvfs(folder)
    except OSError:
        return False
    return disk.f_bavail * disk.f_frsize < _TAIL or bool(disk.f_flag & os.ST_RDONLY)


def _tail(folder: Path, log: Path | None = None) -> bytes:
    try:
        with whole.opened(log or folder / layout.LOGS / layout.LAUNCHER_LOG) as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - _TAIL))
            return file.read()
    except OSError:
        return b""
