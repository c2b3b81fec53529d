"""Runs another program of Conoid in a process with limits. A thread of the server waits for the program."""

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_BOUND = """
import os, resource, runpy, sys
memory, cpu, file = map(int, sys.argv[1:4])
for which, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, cpu), (resource.RLIMIT_FSIZE, file)):
    resource.setrlimit(which, (most, most))
os.nice(5)
del sys.argv[1:4]
runpy.run_module(%r, run_name="__main__", alter_sys=True)
"""
_SECRET = ("CONOID_DATABASE", "CONOID_TOKEN")


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Limits of a program. Limits of each process: CPU time in s, memory in bytes, size of a file in bytes; limit of
    all processes together: wall time in s.
    """

    cpu: int
    wall: int
    memory: int
    file: int


@dataclass(frozen=True)
class Ended:
    """Output and exit code of a program that has ended. A negative exit code is minus the number of the signal that
    ended the program.
    """

    output: bytes
    errors: str
    """Text of the standard error output; a message about the time limit if the program exceeded it."""
    code: int

    @property
    def why(self) -> str:
        """Last line of the standard error output."""
        return next(iter(self.errors.strip().splitlines()[-1:]), f"code {self.code}")


def run(
    program: str, bounds: Bounds, arguments: Sequence[str] = (), question: bytes = b"", *, folder: Path,
    **more: str,
) -> Ended:  # fmt: skip
    """Runs the module ``program`` in ``folder``. ``question``: bytes for the standard input of the program; ``more``:
    variables that are added to the environment of the program. The function blocks until the program, and every process
    that shares its standard output, has ended.
    """
    limits = [str(most) for most in (bounds.memory, bounds.cpu, bounds.file)]
    env = {name: value for name, value in os.environ.items() if name not in _SECRET} | more
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-P", "-c", _BOUND % program, *limits, *arguments],
        stdin=pipe, stdout=pipe, stderr=pipe, env=env, cwd=folder, start_new_session=True,
    ) as child:  # fmt: skip
        try:
            output, errors = child.communicate(question, timeout=bounds.wall)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            output, errors = b"", f"not ready after {bounds.wall} s".encode()
    return Ended(output, errors.decode("utf-8", "replace"), child.returncode)
