"""Runs that are kept permanently, by the label ``keep`` or by a later request. The last request to keep a run is a
hidden file in the run's folder.
"""

from pathlib import Path

import msgspec

from conoid.cases.reading import whole

from .. import durable
from .folder import submission

_PINNED, _YES, _NO = ".keep", "yes", "no"


def pinned(folder: Path) -> bool:
    """Whether the run is kept permanently: by the last request, or without a request by its label ``keep``."""
    if request := last_request(folder):
        return request == _YES
    try:
        return submission(folder).labels.get("keep", _NO) != _NO
    except (OSError, msgspec.MsgspecError):
        return False


def last_request(folder: Path) -> str:
    """Returns the last request to keep the run, ``yes`` or ``no``; empty without a request."""
    try:
        return whole.read(folder / _PINNED, 80).decode()
    except (OSError, UnicodeDecodeError):
        return ""


def labels(folder: Path) -> dict[str, str]:
    """Returns the labels of the submission; the label ``keep`` follows the last request. If the run's folder is removed
    or damaged, the result has no labels.
    """
    try:
        made = submission(folder).labels
    except (OSError, msgspec.MsgspecError):
        return {}
    request = last_request(folder)
    return {**made, "keep": request} if request else made


def pin(folder: Path, keep: bool) -> None:
    """Keeps a run permanently, or allows its removal again. Raises OSError if the request cannot be written."""
    durable.write(folder / _PINNED, (_YES if keep else _NO).encode())
