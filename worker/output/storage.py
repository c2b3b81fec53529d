"""Whether a failure is one of the disk: full, over its quota, or broken."""

import errno

_STORAGE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG, errno.ESTALE})


def failed(error: BaseException) -> bool:
    """True when a disk is behind ``error``, also where HDF5 has put the number of the failure into its text."""
    if isinstance(error, OSError) and error.errno in _STORAGE:
        return True
    if any(f"errno = {number}," in str(error) for number in _STORAGE):
        return True
    cause = error.__cause__ or error.__context__
    return cause is not None and failed(cause)
