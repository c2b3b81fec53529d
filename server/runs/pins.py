"""Runs that the rules of the site must not remove, because of the label ``keep`` or of a later request. The last such
request is a hidden file in the folder of the run.
"""

from pathlib import Path

import msgspec

from conoid.cases.reading import whole

from .. import durable
from .folder import submission

_PINNED, _YES, _NO = ".keep", "yes", "no"


def pinned(folder: Path) -> bool:
    """Whether the run must be kept: by the last request; without a request, by its label ``keep``."""
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
    """Returns the labels of the submission. The label ``keep`` is changed by the last request. The result is empty if
    the folder of the run is removed or damaged.
    """
    try:
        made = submission(folder).labels
    except (OSError, msgspec.MsgspecError):
        return {}
    request = last_request(folder)
    return {**made, "keep": request} if request else made


def pin(folder: Path, keep: bool) -> None:
    """Requests that a run is kept, or that it may be removed. Raises OSError if the request cannot be written."""
    durable.write(folder / _PINNED, (_YES if keep else _NO).encode())
