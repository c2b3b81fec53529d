"""Survey of the mesh files of a case before the case is accepted. A program of the worker reads the files, in a process
with limits.
"""

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
"""Limits of the program that reads mesh files. The program needs some 10 s for a text file of 16 MB with 384,000 tets
(reason of the chosen values). A file above the size limit is not read before the run."""


def surveyed(case: Mapping[str, object], folder: Path) -> bytes:
    """Returns the survey of a case's mesh files in ``folder`` as JSON (conoid.cases.reading.survey).

    The function returns when the survey is made. The survey is empty if the mesh files cannot be read on this machine
    or exceed the limits. A case with an empty survey is not refused, because its run has limits of its own.
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
