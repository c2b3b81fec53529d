"""Survey of the files of a case before it is accepted: a program of the worker reads them in a process with limits."""

import logging
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from conoid.cases.reading import survey

from ..launch import bounded
from ..launch.bounded import Bounds

_log = logging.getLogger("conoid.server")
BOUNDS = Bounds(cpu=200, wall=240, memory=8 << 30, file=4 << 30)
"""Limits of the program that reads mesh files. The values were chosen because 16 MB of text (384,000 tets) take some
10 s. A file above this size is not read before the run."""


def surveyed(case: Mapping[str, object], folder: Path) -> bytes:
    """Returns the survey of a case's mesh files in ``folder`` as JSON (conoid.cases.reading.survey).

    Blocks. Empty if the files cannot be read on this machine or within the limits. The run is not refused in this
    case, because it has limits of its own.
    """
    if not survey.installed():
        return b""
    ended = bounded.run(survey.PROGRAM, BOUNDS, question=survey.question(dict(case), folder), folder=folder)
    with suppress(ValueError, msgspec.MsgspecError):
        if ended.code == 0:
            survey.from_json(ended.output)
            return ended.output
    _log.warning("the files of a case have not been read: %s", ended.why)
    return b""
