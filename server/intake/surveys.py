"""Survey of the files of a case before it is accepted: a program of the worker reads them in a process with limits."""

import logging
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from conoid.cases.reading import survey

_log = logging.getLogger("conoid.server")
CPU, WALL, MEMORY, FILE = 200, 240, 8 << 30, 4 << 30
"""Limits of each process that reads files: s of CPU time and of wall-clock time, bytes of memory and of a written
file. Chosen: 16 MB of text (384,000 tets) take some 10 s; a longer file is read by its run only."""
_BOUND = """
import os, resource, runpy, sys
memory, cpu, file = map(int, sys.argv[1:4])
for which, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, cpu), (resource.RLIMIT_FSIZE, file)):
    resource.setrlimit(which, (most, most))
os.nice(5)
del sys.argv[1:]
runpy.run_module(%r, run_name="__main__", alter_sys=True)
"""
_SECRET = ("CONOID_DATABASE", "CONOID_TOKEN")


def surveyed(case: Mapping[str, object], folder: Path) -> bytes:
    """Returns the survey of a case's mesh files in ``folder`` as JSON (conoid.cases.reading.survey). Blocks.

    Empty if the files cannot be read here or not within the limits. The run is not refused for that: it has limits
    of its own.
    """
    if not survey.installed():
        return b""
    limits = [str(most) for most in (MEMORY, CPU, FILE)]
    command = [sys.executable, "-c", _BOUND % survey.PROGRAM, *limits]
    env = {name: value for name, value in os.environ.items() if name not in _SECRET}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=pipe, env=env, cwd=folder, start_new_session=True
    ) as child:
        try:
            told, said = child.communicate(survey.question(dict(case), folder), timeout=WALL)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            told, said = b"", f"not ready after {WALL} s".encode()
    return _checked(told, said, child.returncode)


def _checked(told: bytes, said: bytes, code: int) -> bytes:
    with suppress(ValueError, msgspec.MsgspecError):
        if code == 0:
            survey.from_json(told)
            return told
    last = said.decode("utf-8", "replace").strip().splitlines()[-1:]
    _log.warning("the files of a case have not been read: %s", last[0] if last else f"code {code}")
    return b""
