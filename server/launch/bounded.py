"""A program of another house in a process with limits, which the server waits for in a thread."""

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
    """s of CPU time, bytes of memory, and bytes of a file, of each process; s on the clock of all of them."""

    cpu: int
    wall: int
    memory: int
    file: int


@dataclass(frozen=True)
class Ended:
    """What a program has written, and its code; below 0: a signal has ended it."""

    told: bytes
    said: str
    """On its standard error; what took too long is said there, too."""
    code: int

    @property
    def why(self) -> str:
        """The last line that it has said."""
        return next(iter(self.said.strip().splitlines()[-1:]), f"code {self.code}")


def run(
    program: str, bounds: Bounds, arguments: Sequence[str] = (), question: bytes = b"", *, folder: Path,
    **more: str,
) -> Ended:  # fmt: skip
    """Runs the module ``program`` in ``folder``; ``question`` is its standard input, ``more`` of its environment.
    Blocks until it has ended, and whatever it has started with its standard output.
    """
    limits = [str(most) for most in (bounds.memory, bounds.cpu, bounds.file)]
    env = {name: value for name, value in os.environ.items() if name not in _SECRET} | more
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", _BOUND % program, *limits, *arguments], stdin=pipe, stdout=pipe, stderr=pipe, env=env,
        cwd=folder, start_new_session=True,
    ) as child:  # fmt: skip
        try:
            told, said = child.communicate(question, timeout=bounds.wall)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            told, said = b"", f"not ready after {bounds.wall} s".encode()
    return Ended(told, said.decode("utf-8", "replace"), child.returncode)
