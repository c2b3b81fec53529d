"""Comparison with Akantu: explicit steps of a linear elastic solid on the same mesh, in a process that alternates with
Conoid.

Akantu must be installed (``pip install akantu``) for this interpreter or for the interpreter that BENCH_AKANTU_PYTHON
names.
"""

import os
import subprocess
import sys
from pathlib import Path
from types import TracebackType

_STEPS = Path(__file__).with_name("akantu_steps.py")
TUNED = {"MALLOC_MMAP_THRESHOLD_": "4294967296", "MALLOC_TRIM_THRESHOLD_": "4294967296", "MALLOC_TOP_PAD_": "268435456"}
"""Environment variables that make glibc keep freed memory: Akantu allocates memory in every step."""


def interpreter() -> str:
    """Returns the Python interpreter that has Akantu."""
    return os.environ.get("BENCH_AKANTU_PYTHON", sys.executable)


def version() -> str | None:
    """Returns the version of Akantu; None if it is not installed."""
    ask = "import akantu, importlib.metadata as m; print(m.version('akantu'))"
    answer = subprocess.run([interpreter(), "-c", ask], capture_output=True, text=True, timeout=60)
    return answer.stdout.strip() if answer.returncode == 0 else None


class Akantu:
    """A model of Akantu in a child process."""

    def __init__(self, mesh: Path, finite: bool, tuned: bool) -> None:
        environment = {**os.environ, "OMP_NUM_THREADS": "1", **(TUNED if tuned else {})}
        self._child = subprocess.Popen(
            [interpreter(), str(_STEPS), str(mesh), str(finite).lower()],
            env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self._answer("ready")

    def steps(self, count: int) -> float:
        """Returns the CPU time of ``count`` steps, s."""
        assert self._child.stdin is not None
        print(count, file=self._child.stdin, flush=True)
        return float(self._answer())

    def _answer(self, start: str = "") -> str:
        assert self._child.stdout is not None
        for line in self._child.stdout:
            if line.startswith(start):
                return line
        raise RuntimeError(f"Akantu ended with exit code {self._child.wait(10)}")

    def __enter__(self) -> "Akantu":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._child.stdin is not None
        self._child.stdin.close()
        self._child.wait(30)
