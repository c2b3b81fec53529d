"""Whether a failure is one of the run's files: the disk is full, over its quota or broken, or a file is gone."""

import errno
import os
from pathlib import Path
from typing import IO, Any

_STORAGE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG, errno.ESTALE})


def gone(error: BaseException, folder: Path) -> bool:
    """True when a file below ``folder`` is the trouble: somebody has taken it away, or locked it up."""
    if not isinstance(error, OSError) or not isinstance(error.filename, str | bytes):
        return False
    path = Path(os.fsdecode(error.filename))
    return (path.parent.resolve() / path.name).is_relative_to(folder.resolve())


def require(file: IO[Any], path: Path) -> None:
    """Raises FileNotFoundError when nothing leads to an open ``file`` any more, which had this ``path``."""
    if os.fstat(file.fileno()).st_nlink == 0:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))


def failed(error: BaseException) -> bool:
    """True when a disk is behind ``error``, also where HDF5 has put the number of the failure into its text."""
    if isinstance(error, OSError) and error.errno in _STORAGE:
        return True
    if any(f"errno = {number}," in str(error) for number in _STORAGE):
        return True
    cause = error.__cause__ or error.__context__
    return cause is not None and failed(cause)
