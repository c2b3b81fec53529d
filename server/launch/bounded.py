"""Runs another program of Conoid in a process with limits; a thread of the server waits for the program."""

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
    """Limits of a program. CPU time in s, memory in bytes and size of a written file in bytes limit each process; the
    wall time in s limits all processes together.
    """

    cpu: int
    wall: int
    memory: int
    file: int


@dataclass(frozen=True)
class Ended:
    """Output and exit code of a program that has ended. A negative exit code means that the signal with this number
    ended the program.
    """

    output: bytes
    errors: str
    """Text of the standard error output; a message about the time limit if the program exceeded it."""
    code: int

    @property
    def why(self) -> str:
        """The last line of the standard error output, as the reason of a failure."""
        return next(iter(self.errors.strip().splitlines()[-1:]), f"code {self.code}")


def run(
    program: str, bounds: Bounds, arguments: Sequence[str] = (), question: bytes = b"", *, folder: Path,
    **more: str,
) -> Ended:  # fmt: skip
    """Runs the module ``program`` in ``folder``. ``question``: bytes for the standard input of the program; ``more``:
    additional environment variables of the program. The function returns when the program has ended, and every process
    that shares its standard output.
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
