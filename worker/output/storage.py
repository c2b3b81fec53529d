"""Classification of errors of the files of a run. The disk may be full, over its quota or broken, or a file may be
removed.
"""

import errno
import os
from pathlib import Path
from typing import IO, Any

_STORAGE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG, errno.ESTALE})


def gone(error: BaseException, folder: Path) -> bool:
    """Return True if the error is about a file below ``folder`` that was removed or is not accessible."""
    if not isinstance(error, OSError) or not isinstance(error.filename, str | bytes):
        return False
    path = Path(os.fsdecode(error.filename))
    return (path.parent.resolve() / path.name).is_relative_to(folder.resolve())


def require(file: IO[Any], path: Path) -> None:
    """Raise FileNotFoundError if the open ``file`` with this ``path`` was removed."""
    if os.fstat(file.fileno()).st_nlink == 0:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))


def failed(error: BaseException) -> bool:
    """Return True if ``error`` was caused by a disk. The error number may be only in the text of an HDF5 error."""
    if isinstance(error, OSError) and error.errno in _STORAGE:
        return True
    if any(f"errno = {number}," in str(error) for number in _STORAGE):
        return True
    cause = error.__cause__ or error.__context__
    return cause is not None and failed(cause)
