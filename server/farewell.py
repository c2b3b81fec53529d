"""What the log of a launcher says of the end of its ranks: for a server that is not the launcher's parent."""

import errno
import os
import re
from pathlib import Path

from conoid.cases import layout, whole

_TAIL = 1 << 14
"""Bytes at the end of the log in which the banner of the launcher is looked for. Chosen: a banner has 700."""
_ABORTS = "Abort("
"""What MPICH begins with where a rank ends all others."""
_LAST_WORDS = 300
"""Characters of the last line that are told. Chosen."""
_COMPLAINTS = [
    os.strerror(number).encode()
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.ESTALE, errno.EFBIG)
]
_CODE = re.compile(rb"^=   EXIT CODE: (\d{1,3})$", re.MULTILINE)
_PID = re.compile(rb"^=   PID (\d+) RUNNING AT ", re.MULTILINE)
"""MPICH's banner; Hydra writes it when a rank ends before the others, with the signal's number for a rank killed."""


def exit_code(folder: Path) -> int | None:
    """The code of the rank that ended first, as the newest banner has it; None when there is none."""
    found = _CODE.findall(_tail(folder))
    return int(found[-1]) if found else None


def rank_killed(folder: Path) -> int | None:
    """The number of the process that ended first, as the newest banner has it; None when there is none."""
    found = _PID.findall(_tail(folder))
    return int(found[-1]) if found else None


def last_words(folder: Path, log: Path | None = None) -> str:
    """The last line of the launcher's log, or of another ``log``, that is neither of the launcher's own banner nor of
    MPI, which says that a rank has ended; empty where there is none.
    """
    text = _tail(folder, log).decode(errors="replace")
    said = [line.strip() for line in text.partition("=====")[0].splitlines() if not line.startswith(_ABORTS)]
    return next((line[:_LAST_WORDS] for line in reversed(said) if line), "")


def disk_failed(folder: Path) -> bool:
    """Whether a rank complained of its disk, or could not because there is no room for a complaint."""
    said = _tail(folder)
    if any(words in said for words in _COMPLAINTS):
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
